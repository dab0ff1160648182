"""Replay of a recorded session: the same study, the recorded replies, every event compared byte for byte."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.canonical import difference
from palpate.protocols.events import NS, ReplyError
from palpate.protocols.extensions import ExtensionError, extensions_in
from palpate.protocols.forms import LabForms
from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.runner import Divergence, EndOfRecord, Recorded, run
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.sessions.extensions import demand_here, differences, in_words
from palpate.studies.sessions.record import LedgerError, Record, read


@dataclass(frozen=True)
class Replayed:
    """A session that the present code repeats exactly."""

    path: Path
    events: int
    complete: bool
    session_s: float
    seconds: float
    lacks_wal: bool = False

    @property
    def speed(self) -> float:
        """How many times faster the replay was than the session."""
        return self.session_s / self.seconds if self.seconds > 0 else float("inf")


def replay(path: Path) -> Replayed:
    """Replay one ledger; an interrupted one up to its end.

    Raises LedgerError if the file is refused or the plan differs, Divergence if an event does.
    """
    start_s = time.perf_counter()
    record = read(path)
    compare(record)
    seconds = time.perf_counter() - start_s
    return Replayed(path, len(record.events), record.complete, record.events[-1].t_ns / NS, seconds, record.lacks_wal)


def compare(record: Record) -> None:
    """Run the recorded study on the recorded replies and compare the events. Raises as `replay` does."""
    tape = Recorded(record.events)
    try:
        run(recompiled(record), tape, tape, record.header)
    except EndOfRecord:
        return
    except Divergence as error:
        raise Divergence(f"{error}{_since(record.header)}") from None
    except ReplyError as error:
        raise Divergence(f"event {tape.position} does not answer its request: {error}") from None
    tape.demand_end()


def _since(header: Mapping[str, Any]) -> str:
    """Return which extensions of the task have changed since the session, for a message; "" if none."""
    changed = differences(header, extensions_in([header["study"]["task"]]))
    return f" ({in_words(changed)})" if changed else ""


def recompiled(record: Record) -> Plan:
    """Compile the plan from the study in the header. Raises LedgerError unless its digest is the recorded one."""
    header = record.header
    try:
        demand_here(header, extensions_in([header["study"].get("task")]))
        plan = plan_from_header(header, Study.model_validate(header["study"]))
    except ExtensionError as error:
        raise LedgerError(f"{record.path}: {error}") from None
    except (KeyError, TypeError, ValueError) as error:
        raise LedgerError(
            f"{record.path}: its first event declares no session that this version reads: {error}"
        ) from None
    if plan.digest != header["plan"]:
        how = difference(header["study"], plan.study.definition()) or "the order of the trials differs"
        raise LedgerError(f"{record.path}: the recorded study now compiles to another plan: {how}{_since(header)}")
    return plan


def plan_from_header(header: Mapping[str, Any], study: Study) -> Plan:
    """Compile the plan that a session's first event declares, by the rule of the session's time.

    A later session that says nothing of its order (`over_sessions`) is from before sessions had orders of their own:
    it repeats the first one. Raises KeyError, TypeError or ValueError on a header that declares no plan.
    """
    who = ParticipantRow(header["participant"], header["group"], header["row"])
    forms = LabForms.from_definition(header["lab_forms"]) if "lab_forms" in header else None
    return compile_plan(study, who, header["seed"], forms, header["session"] if "over_sessions" in header else 1)
