"""Whether a participant may sit down to a session, and with which row; and that a session came to its end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sqlalchemy import Connection

from protocols.plan import ParticipantRow
from protocols.study import Study
from studies.participants.allocations import allocation_of, keep
from studies.participants.errors import ParticipantError
from studies.participants.lab import demand_lab
from studies.participants.people import status_of, unknown
from studies.participants.registry import find_registry, note, reading, write
from studies.participants.rows import allocate_row


def admit(
    lab: Path, study: Study, participant: str, live: bool, group: str | None = None, row: int | None = None
) -> ParticipantRow | None:
    """The row that a participant's session runs with; a live session gets one allocated if there is none yet.

    A simulated session writes nothing and gets the allocation there is, or None.
    Raises ParticipantError on a participant who withdrew, and for a live session on one who is not known, a row that
    is another's, or a folder that is no lab.
    """
    if live:
        return _live(lab, study, participant, group, row)
    registry = find_registry(lab)
    if registry is None:
        return None
    if status_of(registry, participant) == "withdrawn":
        raise ParticipantError(
            f"{participant} has withdrawn from {lab}: no session can be had, not even a simulated one"
        )
    with reading(registry) as connection:
        own = allocation_of(connection, study.study, participant)
    return ParticipantRow(participant, own.group, own.row) if own is not None and own.holds else None


def _live(lab: Path, study: Study, participant: str, group: str | None, row: int | None) -> ParticipantRow:
    demand_lab(lab)
    registry = find_registry(lab)
    if registry is None:
        raise ParticipantError(unknown(lab, participant))
    return allocate_row(registry, study, participant, group, row)


def finish(lab: Path, study: Study, participant: str) -> None:
    """Put on record that the participant's session came to its end; without an active allocation, nothing happens."""
    registry = find_registry(lab)
    if registry is None:
        return

    def act(connection: Connection) -> None:
        own = allocation_of(connection, study.study, participant)
        if own is not None and own.status == "active":
            keep(connection, replace(own, status="finished"))
            note(connection, "finished", {"study": own.study, "participant": participant})

    write(registry, act)
