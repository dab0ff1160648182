"""The status of a session: progress, pauses, time left, remarks."""

from __future__ import annotations

import pytest

from palpate.protocols.canonical import canonical
from palpate.protocols.events import NS, Event
from palpate.protocols.session_state import fold
from palpate.studies.console.status import REMEMBERED, SessionStatus, status_of
from palpate.studies.console.words import about, clock, doing, standing
from tests.studies.live.halls import Hall, sheets_plan

ASK = {"do": "ask", "form": "sliders", "items": ["Soft", "Cold"]}
STARTED, ANSWERS = {"stimulus": "T07", "block": "main"}, {"answers": {"Soft": 1, "Cold": 1}}


def played(*happenings) -> SessionStatus:
    """(t_s, kind, body, trial) each."""
    events = [
        Event(seq, round(t_s * NS), kind, canonical(body), trial, 1)
        for seq, (t_s, kind, body, trial) in enumerate(happenings)
    ]
    return status_of(sheets_plan(), fold(events))


def trial(number, start_s, ended_s):
    return (
        (start_s, "trial_started", STARTED, number), (start_s, "request", ASK, number),
        (ended_s, "reply", ANSWERS, number), (ended_s, "trial_ended", {"as": "answered"}, number),
    )  # fmt: skip


def test_time_left_is_the_pace_of_the_trials_so_far():
    status = played(*trial(1, 100, 110), *trial(2, 110, 130))
    assert status.left_s(130 * NS) == pytest.approx(2 * 15)
    assert status.left_s(140 * NS) == pytest.approx(30 - 10)
    assert status.left_s(500 * NS) == pytest.approx(15), "a trial that takes longer takes nothing off the others"


def test_time_left_is_unknown_before_the_first_trial_is_over_and_nothing_at_the_end():
    assert played((0, "trial_started", STARTED, 1)).left_s(NS) is None
    over = played(*trial(1, 0, 10), (11, "session_ended", {"as": "aborted"}, None))
    assert over.left_s(12 * NS) == 0.0 and standing(over) == "the session is aborted"


@pytest.mark.parametrize(
    ("how", "words"),
    [("declined", "the participant declined"), ("ineligible", "the participant cannot take part")],
)
def test_who_takes_no_part_is_named_and_not_the_session(how, words):
    assert standing(played((1, "session_ended", {"as": how}, None))) == words


def test_a_pause_counts_in_no_time():
    pause = [(104, "experimenter", {"do": "pause"}, 1), (204, "experimenter", {"do": "go_on"}, 1)]
    started, _, *ended = trial(1, 100, 210)
    status = played(started, (102, "request", ASK, 1), *pause)
    assert status.doing_s(206 * NS) == pytest.approx(4.0)
    paused = played(started, (102, "request", ASK, 1), pause[0])
    assert paused.paused and paused.doing_s(150 * NS) == pytest.approx(2.0)
    assert played(started, (102, "request", ASK, 1), *pause, *ended).left_s(210 * NS) == pytest.approx(30.0)


def test_a_trial_that_is_repeated_is_named():
    repeat = (25, "experimenter", {"do": "repeat", "which": "last"}, 2)
    again = played(*trial(1, 0, 10), (20, "trial_started", STARTED, 2), repeat)
    assert again.done == set() and again.remarks[-1].text == "trial 1 is repeated"


def test_what_comes_next_follows_the_place_in_the_plan():
    status = played(*trial(1, 0, 10), (10, "trial_started", STARTED, 2))
    assert status.current().stimulus.id == "T12"
    assert [trial.stimulus.id for trial in status.coming()] == ["T33", "T41"]
    assert [trial.stimulus.id for trial in SessionStatus(sheets_plan()).coming()] == ["T07", "T12"]


def test_only_the_last_remarks_are_kept():
    notes = [(n, "experimenter", {"do": "note", "text": f"note {n}"}, None) for n in range(REMEMBERED + 3)]
    assert next(remark.text for remark in played(*notes).remarks) == "note 3"


def test_the_board_after_a_session_is_that_of_its_ledger(tmp_path):
    from palpate.studies.sessions.record import read
    from palpate.studies.sessions.session import start

    hall = Hall([(0.0, "confirm"), (1.0, "repeat"), *[(2.0, "confirm")] * 6])
    record = read(start(tmp_path, sheets_plan(), hall.rig).path)
    status = status_of(sheets_plan(), record.state)
    assert status == hall.desk.status and status.ended == "complete" and len(status.done) == 4


@pytest.mark.parametrize(
    ("body", "description"),
    [
        (ASK, "rating 2 attributes"),
        ({"do": "ask", "form": "similarity", "items": ["Same"]}, "switching sides and rating 1 attribute"),
        ({"do": "sense", "device": "door_sensors", "seconds": 8.0}, "exploring while door sensors records 8 s"),
        ({"do": "rest", "done": 15, "total": 45}, "resting (15 of 45 behind them)"),
        ({"do": "present", "stimulus": "A", "wish": {}}, "feeling what the sliders give"),
        ({"do": "present", "stimulus": "A"}, "feeling the stimulus"),
        (None, "waiting"),
    ],
)
def test_what_the_participant_is_doing_is_described_in_words(body, description):
    assert doing(body) == description


def test_durations_are_written_as_a_person_would():
    assert [clock(s) for s in (7, 247.9, 3750)] == ["0:07", "4:07", "1:02:30"]
    assert [about(s) for s in (None, 43, 89.9, 600)] == [
        "time left: known after the first trial", "about 40 s left", "about 90 s left", "about 10 min left",
    ]  # fmt: skip
