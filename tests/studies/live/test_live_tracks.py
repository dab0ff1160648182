"""Tracks in live sessions: an interruption between intervals, what a study repeats after it, a procedure that fails."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from palpate.protocols.plan import compile_plan
from palpate.protocols.runner import BROKEN_OFF
from palpate.protocols.trial import ParticipantRow
from palpate.studies.launching.launch import WrongTime, demand_soon
from palpate.studies.procedures.advised import ProcedureFailed
from palpate.studies.procedures.adviser import Step
from palpate.studies.procedures.staircase import StaircaseAdviser
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session import resume, start
from tests.studies.labs import stopping
from tests.studies.live.halls import Hall
from tests.studies.procedures.tracks_for_tests import study

HOUR_NS = 3600 * 10**9
ORDERS = [(0.0, "confirm")] * 200
STAIRCASE = {
    "kind": "staircase", "level": {"column": "level_db", "from": -40, "to": 0, "points": 41}, "start": -10,
    "stop": {"trials": 3}, "last": 2,
}  # fmt: skip


def plan(**changes):
    needs = {"needs": ["window", "samples"], "instructions": "Feel both."}
    return compile_plan(study(STAIRCASE, **{**needs, **changes}), ParticipantRow("P001"))


def interrupted(lab, of, do, number):
    """Start a live session and interrupt it at the n-th request of a kind; return its path."""
    acts, events = 0, read(start(lab / "whole", of, Hall(ORDERS, turns=1).rig).path).events
    for event in events:
        acts += event.kind == "request"
        number -= event.kind == "request" and event.value["do"] == do
        if number == 0:
            break
    result = start(lab / "lab", of, stopping(Hall(ORDERS, turns=1).rig, acts - 1))
    assert not result.complete
    return result.path


def resumed(path):
    """Resume the session in a new hall; return the events that came after the interruption, and the hall."""
    before, hall = len(read(path).events), Hall(ORDERS, turns=1)
    assert resume(path, hall.rig).complete
    replay(path)
    return read(path).events[before:], hall


@pytest.mark.parametrize(("do", "number", "repeated"), [("present", 3, False), ("present", 4, True), ("ask", 2, True)])
def test_a_trial_that_was_interrupted_between_its_intervals_begins_again(tmp_path, do, number, repeated):
    events, _ = resumed(interrupted(tmp_path, plan(), do, number))
    assert ([event.value for event in events if event.kind == "fault"] == [BROKEN_OFF.value]) == repeated
    first = next(event for event in events if event.kind == "trial_started")
    assert (first.attempt == 2) == repeated


def test_the_instructions_are_shown_again_before_the_session_goes_on(tmp_path):
    of = plan(resume={"repeat": ["instructions"]})
    events, hall = resumed(interrupted(tmp_path, of, "choose", 3))
    [shown] = [event for event in events if event.kind == "experimenter"]
    assert shown.value == {"do": "instructed", "page": "instructions"} and hall.stage.pages[0] == "instruct"
    presented = next(event for event in events if event.kind == "reply" and event.value.get("presented"))
    assert shown.seq < presented.seq


def test_the_block_under_way_begins_again_and_its_answers_no_longer_count(tmp_path):
    order = {
        "design": "random",
        "within": "block",
        "blocks": {"by": "frequency_hz", "instructions": {"40": "Glove on"}},
    }
    of = plan(resume={"repeat": ["block"]}, order=order)
    path = interrupted(tmp_path, of, "choose", 6)  # the fourth is asked after the first block
    block = of.trials[4].block
    events, _ = resumed(path)
    assert {"do": "repeat", "which": "block"} in [event.value for event in events]
    record = read(path)
    withdrawn = [attempt.trial for attempt in record.state.attempts if attempt.withdrawn]
    assert sorted(set(withdrawn)) == [4, 5] and all(of.trials[n - 1].block == block for n in withdrawn)
    assert len(record.state.counting) == 6
    pages = [event.value["page"] for event in record.events if event.value.get("do") == "instruct"]
    assert pages.count("block 40") == (2 if block == "40" else 1)


def test_nothing_is_repeated_before_the_first_trial(tmp_path):
    of = plan(resume={"repeat": ["instructions", "block"]})
    events, _ = resumed(interrupted(tmp_path, of, "instruct", 1))
    assert not [event for event in events if event.kind == "experimenter"]


def test_a_session_is_resumed_in_time_or_that_is_accepted_on_record(tmp_path):
    path = interrupted(tmp_path, plan(resume={"within_h": 24}), "choose", 2)
    record = read(path)
    last = datetime.fromisoformat(record.run_notes[-1].value["at"])
    assert demand_soon(record, False, last + timedelta(hours=23.9)) is None
    with pytest.raises(WrongTime, match=r"interrupted 30\.0 h ago; the study allows at most 24 h"):
        demand_soon(record, False, last + timedelta(hours=30))
    accepted = demand_soon(record, True, last + timedelta(hours=30))
    assert accepted == {"resumed_after_h": 30.0, "within_h": 24.0}
    # A killed run left no note at its end: its last event counts, which came five hours after it began.
    begun = record.run_notes[0]
    events = (*record.events[:-1], replace(record.events[-1], t_ns=record.events[begun.events - 1].t_ns + 5 * HOUR_NS))
    killed = replace(record, events=events, run_notes=(begun,))
    began = datetime.fromisoformat(begun.value["at"])
    assert demand_soon(killed, False, began + timedelta(hours=28.9)) is None
    with pytest.raises(WrongTime, match=r"interrupted 24\.1 h ago"):
        demand_soon(killed, False, began + timedelta(hours=29.1))
    assert demand_soon(read(interrupted(tmp_path / "x", plan(), "choose", 2)), False, datetime.now(UTC)) is None


def test_a_procedure_that_fails_makes_the_rig_safe_and_ends_the_run(tmp_path, monkeypatch):
    hall = Hall(ORDERS, turns=1)
    with monkeypatch.context() as broken:
        broken.setattr(StaircaseAdviser, "advise", lambda _self, past: Step(99 if len(past) == 1 else 20))
        with pytest.raises(ProcedureFailed, match="procedure staircase of f.*: level number 99 is not on the grid"):
            start(tmp_path, plan(), hall.rig)
    assert hall.made_safe == [True, True] and hall.stage.closed
    [path] = tmp_path.rglob("*.sqlite")
    assert read(path).status == "interrupted"
    events, _ = resumed(path)
    assert events[-1].kind == "session_ended"
