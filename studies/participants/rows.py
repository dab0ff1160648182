"""Allocation of rows of a counterbalancing square: once, atomically, inherited by a replacement, offered again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

from sqlalchemy import Connection

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.plan import LARGEST_ROW
from palpate.protocols.shell_command import shell_command
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.lab import ParticipantError
from palpate.studies.participants.allocations import (
    Allocation,
    allocation_of,
    allocations_of,
    describe_place,
    save_allocation,
)
from palpate.studies.participants.people import demand_active
from palpate.studies.participants.registry import Registry, gone, note, write
from palpate.studies.participants.row_assignment import rows_taken

Place = tuple[str | None, int]
Recorded = Mapping[str, Place]
"""Participant -> the row that their session here was recorded with."""


@dataclass(frozen=True)
class Wish:
    """A request for a row: a group, a row in it, or the row of a participant who dropped out."""

    group: str | None = None
    row: int | None = None
    replaces: str | None = None


def allocate_row(
    registry: Registry,
    study: Study,
    participant: str,
    group: str | None = None,
    row: int | None = None,
    replaces: str | None = None,
) -> ParticipantRow:
    """Allocate a row of the study to the participant, and return it; an existing allocation is returned unchanged.

    Without a request it is in the group with the fewest holders: the lowest row that was given up, else the lowest
    never taken. One transaction decides, also between stations. Rows grow without bound; a design takes them modulo its
    own number. `replaces` inherits the row of somebody who dropped out or withdrew. Raises ParticipantError on an
    unknown or withdrawn participant, a row that is held, a group that does not exist.
    """
    wish = Wish(group, row, replaces)
    if wish.replaces == participant:
        raise ParticipantError(f"{participant} cannot replace {participant}")
    if wish.replaces is not None and (wish.group is not None or wish.row is not None):
        raise ParticipantError(f"{participant}: --replaces inherits group and row; leave --group and --row out")
    if wish.group is not None and wish.group not in study.groups:
        hint = nearest(wish.group, sorted(study.groups)) if study.groups else "it has no groups"
        raise ParticipantError(f"{study.study} has no group {wish.group!r}; {hint}")
    if wish.row is not None and study.groups and wish.group is None:
        raise ParticipantError(
            f"row {wish.row} of which group? {study.study} has groups {', '.join(sorted(study.groups))}: give --group"
        )
    if wish.row is not None and not 0 <= wish.row < LARGEST_ROW:
        raise ParticipantError(f"row {wish.row}: a row from 0 to {LARGEST_ROW - 1} is expected")
    recorded = recorded_rows(registry.lab, study.study)
    got = write(registry, lambda connection: _allocated(connection, registry, study, participant, wish, recorded))
    return ParticipantRow(participant, got.group, got.row)


def release(registry: Registry, study: Study, participant: str, why: str) -> Allocation:
    """Release the row of a participant who dropped out, so that it is offered again; return the allocation.

    Raises ParticipantError where the participant is not known, or holds no row of the study.
    """
    recorded = recorded_rows(registry.lab, study.study)

    def act(connection: Connection) -> Allocation:
        demand_active(connection, registry.lab, participant)
        own = allocation_of(connection, study.study, participant) or _earlier(study.study, participant, recorded)
        if own is None or not own.holds:
            raise ParticipantError(f"{participant} holds no row of {study.study}")
        return give_up(connection, own, why)

    return write(registry, act)


def give_up(connection: Connection, own: Allocation, why: str) -> Allocation:
    """Record that an allocation is released."""
    released = replace(own, status="released")
    save_allocation(connection, released)
    note(connection, "released", {**_fields(own), "why": why})
    return released


def _earlier(study: str, participant: str, recorded: Recorded) -> Allocation | None:
    """Return the row of the participant's session from before the lab had a registry."""
    if participant not in recorded:
        return None
    group, row = recorded[participant]
    return Allocation(study, participant, group, row, "active")


def _allocated(
    connection: Connection, registry: Registry, study: Study, participant: str, wish: Wish, recorded: Recorded
) -> Allocation:
    demand_active(connection, registry.lab, participant)
    everybody = allocations_of(connection, study.study)
    own = next((person for person in everybody if person.participant == participant), None)
    place = _wished(study.study, wish, everybody, recorded)
    if own is not None and own.holds:
        _demand_same(own, wish, place)
        return own
    # The participant's own session from before the registry holds nothing against the participant.
    others = {who: at for who, at in recorded.items() if who != participant}
    standing = places(everybody, others, gone(connection))
    earlier = own or _earlier(study.study, participant, recorded)
    if earlier is not None:
        _demand_same(earlier, wish, place)
        holder = standing.held.get(earlier.place)
        if holder is not None:
            raise ParticipantError(
                f"{earlier.participant} had {earlier.describe()} of {earlier.study}, which is {holder}'s now, and "
                f"a row is allocated once; if {holder} dropped out: {release_command(earlier.study, holder)}"
            )
        return _given(connection, replace(earlier, status="active"))
    return _given(
        connection, Allocation(study.study, participant, *_free(study, standing, place, wish), "active", wish.replaces)
    )


def release_command(study: str, participant: str) -> str:
    """Return the command that takes a row from a participant, its reason left to fill in."""
    return f"{shell_command('participants', 'release', study, participant, '--why')} ..."


def _free(study: Study, standing: Places, place: Place | None, wish: Wish) -> Place:
    """Return the requested place if nobody holds it, else the next on offer."""
    if place is None:
        group = wish.group if wish.group is not None else emptiest(standing, list(study.groups))
        return group, standing.offer(group)
    if place in standing.held:
        raise ParticipantError(
            f"{describe_place(place)} of {study.study} is {standing.held[place]}'s; leave --row out for one on offer, "
            f"or first: {release_command(study.study, standing.held[place])}"
        )
    return place


def _wished(study: str, wish: Wish, everybody: list[Allocation], recorded: Recorded) -> Place | None:
    """Return the requested place, or None if any will do."""
    if wish.replaces is None:
        return (wish.group, wish.row) if wish.row is not None else None
    left = next((person for person in everybody if person.participant == wish.replaces), None)
    left = left or _earlier(study, wish.replaces, recorded)
    if left is None:
        raise ParticipantError(f"{wish.replaces} never had a row of {study}; there is nothing to inherit")
    if left.holds:
        raise ParticipantError(
            f"{wish.replaces} still holds {left.describe()} of {study}; if they dropped out: "
            f"{release_command(study, wish.replaces)}"
        )
    return left.place


def _demand_same(own: Allocation, wish: Wish, place: Place | None) -> None:
    """Raise ParticipantError on a request for another row than the allocated one."""
    if (place is not None and place != own.place) or (wish.group is not None and wish.group != own.group):
        raise ParticipantError(
            f"{own.participant} has {own.describe()} of {own.study}; a row is allocated once, and cannot be exchanged"
        )


def _given(connection: Connection, got: Allocation) -> Allocation:
    save_allocation(connection, got)
    note(connection, "allocated", {**_fields(got), "replaces": got.replaces})
    return got


def _fields(one: Allocation) -> dict[str, str | int | None]:
    return {"study": one.study, "participant": one.participant, "group": one.group, "row": one.row}


@dataclass(frozen=True)
class Places:
    """The places of a study: `held` is place -> holder, `given_up` place -> the last holder, if nobody holds it now."""

    held: dict[Place, str]
    given_up: dict[Place, str]

    def offer(self, group: str | None) -> int:
        """Return the next row that a participant of a group gets: the lowest given up, else the lowest never taken."""
        rows = sorted(row for of, row in self.given_up if of == group)
        return rows[0] if rows else next(row for row in count() if (group, row) not in self.held)

    def holders(self, group: str | None) -> int:
        """Return how many participants hold a row of the group."""
        return sum(of == group for of, _ in self.held)


def recorded_rows(lab: Path, study: str) -> dict[str, Place]:
    """Return each participant's row by the sessions in the lab's folder, which count as held without a registry."""
    taken = rows_taken(lab, study, simulated=False)
    return {who: place for place, holders in taken.items() for who in sorted(holders)}


def places(allocations: Sequence[Allocation], recorded: Recorded, gone: set[str]) -> Places:
    """Return the places of a study. The registry overrules sessions; `gone` are those who withdrew."""
    known = {allocation.participant for allocation in allocations} | gone
    held = {place: who for who, place in sorted(recorded.items()) if who not in known}
    held |= {allocation.place: allocation.participant for allocation in allocations if allocation.holds}
    given_up = {
        allocation.place: allocation.participant
        for allocation in allocations
        if not allocation.holds and allocation.place not in held
    }
    return Places(held, given_up)


def emptiest(places: Places, groups: Sequence[str]) -> str | None:
    """Return the group with the fewest holders, the first of equal ones; None if there are no groups."""
    return min(sorted(groups), key=places.holders, default=None)
