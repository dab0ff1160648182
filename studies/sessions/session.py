"""A session from its first event to its last, resumed from wherever it was interrupted or killed (kill -9, power)."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.plan import Plan
from palpate.protocols.runner import Recorded, run
from palpate.protocols.wording import count
from palpate.studies.sessions.environment import environment, wall_time
from palpate.studies.sessions.extensions import KEY, definitions, extensions_of_session
from palpate.studies.sessions.interrupts import Guard, Interrupted, guarded, interrupt_behind
from palpate.studies.sessions.ledger import Ledger, Watched, create, open_for_append
from palpate.studies.sessions.record import LedgerError, Record, read
from palpate.studies.sessions.replay import recompiled
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session_files import fresh_path


@dataclass(frozen=True)
class Receipt:
    """What a run of a session left on the disk, read back through a connection of its own, with its chains verified.

    `planned` events were handed to the ledger by the runner, `written` is what the ledger counted, `read_back` is None
    where the file was refused, and `problem` says why. `digest` is the last link of the chain of events.
    """

    planned: int
    written: int
    read_back: int | None
    digest: str
    problem: str | None = None

    @property
    def good(self) -> bool:
        """Whether everything that was planned is on the disk as it was written."""
        return self.problem is None and self.planned == self.written == self.read_back

    def to_dict(self) -> dict[str, Any]:
        """Return the receipt as JSON data; `problem` only if there is one."""
        return {name: value for name, value in asdict(self).items() if name != "problem" or value is not None}

    def __str__(self) -> str:
        read_back = "none" if self.read_back is None else f"{self.read_back}"
        counts = f"{count(self.planned, 'event')} planned, {self.written} written, {read_back} read back from the disk"
        return f"receipt: {counts}; digest {self.digest[:16]}" + (f"; {self.problem}" if self.problem else "")


@dataclass(frozen=True)
class SessionResult:
    """The outcome of one run; `status` is the session's (see palpate.studies.sessions.record.Record.status)."""

    path: Path
    status: str
    events: int
    reason: str
    receipt: Receipt | None = None

    @property
    def complete(self) -> bool:
        """Whether the session came to its regular end."""
        return self.status == "complete"


def header_of(plan: Plan, rig: RigPlan, number: int = 1, accepted: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the body of session_started: everything needed to understand and repeat the session.

    `accepted` is a change of the study since the participant's earlier session, which the experimenter accepted.
    """
    extensions = extensions_of_session(plan.study, rig.description)
    return {
        "study": plan.study.definition(),
        "participant": plan.who.participant,
        "group": plan.who.group,
        "row": plan.who.row,
        "session": number,
        **({} if plan.session == 1 else {"over_sessions": plan.study.over_sessions}),
        "seed": plan.seed,
        "plan": plan.digest,
        "trials": len(plan.trials),
        "rig": rig.description,
        "calibration": rig.calibration,
        "environment": environment(),
        **({} if plan.lab_forms is None else {"lab_forms": plan.lab_forms.definition()}),
        **({} if accepted is None else {"accepted_change": dict(accepted)}),
        **({KEY: definitions(extensions)} if extensions else {}),
    }


def start(
    lab: Path, plan: Plan, rig: RigPlan, number: int = 1, accepted: Mapping[str, Any] | None = None
) -> SessionResult:
    """Start a session and run it as far as it goes; `accepted` as for `header_of`.

    Raises LedgerError if the participant has a session of this number already, RigError if the rig is not available.
    """
    path = fresh_path(lab, plan.study.study, plan.who.participant, number)
    rig.check(plan)
    with guarded() as guard:
        try:
            create(path, header_of(plan, rig, number, accepted), {"at": wall_time()})
            ledger = open_for_append(path, _run_note(), guard.shield)
        except BaseException:  # a full disk: what was opened to be checked is let go of
            rig.drop()
            raise
        return _run(ledger, rig, guard)


def resume(path: Path, rig: RigPlan, accepted: Mapping[str, Any] | None = None) -> SessionResult:
    """Replay what is recorded, then continue live at the exact act where the record ends.

    `accepted` is a change of the study's file since the session began, which the experimenter accepted; it goes into
    the note of this run, and the session continues with the recorded study. Raises LedgerError if the ledger is
    refused, held by another process or over; Divergence if this version of Palpate does not do what was recorded. A
    complete or refused ledger is not touched.
    """
    run_note = _run_note() | ({} if accepted is None else {"accepted_change": dict(accepted)})
    with guarded() as guard:
        return _run(open_for_append(path, run_note, guard.shield, _demand_resumable), rig, guard)


def _run(ledger: Ledger, planned: RigPlan, guard: Guard) -> SessionResult:
    """Run the session. Signals are held back until the rig is open, and once the session is over."""
    rig: Rig | None = None
    reason = "complete"
    log = Watched(ledger, len(ledger.record.events))
    try:
        try:
            plan = recompiled(ledger.record)
            rig = planned.open(plan, ledger.record.events[-1].t_ns)
            guard.listen()
            log.watch = rig.watch
            record = ledger.record
            recorded = Recorded(record.events, rig.world, log)
            for event in record.events:
                rig.watch(event)
            run(plan, recorded, recorded, record.header)
            recorded.demand_end()
            rig.finish()
        finally:
            guard.over = True
    except Interrupted as signal:
        guard.over = True
        reason = f"interrupted by {signal}"
    except Exception as error:
        if (interrupt := interrupt_behind(error)) is None:
            reason = f"failed: {type(error).__name__}: {error}"
            raise
        guard.over = True
        reason = f"interrupted by {interrupt}"
    finally:
        receipt = _close(log, rig, reason)
    return SessionResult(ledger.record.path, ledger.status, ledger.written, _because(ledger, reason), receipt)


def _demand_resumable(record: Record) -> None:
    """Raise LedgerError on a session that is over, or whose plan has changed."""
    if record.ended:
        raise LedgerError(f"{record.path}: the session is {record.status}; nothing to resume")
    recompiled(record)


def _close(log: Watched, rig: Rig | None, reason: str) -> Receipt:
    """Make the rig safe, then close the ledger with its receipt, even if making the rig safe fails."""
    try:
        if rig is not None:
            rig.safe()
    finally:
        receipt = _receipt(log)
        note = {"at": wall_time(), "because": _because(log.ledger, reason), "receipt": receipt.to_dict()}
        # Where the session failed, that is the error to report, not that the note of it found no room.
        with suppress(LedgerError) if reason.startswith("failed") else nullcontext():
            log.ledger.close(note)
    return receipt


def _receipt(log: Watched) -> Receipt:
    """Read the ledger again from its file and compare it with what was written."""
    ledger, count, problem = log.ledger, None, None
    try:
        record = read(ledger.record.path)
        count = len(record.events)
        if record.head != ledger.head:
            problem = f"the file's digest is {record.head[:16]}"
    except (LedgerError, OSError) as error:
        problem = str(error)
    return Receipt(log.planned, ledger.written, count, ledger.head, problem)


def _because(ledger: Ledger, reason: str) -> str:
    """Return how the session ended, or why this run ended if the session has not."""
    return reason if ledger.status == "interrupted" else ledger.status


def _run_note() -> dict[str, Any]:
    return {"at": wall_time(), "environment": environment()}
