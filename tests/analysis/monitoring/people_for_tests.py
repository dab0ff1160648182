"""Simulated participants who straight-line, hurry or stop, and experimenters who write notes: real sessions all."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palpate.protocols.events import Aside, Ask, Reply, Request
from palpate.protocols.plan import Plan
from palpate.studies.sessions import session
from palpate.studies.sessions.interrupts import Interrupted
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.simulation.rig import simulated
from tests.protocols.studies_for_tests import toy_plan

PLAIN: dict[str, Any] = {"navigation": "forward", "rest": None}
Change = Callable[[Request, Reply], Reply]


def as_they_are(_request: Request, reply: Reply) -> Reply:
    return reply


def straight(value: float) -> Change:
    """The same value on every attribute of every trial."""

    def change(request: Request, reply: Reply) -> Reply:
        if not isinstance(request, Ask) or request.trial is None or "answers" not in reply.value:
            return reply
        return Reply({**reply.value, "answers": dict.fromkeys(reply.value["answers"], value)}, reply.samples)

    return change


@dataclass
class Played:
    """The simulated world, but answers are changed, asides come before the n-th question, and it may stop or wait.

    asides: (number of the question, what the experimenter does), in their order. `before` is called before each
    question with its number, from 1.
    """

    rig: Rig
    change: Change = as_they_are
    asides: list[tuple[int, dict[str, Any]]] = field(default_factory=list)
    stop_before: int | None = None
    before: Callable[[int], None] = lambda _n: None
    request_number: int = 1

    def now(self) -> int:
        return self.rig.world.now()

    def perform(self, request: Request) -> Reply | Aside:
        if isinstance(request, Ask):
            if self.asides and self.asides[0][0] == self.request_number:
                return Aside(self.asides.pop(0)[1])
            if self.stop_before == self.request_number:
                raise Interrupted("SIGTERM")
            self.before(self.request_number)
            self.request_number += 1
        reply = self.rig.world.perform(request)
        return reply if isinstance(reply, Aside) else self.change(request, reply)


def play(lab: Path, plan: Plan, rig: RigPlan, **how: Any) -> Path:
    """Run a session played so, and give its ledger's path."""

    def opened(compiled: Plan, t_ns: int) -> Rig:
        session = rig.open(compiled, t_ns)
        return replace(session, world=Played(session, **how))

    return session.start(lab, plan, replace(rig, open=opened), plan.session).path


def run(lab: Any, participant: str = "P001", row: int = 0, changes: dict[str, Any] | None = None, **how: Any) -> Path:
    """A session of the toy study, forward and without rests, in a lab of the tests."""
    plan = toy_plan(participant, row, **{**PLAIN, **(changes or {})})
    return play(lab.path, plan, simulated(plan.study, lab.path), **how)


def gate(folder: Path, patience_s: float = 60.0) -> Callable[[int], None]:
    """Wait before question n until FOLDER/n is there, or for so long."""

    def wait(n: int) -> None:
        until = time.monotonic() + patience_s
        while not (folder / str(n)).exists():
            if time.monotonic() > until:
                sys.exit(f"question {n} was never let through")
            time.sleep(0.01)

    return wait
