"""How a study's rows are allocated: the balance so far, who holds which row, what is on offer, and overlaps."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from palpate.protocols.balance import Balance, certificates
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.participants.allocations import Allocation, every_allocation
from palpate.studies.participants.registry import Registry, withdrawn
from palpate.studies.participants.rows import Places, places, recorded_rows
from palpate.studies.sessions.session_files import ledgers_in, session_starts


@dataclass(frozen=True)
class GroupAllocation:
    """One group: its certificates, its rows with their holders, rows given up, and the next participant's row.

    `certificates` are those of `palpate.protocols.balance.certificates`: of all sessions,
    then of each where there are several.
    """

    group: str | None
    certificates: Mapping[str, Balance]
    holders: tuple[Allocation, ...]
    given_up: tuple[tuple[int, str], ...]
    next_row: int

    @property
    def certificate(self) -> Balance:
        """The certificate over all sessions."""
        return self.certificates[""]


@dataclass(frozen=True)
class Overlap:
    """How many of a study's participants also took part in another."""

    other: str
    common: int
    of: int

    def text(self) -> str:
        """Return a sentence for a method section."""
        share = round(100 * self.common / self.of) if self.of else 0
        return f"{share} % ({self.common} of {self.of}) also took part in {self.other}"


def group_allocations(registry: Registry, study: Study, seed: int = 0) -> list[GroupAllocation]:
    """Return the present allocation of every group of a study.

    Orders drawn at random are those of the session that a participant had here; `seed` is for participants without a
    session.
    """
    allocations = every_allocation(registry, study.study)
    held_places = places(allocations, recorded_rows(registry.lab, study.study), withdrawn(registry.lab))
    known = {allocation.participant: allocation for allocation in allocations if allocation.holds}
    groups: list[str | None] = [*sorted(study.groups)]
    # participant -> the seed of their first session of the study in person
    seeds: defaultdict[str, int] = defaultdict(lambda: seed)
    for start in session_starts(reversed(ledgers_in(registry.lab, study.study))):
        if start.in_person and start.seed is not None:
            seeds[start.who.participant] = start.seed
    return [_of_group(study, group, held_places, known, seeds) for group in groups or [None]]


def overlaps(registry: Registry, study: str) -> list[Overlap]:
    """Return for each other study of the lab how many of this study's participants took part in it, too.

    Whoever holds a row of the study or has a real session of it here takes part, except those who withdrew.
    """
    # study -> who takes part
    people: dict[str, set[str]] = {}
    for held in every_allocation(registry):
        if held.holds:
            people.setdefault(held.study, set()).add(held.participant)
    for start in session_starts(ledgers_in(registry.lab)):
        if start.in_person:
            people.setdefault(start.study, set()).add(start.who.participant)
    gone = withdrawn(registry.lab)
    of = {study: people - gone for study, people in people.items() if people - gone}
    mine = of.pop(study, set())
    return [Overlap(other, len(mine & theirs), len(mine)) for other, theirs in sorted(of.items())]


def _of_group(
    study: Study, group: str | None, places: Places, known: dict[str, Allocation], seeds: Mapping[str, int]
) -> GroupAllocation:
    held = sorted((row, who) for (of, row), who in places.held.items() if of == group)
    people = [(ParticipantRow(who, group, row), seeds[who]) for row, who in held]
    return GroupAllocation(
        group,
        certificates(study, people),
        tuple(known.get(who) or Allocation(study.study, who, group, row, "session") for row, who in held),
        tuple(sorted((row, who) for (of, row), who in places.given_up.items() if of == group)),
        places.offer(group),
    )
