"""Who holds which row of a study's counterbalancing square, as the registry has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Select, insert, select, update

from palpate.studies.participants import schema
from palpate.studies.participants.registry import Registry, reading
from palpate.studies.sessions.environment import wall_time

table = schema.allocations


@dataclass(frozen=True)
class Allocation:
    """A participant's row in a study: 0-based, in a group or in none; `replaces` is whose row was inherited."""

    study: str
    participant: str
    group: str | None
    row: int
    status: str
    replaces: str | None = None

    @property
    def place(self) -> tuple[str | None, int]:
        """Group and row."""
        return (self.group, self.row)

    @property
    def holds(self) -> bool:
        """Whether the row is this participant's and nobody else's."""
        return self.status in schema.HOLDING

    def describe(self) -> str:
        """Describe the row in words."""
        return describe_place(self.place)


def describe_place(place: tuple[str | None, int]) -> str:
    """Describe a row in words."""
    group, row = place
    return f"row {row}" + (f" of group {group}" if group is not None else "")


def allocations_of(connection: Connection, study: str) -> list[Allocation]:
    """Return a study's allocations, including released ones, by group, row and participant."""
    return _read(connection, select(table).where(table.c.study == study))


def allocation_of(connection: Connection, study: str, participant: str) -> Allocation | None:
    """Return a participant's allocation in a study, even if released; None if there is none."""
    query = select(table).where(table.c.study == study, table.c.participant == participant)
    return next(iter(_read(connection, query)), None)


def every_allocation(registry: Registry, study: str | None = None) -> list[Allocation]:
    """Return all allocations of the lab, or of one study."""
    query = select(table) if study is None else select(table).where(table.c.study == study)
    with reading(registry) as connection:
        return _read(connection, query)


def save_allocation(connection: Connection, one: Allocation) -> None:
    """Write an allocation, new or changed. Raises IntegrityError where another participant holds its row."""
    values = {
        "group_name": one.group or "",
        "row": one.row,
        "status": one.status,
        "replaces": one.replaces,
        "at": wall_time(),
    }
    mine = (table.c.study == one.study) & (table.c.participant == one.participant)
    if connection.execute(update(table).where(mine).values(values)).rowcount == 0:
        connection.execute(insert(table), {"study": one.study, "participant": one.participant, **values})


def _read(connection: Connection, query: Select[Any]) -> list[Allocation]:
    ordered = query.order_by(table.c.study, table.c.group_name, table.c.row, table.c.at, table.c.participant)
    return [
        Allocation(row.study, row.participant, row.group_name or None, row.row, row.status, row.replaces)
        for row in connection.execute(ordered)
    ]
