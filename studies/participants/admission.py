"""Whether a participant may start a session, and with which row; and that a session came to its end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sqlalchemy import Connection

from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.lab import ParticipantError, demand_lab
from palpate.studies.participants.allocations import allocation_of, save_allocation
from palpate.studies.participants.people import demand_known, status_of, unknown
from palpate.studies.participants.registry import Registry, find_registry, note, reading, write
from palpate.studies.participants.rows import allocate_row, release, release_command


def admit(
    lab: Path, study: Study, participant: str, live: bool, group: str | None = None, row: int | None = None
) -> ParticipantRow | None:
    """Return the row that a participant's session runs with; a live session gets one allocated if there is none yet.

    A simulated session writes nothing and gets the existing allocation, or None. Raises ParticipantError on a
    participant who withdrew, and for a live session on one who is not known, a row that is another's, or a folder that
    is no lab.
    """
    if live:
        return allocate_row(_registry_with(lab, participant), study, participant, group, row)
    registry = find_registry(lab)
    if registry is None:
        return None
    if status_of(registry, participant) == "withdrawn":
        raise ParticipantError(
            f"{participant} has withdrawn from {lab}: no session can be run, not even a simulated one"
        )
    with reading(registry) as connection:
        own = allocation_of(connection, study.study, participant)
    return ParticipantRow(participant, own.group, own.row) if own is not None and own.holds else None


def _registry_with(lab: Path, participant: str) -> Registry:
    demand_lab(lab)
    registry = find_registry(lab)
    if registry is None:
        raise ParticipantError(unknown(lab, participant))
    return registry


def demand_known_here(lab: Path, participant: str) -> None:
    """Raise ParticipantError unless the folder is a lab that knows the participant, who has not withdrawn."""
    demand_known(_registry_with(lab, participant), participant)


def demand_not_finished(lab: Path, study: str, participant: str) -> None:
    """Raise ParticipantError where the registry has the participant's first session as finished, here or elsewhere."""
    with reading(_registry_with(lab, participant)) as connection:
        own = allocation_of(connection, study, participant)
    if own is not None and own.status == "finished":
        raise ParticipantError(
            f"{participant} has finished {study} in a session that is not in {lab}: run further ones at the station "
            f"that has it; if it is void, first: {release_command(study, participant)}"
        )


def readmit(lab: Path, study: Study, participant: str) -> None:
    """Give a participant who gave up the row after a live session began that row back, so that the session can go on.

    Raises ParticipantError on a participant who withdrew, or where another participant holds the row by now.
    """
    registry = find_registry(lab)
    if admit(lab, study, participant, live=False) is not None or registry is None:
        return
    with reading(registry) as connection:
        own = allocation_of(connection, study.study, participant)
    if own is not None:
        allocate_row(registry, study, participant)


def decline(lab: Path, study: Study, participant: str, why: str = "declined to take part") -> None:
    """Offer the row of a participant who declines again; a participant who has finished a session keeps it."""
    registry = find_registry(lab)
    if registry is None:
        return
    with reading(registry) as connection:
        own = allocation_of(connection, study.study, participant)
    if own is not None and own.status == "active":
        release(registry, study, participant, why)


def finish(lab: Path, study: Study, participant: str) -> None:
    """Record that the participant's session is finished; without an active allocation, do nothing."""
    registry = find_registry(lab)
    if registry is None:
        return

    def act(connection: Connection) -> None:
        own = allocation_of(connection, study.study, participant)
        if own is not None and own.status == "active":
            save_allocation(connection, replace(own, status="finished"))
            note(connection, "finished", {"study": own.study, "participant": participant})

    write(registry, act)
