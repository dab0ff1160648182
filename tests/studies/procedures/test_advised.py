"""Procedures in sessions: kill -9 at any event, replay without them, and procedures that fail."""

import itertools
import threading
from dataclasses import replace

import pytest

from palpate.protocols.events import Aside, Choose, Fault, Reply, ReplyError
from palpate.protocols.runner import Recorded, run
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.simulated_world import Done, Simulated, VirtualClock
from palpate.studies.procedures.advised import Advised, ProcedureFailed, advised
from palpate.studies.procedures.adviser import Estimate, Step, adviser_for
from palpate.studies.sessions.session import resume, start
from palpate.studies.simulation.rig import simulated
from tests.protocols.worlds_for_tests import MemoryLog
from tests.studies.procedures.tracks_for_tests import QUESTPLUS, TWO_DOWN, plan, study

SHORT = {**QUESTPLUS, "stop": {"trials": 8}}


def device(_request, _t_ns):
    return Done(Reply({"presented": True}), 0.5)


def world_of(of, t_ns=0):
    return advised(of, Simulated(Perceiver(of), device, VirtualClock(t_ns)))


def ran(of, events=(), world=None):
    log = MemoryLog(list(events))
    world = world or world_of(of, events[-1].t_ns if events else 0)
    tape = Recorded(events, world, log)
    run(of, tape, tape, {})
    return log.events


def choices(events):
    before = itertools.pairwise(events)
    return [reply.value for asked, reply in before if asked.value.get("do") == "choose" and reply.kind == "reply"]


def test_cut_after_each_event_a_session_of_two_tracks_goes_on_to_the_uninterrupted_one(full_run):
    trials = 8 if full_run else 4
    of = plan({**QUESTPLUS, "stop": {"trials": trials}})
    whole = ran(of)
    assert len(choices(whole)) == 2 * trials + 2 and len({choice.get("index") for choice in choices(whole)}) > 3
    for cut in range(1, len(whole) + 1):
        assert ran(of, whole[:cut]) == whole


def test_a_replay_needs_no_procedure():
    of = plan(SHORT)
    whole = ran(of)
    tape = Recorded(whole)
    run(of, tape, tape, {})
    tape.demand_end()


@pytest.mark.parametrize("which", ["this", "last", "block"])
def test_a_repeated_trial_takes_its_answer_out_of_its_track(which):
    of = plan({**TWO_DOWN, "stop": {"trials": 6}})

    class Repeating:
        def __init__(self):
            self.inner, self.count = world_of(of), 0

        def now(self):
            return self.inner.now()

        def perform(self, request):
            self.count += isinstance(request, Choose)
            if isinstance(request, Choose) and self.count == 9:
                self.count += 1
                return Aside({"do": "repeat", "which": which})
            return self.inner.perform(request)

    world = Repeating()
    events = ran(of, world=world)
    tape = Recorded(events)
    run(of, tape, tape, {})
    answered = [event for event in events if event.kind == "trial_ended" and event.value["as"] == "answered"]
    assert len(answered) == 12 + {"this": 0, "last": 1, "block": 8}[which]
    pasts = {}
    for event in events:
        if event.value.get("do") == "choose":
            pasts.setdefault(event.value["track"], []).append(event.value["past"])
    assert all(past[-1] == 6 for past in pasts.values())


def test_a_track_that_is_over_is_passed_over_and_goes_on_if_its_last_answer_is_withdrawn():
    of = plan({**TWO_DOWN, "down": 1, "last": 2, "stop": {"trials": 30, "reversals": 2}})
    events = ran(of)
    ends = [event.value["as"] for event in events if event.kind == "trial_ended"]
    stops = [choice for choice in choices(events) if "stop" in choice]
    assert ends.count("stopped") == len(stops) == 2 and ends.count("answered") < 40
    assert all(stop["why"] == "2 reversals" and stop["estimate"]["text"] for stop in stops)
    started = [event.trial for event in events if event.kind == "trial_started"]
    assert started == sorted(set(started)) and len(started) < len(of.trials)


class Never:
    """A procedure that never answers; the test ends it."""

    def __init__(self):
        self.ended = threading.Event()

    def advise(self, _past):
        self.ended.wait()
        return Step(0)

    def estimate(self, _past):
        return Estimate()


class Saying:
    """A procedure that says what a test lets it say."""

    def __init__(self, advice):
        self.advice = advice

    def advise(self, past):
        if isinstance(self.advice, Exception):
            raise self.advice
        return self.advice

    def estimate(self, _past):
        return Estimate(threshold=float("nan"))


BAD = {
    "raises": (Saying(ZeroDivisionError("division by zero")), "ZeroDivisionError: division by zero"),
    "off the grid": (Saying(Step(41)), "level number 41 is not on the grid, which has 0 to 40"),
    "negative": (Saying(Step(-1)), "level number -1 is not on the grid"),
    "nan": (Saying(Step(float("nan"))), "level number nan is not on the grid"),
    "true": (Saying(Step(True)), "level number True is not on the grid"),
    "nothing": (Saying(None), "level number None is not on the grid"),
    "hangs": (Never(), "no answer within 0.05 s"),
}


@pytest.mark.parametrize("bad", BAD)
def test_a_procedure_that_fails_is_a_fault_by_name_and_nothing_moves_or_is_lost(bad):
    adviser, message = BAD[bad]
    of, safe = plan(SHORT), []
    good = world_of(of)
    whole = ran(of)
    broken = Advised(good.world, {**good.advisers, "f40": adviser}, lambda: safe.append(True), 0.05)
    log = MemoryLog()
    with pytest.raises(ProcedureFailed, match="failed twice; nothing is lost") as raised:
        run(of, broken, log, {})
    if isinstance(adviser, Never):
        adviser.ended.set()
    assert f"procedure questplus of f40: {message}" in str(raised.value) and safe == [True, True]
    [fault] = [event for event in log.events if event.kind == "fault"]
    assert message in fault.value["message"] and fault.value["device"] == "procedure"
    resumed = ran(of, log.events)
    assert resumed[: len(log.events)] == log.events and resumed[-1].kind == "session_ended"
    assert len(choices(resumed)) == len(choices(whole)) == 18


def test_an_estimate_that_is_not_a_number_is_a_fault():
    of = plan(SHORT)
    good = world_of(of)
    stopping = Saying(adviser_for(of.trials[0].track).advise(((0, True),) * 8))
    world = Advised(good.world, {"f40": stopping, "f250": stopping})
    fault = world.perform(Choose(replace(of.trials[0], past=((0, True),) * 7)))
    assert isinstance(fault, Fault) and "threshold nan is not a finite number" in fault.value["message"]
    after_the_last = world.perform(Choose(replace(of.trials[0], past=((0, True),) * 8)))  # its answer has been given
    assert after_the_last.value == {"stop": True, "why": "8 trials; no estimate: threshold nan is not a finite number"}


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"index": 41, "level": 1.0}, "index 41 is not on the grid of f250, which has 0 to 40"),
        ({"index": True, "level": -39.0}, "index True is not on the grid"),
        ({"index": 1, "level": -39.5}, "level -39.5 is not that of index 1 of f250, -39.0"),
        ({"index": 1, "level": float("nan")}, "level nan is not that of index 1"),
        ({"level": -39.0}, "index None is not on the grid"),
        ({"stop": True}, "stop: true and why: TEXT are expected"),
        ({"stop": True, "why": "enough", "index": 1}, "stop: true and why: TEXT are expected"),
    ],
)
def test_the_runner_refuses_a_level_that_is_not_declared_whoever_gives_it(value, message):
    trial = next(trial for trial in plan(SHORT).trials if trial.track.name == "f250")
    with pytest.raises(ReplyError, match=message):
        Choose(trial).demand_answer(Reply(value))


@pytest.mark.parametrize("adviser", ["f40", "f250"])
def test_interleaving_and_targets_are_fixed_ahead(adviser):
    of, again = plan(SHORT), plan(SHORT, seed=1)
    order = [trial.track.name for trial in of.trials]
    assert order.count(adviser) == 8 and all(set(order[n : n + 2]) == {"f40", "f250"} for n in range(0, 16, 2))
    assert order != [trial.track.name for trial in again.trials]


def test_a_session_on_disk_is_resumed_after_a_failure(tmp_path, monkeypatch):
    of, declared = plan(SHORT), study(SHORT)
    whole = start(tmp_path / "whole", of, simulated(declared, tmp_path))
    from palpate.studies.procedures.questplus import QuestPlusAdviser

    advise = QuestPlusAdviser.advise

    def failing(self, past):
        if len(past) == 5:
            raise RuntimeError("out of order")
        return advise(self, past)

    with monkeypatch.context() as broken:
        broken.setattr(QuestPlusAdviser, "advise", failing)
        with pytest.raises(ProcedureFailed, match="RuntimeError: out of order"):
            start(tmp_path / "lab", of, simulated(declared, tmp_path))
    [path] = (tmp_path / "lab").rglob("*.sqlite")
    assert resume(path, simulated(declared, tmp_path)).complete and whole.complete
