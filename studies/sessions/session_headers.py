"""What sessions began as, from their first events alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.trial import ParticipantRow
from palpate.studies.sessions.record import LedgerError, read_header


@dataclass(frozen=True)
class SessionStart:
    """The study, participant, row and seed of a session, and whether a person took part."""

    study: str
    who: ParticipantRow
    seed: int | None
    in_person: bool


def in_person(header: dict[str, Any]) -> bool:
    """Return whether a session is a real participant's: simulated ones and rehearsals are nobody's."""
    return bool(header["rig"]["kind"] == "live")


def by_twins(header: dict[str, Any]) -> bool:
    """Return whether simulated devices made what a session recorded, whoever took part."""
    return not in_person(header) or bool(header["rig"].get("twins"))


def stimulus_columns(header: dict[str, Any]) -> dict[str, dict[str, str]]:
    """Return the rows of the stimulus table that the session was started with, by the stimulus' id."""
    stimuli = header.get("study", {}).get("stimuli", ())
    return {row["id"]: row.get("columns", {}) for row in stimuli if isinstance(row, dict) and "id" in row}


def session_starts(ledgers: Iterable[Path]) -> Iterator[SessionStart]:
    """Yield what the ledgers began as, in their order; one whose first event cannot be read is passed over."""
    for path in ledgers:
        try:
            header = read_header(path)
            who = ParticipantRow(header["participant"], header["group"], header["row"])
            yield SessionStart(header["study"]["study"], who, header.get("seed"), in_person(header))
        except (LedgerError, KeyError, TypeError):
            continue
