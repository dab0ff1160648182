"""What the console says of trials whose levels procedures choose: levels, intervals, and the ends of tracks."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from palpate.devices.desk import Prompt
from palpate.protocols import study
from palpate.protocols.canonical import canonical
from palpate.protocols.events import Event
from palpate.protocols.plan import compile_plan
from palpate.protocols.session_state import SessionState
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.console.desk import ExperimenterDesk
from palpate.studies.console.display import View
from palpate.studies.console.page import page
from palpate.studies.console.status import status_of
from palpate.studies.console.words import doing_now, standing
from tests.studies.live.halls import Paper, Script, Time

STARTED = ("trial_started", {"stimulus": "A", "block": "main"})
CHOOSE = ("request", {"do": "choose", "track": "A", "past": 0})
PART = {"do": "present", "stimulus": "A", "interval": 2, "level": -18}


def plan(blind=(), **intervals):
    data = {
        "study": "toy", "task": "intervals", "stimuli": [{"id": "A"}], "intervals": intervals,
        "procedure": {"kind": "constant", "level": {"column": "level_db", "values": [-18, 0]}, "repeats": 2},
        "order": {"design": "as_listed"},
    }  # fmt: skip
    made = Study.model_validate(data)
    console = study.Console(blind=blind) if blind else None
    return compile_plan(made.model_copy(update={"console": console}), ParticipantRow("P001"))


def events(*happenings, trial=1):
    return [Event(seq, seq * 10**9, kind, canonical(body), trial, 1) for seq, (kind, body) in enumerate(happenings)]


def status(of, *happenings):
    state = SessionState()
    for event in events(*happenings):
        state.apply(event)
    return status_of(of, state)


@pytest.mark.parametrize(
    ("body", "blind", "words"),
    [
        (CHOOSE[1], (), "waiting while the level is chosen"),
        ({"do": "show", "page": "right_answer", "seconds": 1.0}, (), "seeing whether the answer was right"),
        (PART, (), "presenting interval 2 of 2 at level -18"),
        (PART | {"level": [0.5, 2]}, (), "presenting interval 2 of 2 at level 0.5, 2"),
        ({"do": "present", "stimulus": "A", "interval": 1, "blank": True}, (),
         "presenting interval 1 of 2, without a stimulus"),
        (PART | {"sides": ["", "A"]}, (), "presenting 2 at once at level -18"),
        (PART, ("level_db",), "presenting interval 2 of 2"),
        ({"do": "present", "stimulus": "A", "interval": 1, "blank": True}, ("level_db",), "presenting interval 1 of 2"),
        (PART, ("material",), "presenting interval 2 of 2 at level -18"),
    ],
)  # fmt: skip
def test_the_interval_and_its_level_are_told_unless_the_level_is_blind(body, blind, words):
    assert doing_now(status(plan(blind), STARTED, ("request", body))) == words


def test_there_are_at_most_so_many_trials():
    assert standing(status(plan(), STARTED)) == "trial 1 of at most 4"
    assert standing(status(plan())) == "0 of at most 4 trials done"


def desk(of):
    time = Time()
    one = ExperimenterDesk(of, Script(time), Paper(), time.seconds)
    one.poll()
    return one


def remarks(one):
    return [remark.text for remark in one.status.remarks]


@pytest.mark.parametrize(
    ("blind", "text"),
    [
        ((), "track A ended: 3 reversals were made; threshold -11.8 (SD 1.1)"),
        (("level_db",), "a track ended: 3 reversals were made"),
    ],
)
def test_the_end_of_a_track_is_told_with_its_reason(blind, text):
    one = desk(plan(blind))
    stop = {"stop": True, "why": "3 reversals were made", "estimate": {"text": "threshold -11.8 (SD 1.1)"}}
    for event in events(STARTED, CHOOSE, ("reply", stop)):
        one.watch(event)
    assert remarks(one) == [text] and one.display.lines[-1] == f"[0:02] {text}"


def test_a_track_that_has_had_all_its_trials_has_ended():
    one, answered = desk(plan()), ("trial_ended", {"as": "answered"})
    for event in events(STARTED, answered, trial=3):
        one.watch(event)
    assert remarks(one) == []
    for event in events(STARTED, answered, trial=4):
        one.watch(event)
    assert remarks(one) == ["track A ended: all its trials are done"]


def printed(view):
    console = Console(width=100, height=30, file=io.StringIO())
    console.print(page(view, view.status.t_ns, 100, 30), height=30)
    return console.file.getvalue()


def test_the_page_shows_the_interval_while_a_mounted_sample_is_felt_and_the_key_of_blocks():
    view = View(status(plan(), STARTED, ("request", PART)), Prompt("Interval 2 of 2: put in place A"))
    assert "waiting for the stimulus" in printed(view) and "trial 1 of at most 4" in printed(view)
    assert "presenting interval 2 of 2" in printed(replace(view, states={"window": "interval 2"}))
    assert "B the block" in printed(view)


def test_trials_that_are_passed_over_are_no_longer_expected():
    of = plan()
    before = status(of, STARTED, CHOOSE)
    stop = ("reply", {"stop": True, "why": "enough"})
    after = status(of, STARTED, CHOOSE, stop, ("trial_ended", {"as": "stopped"}))
    assert (before.total, after.total) == (4, 0) and after.passed_over == {1, 2, 3, 4}
