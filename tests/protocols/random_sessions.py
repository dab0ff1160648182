"""Sessions in which anything may happen: the seed and the length of the log alone decide what."""

from __future__ import annotations

import random

from palpate.protocols.events import Aside, Ask, Choose, Chunk, Fault, Present, Reply, Samples, Sense
from palpate.protocols.runner import Recorded, run
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.studies.procedures.advised import advised
from tests.protocols.every_task import plan_of
from tests.protocols.worlds_for_tests import MemoryLog

HEADER = {"calibration": {"px_per_mm": 3.6}}
ONE_WAY = ("authoring", "capture", "intervals")
ASIDES = ({"do": "note", "text": "sneezed"}, {"do": "pause"}, {"do": "go_on"})
REPEATS = tuple({"do": "repeat", "which": which} for which in (*("this", "last") * 4, "block"))
ENDING = {
    "kind": "limits",
    "level": {"column": "size", "from": 0, "to": 9, "points": 10},
    "step": 4,
    "stop": {"trials": 5, "series": 1},
}
IN_BLOCKS = {"design": "random", "within": "block", "blocks": {"by": "kind", "instructions": {"x": "Wear a glove."}}}
ABORT = {"do": "abort", "text": "felt unwell"}
FAULT = Fault({"device": "door", "what": "overrun", "message": "samples came too late"})


class Killed(Exception):
    """The process ended while a request was being performed."""


class Chance:
    """A participant and an experimenter without memory; `rough`: devices fail, and the process is killed, too."""

    def __init__(self, plan, log, seed, rough=False):
        self.person, self.log, self.seed, self.rough = Perceiver(plan), log, seed, rough
        self.advised = advised(plan, self)

    def now(self):
        return 1_000 * len(self.log.events)

    def perform(self, request):
        chance = random.Random(f"{self.seed} {len(self.log.events)}")
        if self.rough and (outcome := self.rough_turn(request)) is not None:
            return outcome
        if chance.random() < 0.25:
            inside = self.log.events[-1].trial is not None
            return Aside(ABORT if chance.random() < 0.02 else chance.choice(ASIDES + REPEATS * inside))
        if isinstance(request, Ask) and request.may_go_back and chance.random() < 0.25:
            return Reply({"go": "back"})
        return self.plain(request)

    def plain(self, request):
        """Answer the request and do nothing else."""
        if isinstance(request, Choose):
            return self.advised.perform(request)
        if isinstance(request, Ask):
            return self.person.answer(request)[0]
        return Reply({}, self.samples()) if isinstance(request, Present | Sense) else Reply({})

    def rough_turn(self, request):
        turn = random.Random(f"rough {self.seed} {len(self.log.events)}").random()
        felt = getattr(request, "trial", None) is not None
        if turn < 0.04 and felt:
            return FAULT
        if turn < 0.1 and felt and isinstance(request, Present | Sense):
            return Chunk({"streams": {}}, self.samples())
        if turn > 0.97:
            raise Killed
        return None

    def samples(self):
        return (Samples("felt", ("x",), ("N",), 1.0, self.now(), bytes(8)),)


def plan_for(task, seed, **changes):
    """A plan of four trials and, unless the changes say otherwise, one of practice, with rests, back and forward."""
    both_ways = {} if task in ONE_WAY else {"navigation": "back_and_forward"}
    if task == "intervals":  # tracks of different lengths, with catch trials, in two blocks
        both_ways = {"procedure": ENDING, "order": IN_BLOCKS, "intervals": {"catch": {"easy": {"every": 2}}}}
    return plan_of(task, seed=seed, **{"practice": {"stimuli": ["D"]}, "rest": {"every": 2}, **both_ways, **changes})


def go_on(plan, events, world_of):
    """Take a session up from these events in the world that `world_of` makes for its log; what it becomes."""
    log = MemoryLog(list(events))
    tape = Recorded(events, world_of(log), log)
    run(plan, tape, tape, HEADER)
    tape.demand_end()
    return log.events


def rough_session(plan, seed):
    """Return a session with everything in it, resumed after each kill."""
    events, kills = [], 0
    while True:
        log = MemoryLog(list(events))
        tape = Recorded(events, Chance(plan, log, f"{seed} {kills}", rough=True), log)
        try:
            run(plan, tape, tape, HEADER)
        except Killed:
            events, kills = log.events, kills + 1
        else:
            return log.events
