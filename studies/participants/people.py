"""The participants of a lab: pseudonyms, the next free one, and whether a participant is known and active."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from sqlalchemy import Connection, insert, select

from palpate.protocols.lookalikes import looks
from palpate.protocols.shell_command import shell_command
from palpate.studies.lab import ParticipantError
from palpate.studies.participants import schema
from palpate.studies.participants.registry import Registry, note, reading, write
from palpate.studies.sessions.environment import wall_time

people = schema.participants
_PSEUDONYM = re.compile(r"^[A-Za-z][A-Za-z0-9]{0,14}[0-9]$")
_OF_SESSION = re.compile(r"_([A-Za-z0-9]+)_s[0-9]+\.sqlite$")


def add(registry: Registry, pseudonym: str | None = None) -> str:
    """Add a participant under the given pseudonym, else the next that neither registry nor sessions have; return it.

    Raises ParticipantError on an invalid or known pseudonym.
    """
    if pseudonym is not None:
        demand_pseudonym(pseudonym)
    held = in_sessions(registry.lab)
    return write(registry, lambda connection: _added(connection, pseudonym, held))


def status_of(registry: Registry, participant: str) -> str | None:
    """Return active, withdrawn, or None if the participant is not known."""
    with reading(registry) as connection:
        return _status(connection, participant)


def demand_known(registry: Registry, participant: str) -> None:
    """Raise ParticipantError unless the participant is known and has not withdrawn."""
    with reading(registry) as connection:
        demand_active(connection, registry.lab, participant)


def demand_active(connection: Connection, lab: Path, participant: str) -> None:
    """Raise ParticipantError unless the participant is known and has not withdrawn."""
    status = _status(connection, participant)
    if status is None:
        raise ParticipantError(unknown(lab, participant))
    if status == "withdrawn":
        raise ParticipantError(f"{participant} has withdrawn from {lab}: no row can be taken and no session run")


def unknown(lab: Path, participant: str) -> str:
    """Return the message about a participant who is not in the registry."""
    command = shell_command("participants", "add", "--pseudonym", participant, "--lab", lab)
    return f"{participant} is not known in {lab}: {command}"


def _status(connection: Connection, participant: str) -> str | None:
    return connection.execute(select(people.c.status).where(people.c.participant == participant)).scalar()


def _added(connection: Connection, pseudonym: str | None, held: set[str]) -> str:
    known = set(connection.execute(select(people.c.participant)).scalars())
    new = pseudonym or next_pseudonym(known | held)
    same = next((name for name in sorted(known) if name.casefold() == new.casefold()), None)
    if same is not None:
        raise ParticipantError(f"{same} is known already; leave --pseudonym out for the next free one")
    alike = next((name for name in sorted(known | held) if looks(name) == looks(new) and name != new), None)
    if alike is not None:
        raise ParticipantError(
            f"{new} looks like {alike}, which is in use here: a reader would take the two for one person; give another"
            " pseudonym, or leave --pseudonym out for the next free one"
        )
    connection.execute(insert(people), {"participant": new, "status": "active", "added_at": wall_time()})
    note(connection, "added", {"participant": new})
    return new


def demand_pseudonym(text: str) -> None:
    """Raise ParticipantError unless the text is letters and digits with a digit last: a given name is no pseudonym."""
    if not _PSEUDONYM.fullmatch(text):
        raise ParticipantError(
            f"participant {text!r}: a pseudonym as P001 is expected: a letter, up to 15 letters or digits, a digit last"
        )


def next_pseudonym(known: Iterable[str]) -> str:
    """Return the first of P001, P002, ... that was never given and does not resemble a given one (p1, P0001)."""
    given = {looks(pseudonym) for pseudonym in known}
    number = 1
    while looks(f"P{number:03d}") in given:
        number += 1
    return f"P{number:03d}"


def in_sessions(lab: Path) -> set[str]:
    """Return the pseudonyms in the names of the lab's session files."""
    matches = (_OF_SESSION.search(path.name) for path in (lab / "sessions").glob("*.sqlite"))
    return {match[1] for match in matches if match}
