"""A lab's session files, LAB/sessions/STUDY_PARTICIPANT_sN.sqlite, and what their first events say."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.shell_command import shell_command
from palpate.protocols.trial import ParticipantRow
from palpate.studies.sessions.record import LedgerError, read, read_header


def ledger_path(lab: Path, study: str, participant: str, number: int = 1) -> Path:
    """Return the path of a session's ledger: LAB/sessions/STUDY_PARTICIPANT_sN.sqlite."""
    return lab / "sessions" / f"{study}_{participant}_s{number}.sqlite"


def fresh_path(lab: Path, study: str, participant: str, number: int) -> Path:
    """Return the path for a new session. Raises LedgerError if it exists."""
    path = ledger_path(lab, study, participant, number)
    if path.exists():
        status = read(path).status
        if status == "interrupted":
            raise LedgerError(f"{path} exists and is not over: resume it: {shell_command('resume', path)}")
        raise LedgerError(
            f"{path}: {participant} has had session {number} of {study} ({status}); if a further one is meant, give"
            f" --session {number + 1}"
        )
    return path


def ledgers_in(lab: Path, study: str | None = None) -> list[Path]:
    """Return the lab's ledgers, sorted by name; only those of `study` if it is given."""
    pattern = re.compile(rf"{re.escape(study) if study else '[^.].*'}_[A-Za-z0-9]+_s[0-9]+\.sqlite")
    return sorted(path for path in (lab / "sessions").glob("*.sqlite") if pattern.fullmatch(path.name))


def others_in(lab: Path) -> list[Path]:
    """Return the SQLite files in the lab's sessions whose names are not those of a session, such as copies."""
    named = set(ledgers_in(lab))
    return sorted(path for path in (lab / "sessions").glob("*.sqlite") if path not in named and path.name[0] != ".")


@dataclass(frozen=True)
class SessionStart:
    """The study, participant, row and seed of a session, and whether a person took part."""

    study: str
    who: ParticipantRow
    seed: int | None
    in_person: bool


def in_person(header: dict[str, Any]) -> bool:
    """Return whether a session is a real participant's, neither simulated nor a rehearsal."""
    return bool(header["rig"]["kind"] == "live")


def by_twins(header: dict[str, Any]) -> bool:
    """Return whether simulated devices made a session's recordings, whoever took part."""
    return not in_person(header) or bool(header["rig"].get("twins"))


def stimulus_columns(header: dict[str, Any]) -> dict[str, dict[str, str]]:
    """Return the rows of the stimulus table that the session was started with, by stimulus id."""
    stimuli = header.get("study", {}).get("stimuli", ())
    return {row["id"]: row.get("columns", {}) for row in stimuli if isinstance(row, dict) and "id" in row}


def session_starts(ledgers: Iterable[Path]) -> Iterator[SessionStart]:
    """Yield how the ledgers' sessions started, in order; a ledger whose first event cannot be read is skipped."""
    for path in ledgers:
        try:
            header = read_header(path)
            who = ParticipantRow(header["participant"], header["group"], header["row"])
            yield SessionStart(header["study"]["study"], who, header.get("seed"), in_person(header))
        except (LedgerError, KeyError, TypeError):
            continue
