"""A lab in a temporary folder, with a small study and ways to interrupt its sessions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.protocols.events import Reply, Request
from palpate.protocols.plan import Plan
from palpate.studies.sessions import session
from palpate.studies.sessions.interrupts import Interrupted
from palpate.studies.sessions.ledger import open_for_append
from palpate.studies.sessions.record import Record, read
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session_files import ledger_path
from palpate.studies.simulation.rig import simulated
from tests.protocols.studies_for_tests import toy_plan

LIVELY = {"simulation": {"latents": {"Soft": {"size": 4.0}}, "revise_rate": 0.2, "lapse_rate": 0.2}}

HEADER = {
    "study": {"study": "toy"}, "participant": "P001", "group": None, "row": 0, "session": 1, "seed": 0, "plan": "",
    "trials": 0, "rig": {"kind": "simulated"}, "calibration": None, "environment": {"palpate": "0"},
}  # fmt: skip
"""The first event's body of a session that is not replayed."""


@dataclass(frozen=True)
class Lab:
    """LAB, and the toy study run in it."""

    path: Path

    def plan(self, participant: str = "P001", session: int = 1, **changes: Any) -> Plan:
        return toy_plan(participant, session=session, **{**LIVELY, **changes})

    @property
    def rig(self) -> RigPlan:
        return simulated(self.plan().study, self.path)

    def start(self, participant: str = "P001", rig: RigPlan | None = None, **changes: Any) -> Path:
        """Run a session as far as it goes."""
        return session.start(self.path, self.plan(participant, **changes), rig or self.rig).path

    def cut(self, events: int, participant: str = "P001") -> Path:
        """A ledger that holds the first `events` events, as if the power had failed then."""
        whole = read(Lab(self.path / "whole").start(participant)) if events else None
        assert whole is not None
        plan = self.plan(participant)
        path = ledger_path(self.path, "toy", participant)
        session.create(path, whole.header, {"at": "2026-01-01T00:00:00+00:00"})
        ledger = open_for_append(path, {"at": "2026-01-01T00:00:00+00:00"})
        assert plan.digest == whole.header["plan"]
        for event in whole.events[1:events]:
            ledger.append(event)
        ledger.connection.close()
        ledger.engine.dispose()
        ledger.lock.release()
        return path

    def read(self, participant: str = "P001") -> Record:
        return read(ledger_path(self.path, "toy", participant))


@dataclass
class StopsAfter:
    """A rig whose world raises at the n-th act."""

    rig: Rig
    acts: int
    error: Callable[[], BaseException] = lambda: Interrupted("SIGTERM")

    def now(self) -> int:
        return self.rig.world.now()

    def perform(self, request: Request) -> Reply:
        self.acts -= 1
        if self.acts < 0:
            raise self.error()
        return self.rig.world.perform(request)


def stopping(rig: RigPlan, acts: int, **how: Any) -> RigPlan:
    """The same rig, but it stops the session at its n-th act."""

    def opened(plan: Plan, t_ns: int) -> Rig:
        opened_rig = rig.open(plan, t_ns)
        return replace(opened_rig, world=StopsAfter(opened_rig, acts, **how))

    return replace(rig, open=opened)
