"""Where a lab's session files lie, and how they are named: LAB/sessions/STUDY_PARTICIPANT_sN.sqlite."""

from __future__ import annotations

import re
from pathlib import Path

from palpate.protocols.shell_command import shell_command
from palpate.studies.sessions.record import LedgerError, read


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
    """Return the SQLite files among the lab's sessions that are not named as a session: copies, for instance."""
    named = set(ledgers_in(lab))
    return sorted(path for path in (lab / "sessions").glob("*.sqlite") if path not in named and path.name[0] != ".")
