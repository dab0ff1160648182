"""Where a lab's session files lie, and how they are named: LAB/sessions/STUDY_PARTICIPANT_sN.sqlite."""

from __future__ import annotations

import re
from pathlib import Path

from palpate.protocols.shell_command import shell_command
from palpate.studies.sessions.record import LedgerError, read


def ledger_path(lab: Path, study: str, participant: str, number: int = 1) -> Path:
    """Where a session's ledger lies: LAB/sessions/STUDY_PARTICIPANT_sN.sqlite."""
    return lab / "sessions" / f"{study}_{participant}_s{number}.sqlite"


def fresh_path(lab: Path, study: str, participant: str, number: int) -> Path:
    """Where a new session will lie. Raises LedgerError if there is one already."""
    path = ledger_path(lab, study, participant, number)
    if path.exists():
        raise LedgerError(_taken(path, study, participant, number))
    return path


def _taken(path: Path, study: str, who: str, number: int) -> str:
    """What to say where the participant has a session of this number."""
    status = read(path).status
    if status == "interrupted":
        return f"{path} exists and is not over: resume it: {shell_command('resume', path)}"
    return (
        f"{path}: {who} has had session {number} of {study} ({status}); if a further one is meant, give"
        f" --session {number + 1}"
    )


def ledgers_in(lab: Path, study: str | None = None) -> list[Path]:
    """The lab's ledgers, by name; those of one study if it is given."""
    wanted = re.compile(rf"{re.escape(study) if study else '[^.].*'}_[A-Za-z0-9]+_s[0-9]+\.sqlite")
    return sorted(path for path in (lab / "sessions").glob("*.sqlite") if wanted.fullmatch(path.name))


def others_in(lab: Path) -> list[Path]:
    """SQLite files among the lab's sessions that are not named as a session: copies, for instance."""
    named = set(ledgers_in(lab))
    return sorted(path for path in (lab / "sessions").glob("*.sqlite") if path not in named and path.name[0] != ".")
