"""A session from its first event to its last, and again from wherever it was interrupted."""

from __future__ import annotations

from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from protocols.plan import Plan
from protocols.runner import run
from protocols.worlds import Recorded
from studies.environment import environment, wall_time
from studies.interrupts import Guard, Interrupted, guarded
from studies.ledger import Ledger, create, take_up
from studies.record import LedgerError, Record
from studies.replay import recompiled
from studies.rig import Rig, RigPlan


@dataclass(frozen=True)
class Sat:
    """How a sitting ended."""

    path: Path
    complete: bool
    events: int
    reason: str


def ledger_path(lab: Path, study: str, participant: str, number: int = 1) -> Path:
    """Where a session's ledger lies: LAB/sessions/STUDY_PARTICIPANT_sN.sqlite."""
    return lab / "sessions" / f"{study}_{participant}_s{number}.sqlite"


def fresh_path(lab: Path, plan: Plan, number: int) -> Path:
    """Where a new session of the plan will lie. Raises LedgerError if there is one already."""
    path = ledger_path(lab, plan.study.study, plan.who.participant, number)
    if path.exists():
        raise LedgerError(f"{path} exists: go on with it (palpate resume), or give --session {number + 1}")
    return path


def header_of(plan: Plan, rig: dict[str, Any], number: int = 1) -> dict[str, Any]:
    """The body of session_started: everything that is needed to understand and to repeat the session."""
    return {
        "study": plan.study.definition(),
        "participant": plan.who.participant,
        "group": plan.who.group,
        "row": plan.who.row,
        "session": number,
        "seed": plan.seed,
        "plan": plan.digest,
        "trials": len(plan.trials),
        "rig": rig,
        "calibration": None,
        "environment": environment(),
    }


def start(lab: Path, plan: Plan, rig: RigPlan, number: int = 1) -> Sat:
    """Begin a session and run it as far as it goes.

    Raises LedgerError if the participant has a session of this number already, RigError if the rig cannot be had.
    """
    path = fresh_path(lab, plan, number)
    rig.check(plan)
    with guarded() as guard:
        create(path, header_of(plan, rig.description, number), {"at": wall_time()})
        return _sit(take_up(path, _sitting(), guard.shield), rig, guard)


def resume(path: Path, rig: RigPlan) -> Sat:
    """Replay what is recorded, then go on live at the exact act where the record ends.

    Raises LedgerError if the ledger is refused, held by another process or complete; Divergence if
    this version of Palpate does not do what was recorded. A complete or refused ledger is not touched.
    """
    with guarded() as guard:
        return _sit(take_up(path, _sitting(), guard.shield, _to_go_on_with), rig, guard)


def _sit(ledger: Ledger, planned: RigPlan, guard: Guard) -> Sat:
    """Take the session on. Signals are held back until the rig is open, and once the session is over."""
    rig: Rig | None = None
    reason = "complete"
    try:
        try:
            plan = recompiled(ledger.record)
            rig = planned.open(plan, ledger.record.events[-1].t_ns)
            guard.listen()
            _go_on(plan, rig, ledger)
        finally:
            guard.over = True
    except Interrupted as signal:
        guard.over = True
        reason = f"interrupted by {signal}"
    except Exception as error:
        reason = f"failed: {type(error).__name__}: {error}"
        raise
    finally:
        _lay_down(ledger, rig, reason)
    return Sat(ledger.record.path, ledger.complete, ledger.written, "complete" if ledger.complete else reason)


def _to_go_on_with(record: Record) -> None:
    """Refuse a session that is over, or whose plan is not what it was."""
    if record.complete:
        raise LedgerError(f"{record.path}: the session is complete; there is nothing to go on with")
    recompiled(record)


def _go_on(plan: Plan, rig: Rig, ledger: Ledger) -> None:
    tape = Recorded(ledger.record.events, rig.world, ledger)
    run(plan, tape, tape, ledger.record.header)
    tape.demand_end()


def _lay_down(ledger: Ledger, rig: Rig | None, reason: str) -> None:
    """Safe state first, then the ledger; the ledger also where the rig fails to be safe."""
    try:
        if rig is not None:
            rig.safe()
    finally:
        because = "complete" if ledger.complete else reason
        # Where the session failed, that is the error to report, not that the note of it found no room.
        with suppress(LedgerError) if reason.startswith("failed") else nullcontext():
            ledger.close({"at": wall_time(), "because": because})


def _sitting() -> dict[str, Any]:
    return {"at": wall_time(), "environment": environment()}
