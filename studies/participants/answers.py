"""What participants answered about themselves, from the ledgers."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.studies.sessions.record import LedgerError, Record, read
from palpate.studies.sessions.session_files import ledgers_in

FORM = "demographics"


@dataclass(frozen=True)
class Answers:
    """given: participant -> question -> the last answer that was one, with the session it was given in.

    `simulated` and `refused` name the sessions that were left out; `studies`: participant -> studies sat in.
    """

    given: dict[str, dict[str, tuple[Any, str]]] = field(default_factory=dict)
    studies: dict[str, set[str]] = field(default_factory=dict)
    simulated: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


def demographics(lab: Path, with_simulated: bool = False) -> Answers:
    """Every answer about themselves that participants gave in the lab's sessions, the latest sitting last.

    Simulated people are nobody: their sessions are left out unless asked for.
    """
    found = Answers()
    for record in _in_order(lab, found.refused):
        if record.header["rig"]["kind"] == "simulated" and not with_simulated:
            found.simulated.append(record.path.name)
            continue
        who = record.header["participant"]
        found.studies.setdefault(who, set()).add(record.header["study"]["study"])
        given = found.given.setdefault(who, {})
        for answer in record.state.answers:
            if answer.form == FORM:
                given |= {name: (said, record.path.name) for name, said in answer.values.items() if said is not None}
    return found


def _in_order(lab: Path, refused: list[str]) -> list[Record]:
    records = []
    for path in ledgers_in(lab):
        try:
            records.append(read(path))
        except LedgerError as error:
            refused.append(str(error))
    return sorted(records, key=lambda record: (record.sittings[0].value["at"], record.path.name))
