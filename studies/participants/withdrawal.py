"""Withdrawal: a person is erased, their rows are free again, their sessions are marked, and it is recorded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Connection, select, update

from palpate.protocols.trial import ParticipantRow
from palpate.studies.lab import ParticipantError
from palpate.studies.participants import schema
from palpate.studies.participants.allocations import Allocation, allocation_of
from palpate.studies.participants.export import forget
from palpate.studies.participants.identities import demand_nameless, erase
from palpate.studies.participants.people import status_of, unknown
from palpate.studies.participants.registry import Registry, note, write
from palpate.studies.participants.rows import give_up
from palpate.studies.sessions.session_files import ledgers_in, session_starts


@dataclass(frozen=True)
class Withdrawn:
    """The outcome of a withdrawal."""

    participant: str
    erased: bool
    released: tuple[Allocation, ...]
    sessions: tuple[str, ...]


def withdraw(registry: Registry, participant: str, why: str) -> Withdrawn:
    """Erase who a participant is, give up their rows, mark their sessions; the pseudonym is never given again.

    The identity goes first: interrupted in between, the same call does the rest.
    Raises ParticipantError on a participant who is not known or has withdrawn already, or a reason that names them.
    """
    status = status_of(registry, participant)
    if status is None:
        raise ParticipantError(unknown(registry.lab, participant))
    demand_nameless(registry.lab, participant, why)
    erased = erase(registry.lab, participant)
    forget(registry.lab, participant)
    if status == "withdrawn":
        raise ParticipantError(f"{participant} has withdrawn already; nothing about their identity is stored")
    sessions = sessions_of(registry.lab, participant)
    rows = recorded_everywhere(registry.lab, participant)
    return write(registry, lambda connection: _withdrawn(connection, participant, why, erased, sessions, rows))


def sessions_of(lab: Path, participant: str) -> tuple[str, ...]:
    """Return the names of the participant's session files in this lab's folder."""
    return tuple(sessions_by_participant(lab).get(participant, ()))


def sessions_by_participant(lab: Path) -> dict[str, list[str]]:
    """Return participant -> the names of their session files in this lab's folder."""
    sessions: dict[str, list[str]] = {}
    for path in ledgers_in(lab):
        sessions.setdefault(path.stem.rsplit("_", 2)[1], []).append(path.name)
    return sessions


def recorded_everywhere(lab: Path, participant: str) -> dict[str, ParticipantRow]:
    """Return the participant's recorded row in each study with sessions in this lab's folder."""
    ledgers = (lab / "sessions" / name for name in sessions_of(lab, participant))
    return {start.study: start.who for start in session_starts(ledgers)}


def _withdrawn(
    connection: Connection,
    participant: str,
    why: str,
    erased: bool,
    sessions: tuple[str, ...],
    rows: dict[str, ParticipantRow],
) -> Withdrawn:
    people = schema.participants
    connection.execute(update(people).where(people.c.participant == participant).values(status="withdrawn"))
    # the rows in the registry, and those of sessions from before there was one
    mine = schema.allocations
    query = select(mine.c.study).where(mine.c.participant == participant).order_by(mine.c.study)
    known = connection.execute(query).scalars().all()
    allocations = [allocation_of(connection, study, participant) for study in known]
    allocations += [
        Allocation(study, participant, who.group, who.row, "active")
        for study, who in sorted(rows.items())
        if study not in known
    ]
    released = [
        give_up(connection, allocation, "withdrawn")
        for allocation in allocations
        if allocation is not None and allocation.holds
    ]
    body = {"participant": participant, "why": why, "identity_erased": erased, "sessions": list(sessions)}
    note(connection, "withdrawn", body)
    return Withdrawn(participant, erased, tuple(released), sessions)
