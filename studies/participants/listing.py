"""The lab's participants in a list: status, rows, sessions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sqlalchemy import select

from palpate.protocols.wording import count
from palpate.studies.participants import schema
from palpate.studies.participants.allocations import Allocation, every_allocation
from palpate.studies.participants.identities import Identity
from palpate.studies.participants.pseudonyms import in_sessions
from palpate.studies.participants.registry import Registry, reading
from palpate.studies.participants.withdrawal import sessions_by_participant

Row = dict[str, Any]


def listed(registry: Registry, study: str | None = None) -> list[Row]:
    """Everybody in the registry, and who has sessions here without being in it (status: session), by pseudonym.

    With a study, those with a row of it, also one given up. No names.
    """
    people = schema.participants
    with reading(registry) as connection:
        status = {row.participant: row.status for row in connection.execute(select(people))}
    rows: dict[str, list[Allocation]] = {}
    for each in every_allocation(registry, study):
        rows.setdefault(each.participant, []).append(each)
    status = dict.fromkeys(in_sessions(registry.lab), "session") | status
    sessions = sessions_by_participant(registry.lab)
    return [
        _row(who, status[who], rows.get(who, []), sessions.get(who, []))
        for who in sorted(status)
        if study is None or who in rows
    ]


def _row(participant: str, status: str, rows: Sequence[Allocation], sessions: list[str]) -> Row:
    return {
        "participant": participant,
        "status": status,
        "studies": [
            {
                "study": each.study,
                "group": each.group,
                "row": each.row,
                "status": each.status,
                "replaces": each.replaces,
            }
            for each in rows
        ],
        "sessions": sessions,
    }


def lines(people: Sequence[Row], identities: Mapping[str, Identity]) -> Iterator[str]:
    """The list for the screen; with names where identities are given."""
    for person in people:
        known = identities.get(person["participant"])
        named = "".join(f"  {text}" for text in known.told().values()) if known is not None else ""
        sessions = len(person["sessions"])
        yield f"{person['participant']:<8} {person['status']:<10} {count(sessions, 'session')}{named}"
        for each in person["studies"]:
            group = f"group {each['group']}, " if each["group"] is not None else ""
            inherited = f", inherited from {each['replaces']}" if each["replaces"] else ""
            yield f"{'':<8} {each['study']}: {group}row {each['row']}, {each['status']}{inherited}"
    yield f"{count(len(people), 'participant')}, {sum(person['status'] == 'withdrawn' for person in people)} withdrawn"
