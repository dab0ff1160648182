"""A list of the lab's participants: status, rows, sessions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sqlalchemy import select

from palpate.protocols.wording import count
from palpate.studies.participants import schema
from palpate.studies.participants.allocations import Allocation, every_allocation
from palpate.studies.participants.identities import Identity
from palpate.studies.participants.people import in_sessions
from palpate.studies.participants.registry import Registry, reading
from palpate.studies.participants.withdrawal import sessions_by_participant

Row = dict[str, Any]


def listed(registry: Registry, study: str | None = None) -> list[Row]:
    """Return everybody in the registry, and those who only have sessions here (status: session), by pseudonym.

    With a study, only those with a row of it, even a released one. It holds no names.
    """
    people = schema.participants
    with reading(registry) as connection:
        status = {row.participant: row.status for row in connection.execute(select(people))}
    rows: dict[str, list[Allocation]] = {}
    for allocation in every_allocation(registry, study):
        rows.setdefault(allocation.participant, []).append(allocation)
    status = dict.fromkeys(in_sessions(registry.lab), "session") | status
    sessions = sessions_by_participant(registry.lab)
    return [
        {
            "participant": who,
            "status": status[who],
            "studies": [
                {
                    "study": allocation.study,
                    "group": allocation.group,
                    "row": allocation.row,
                    "status": allocation.status,
                    "replaces": allocation.replaces,
                }
                for allocation in rows.get(who, [])
            ],
            "sessions": sessions.get(who, []),
        }
        for who in sorted(status)
        if study is None or who in rows
    ]


def lines(people: Sequence[Row], identities: Mapping[str, Identity]) -> Iterator[str]:
    """Yield the lines of the list for the screen, with names if identities are given."""
    for person in people:
        known = identities.get(person["participant"])
        named = "".join(f"  {text}" for text in known.to_dict().values()) if known is not None else ""
        sessions = len(person["sessions"])
        yield f"{person['participant']:<8} {person['status']:<10} {count(sessions, 'session')}{named}"
        for allocation in person["studies"]:
            group = f"group {allocation['group']}, " if allocation["group"] is not None else ""
            inherited = f", inherited from {allocation['replaces']}" if allocation["replaces"] else ""
            yield f"{'':<8} {allocation['study']}: {group}row {allocation['row']}, {allocation['status']}{inherited}"
    yield f"{count(len(people), 'participant')}, {sum(person['status'] == 'withdrawn' for person in people)} withdrawn"
