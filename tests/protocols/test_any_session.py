"""Sessions in which anything may happen: cut anywhere, they go on to the same end, byte for byte."""

import random

import pytest

from palpate.protocols.answering import answer
from palpate.protocols.perceiver import Perceiver
from palpate.protocols.requests import Aside, Ask, Present, Reply, Samples, Sense
from palpate.protocols.runner import run
from palpate.protocols.worlds import Recorded
from tests.protocols.every_task import PARTS, plan_of
from tests.protocols.worlds_for_tests import Kept

HEADER = {"calibration": {"px_per_mm": 3.6}}
ONE_WAY = ("authoring", "capture")
ASIDES = ({"do": "note", "text": "sneezed"}, {"do": "pause"}, {"do": "go_on"})
REPEATS = ({"do": "repeat", "which": "this"}, {"do": "repeat", "which": "last"})
ABORT = {"do": "abort", "text": "felt unwell"}


class Chance:
    """A participant and an experimenter without memory: the length of the log alone decides what they do."""

    def __init__(self, plan, log, seed):
        self.person, self.log, self.seed = Perceiver(plan), log, seed

    def now(self):
        return 1_000 * len(self.log.events)

    def perform(self, request):
        chance = random.Random(f"{self.seed} {len(self.log.events)}")
        if chance.random() < 0.25:
            inside = self.log.events[-1].trial is not None
            return Aside(ABORT if chance.random() < 0.02 else chance.choice(ASIDES + REPEATS * inside))
        if isinstance(request, Ask):
            goes_back = request.may_go_back and chance.random() < 0.25
            return Reply({"go": "back"}) if goes_back else answer(self.person, request)[0]
        if isinstance(request, Present | Sense):
            return Reply({}, (Samples("felt", ("x",), ("N",), 1.0, self.now(), chance.randbytes(8)),))
        return Reply({})


def plan_for(task, seed):
    both_ways = {} if task in ONE_WAY else {"navigation": "back_and_forward"}
    return plan_of(task, seed=seed, practice={"stimuli": ["D"]}, rest={"every": 2}, **both_ways)


def go_on(plan, events, seed):
    """Take a session up from these events; what it becomes."""
    log = Kept(list(events))
    tape = Recorded(events, Chance(plan, log, seed), log)
    run(plan, tape, tape, HEADER)
    tape.demand_end()
    return log.events


@pytest.mark.untraced
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("task", PARTS)
def test_whatever_happens_a_session_cut_anywhere_is_the_uninterrupted_one(task, seed):
    plan = plan_for(task, seed)
    whole = go_on(plan, [], seed)
    assert {"request", "reply", "experimenter"} <= {event.kind for event in whole}
    for cut in range(1, len(whole)):
        assert go_on(plan, whole[:cut], seed) == whole


def test_among_them_everything_happens():
    events = [event for task in PARTS for seed in (1, 2) for event in go_on(plan_for(task, seed), [], seed)]
    done = {(e.value["do"], e.value.get("which")) for e in events if e.kind == "experimenter"}
    assert {("repeat", "this"), ("repeat", "last"), ("pause", None), ("note", None)} <= done
    assert {e.value["as"] for e in events if e.kind == "trial_ended"} == {"answered", "captured", "left", "repeated"}
