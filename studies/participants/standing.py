"""How a study stands: its balance so far, who holds which row, what is on offer, and who took part in what else."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from palpate.protocols.balance import Balance, certificates
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.participants.allocations import Allocation, every_allocation
from palpate.studies.participants.places import Places, places, recorded_rows
from palpate.studies.participants.registry import Registry, withdrawn
from palpate.studies.sessions.session_files import ledgers_in
from palpate.studies.sessions.session_headers import session_starts


@dataclass(frozen=True)
class GroupStanding:
    """One group: its certificates, its rows with their holders, rows given up, and the row the next one gets.

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
        """As a method section says it."""
        share = round(100 * self.common / self.of) if self.of else 0
        return f"{share} % ({self.common} of {self.of}) also took part in {self.other}"


def standing(registry: Registry, study: Study, seed: int = 0) -> list[GroupStanding]:
    """Every group of a study as it stands.

    Orders drawn at random are those of the session that a participant had here; `seed` is for who had none yet.
    """
    kept = every_allocation(registry, study.study)
    found = places(kept, recorded_rows(registry.lab, study.study), withdrawn(registry.lab))
    known = {each.participant: each for each in kept if each.holds}
    groups: list[str | None] = [*sorted(study.groups)]
    seeds = _seeds(registry.lab, study.study, seed)
    return [_of_group(study, group, found, known, seeds) for group in groups or [None]]


def overlaps(registry: Registry, study: str) -> list[Overlap]:
    """For each other study of the lab, how many of this study's participants took part in it, too.

    Somebody takes part who holds a row of the study or has a session of it here, in person; who withdrew does not
    count.
    """
    of = _participation(registry)
    mine = of.pop(study, set())
    return [Overlap(other, len(mine & theirs), len(mine)) for other, theirs in sorted(of.items())]


def _of_group(
    study: Study, group: str | None, found: Places, known: dict[str, Allocation], seeds: Mapping[str, int]
) -> GroupStanding:
    held = sorted((row, who) for (of, row), who in found.held.items() if of == group)
    people = [(ParticipantRow(who, group, row), seeds[who]) for row, who in held]
    return GroupStanding(
        group,
        certificates(study, people),
        tuple(known.get(who) or Allocation(study.study, who, group, row, "session") for row, who in held),
        tuple(sorted((row, who) for (of, row), who in found.given_up.items() if of == group)),
        found.offer(group),
    )


def _seeds(lab: Path, study: str, otherwise: int) -> Mapping[str, int]:
    """Participant -> the seed of their first session of the study in person."""
    found: defaultdict[str, int] = defaultdict(lambda: otherwise)
    for each in session_starts(reversed(ledgers_in(lab, study))):
        if each.in_person and each.seed is not None:
            found[each.who.participant] = each.seed
    return found


def _participation(registry: Registry) -> dict[str, set[str]]:
    """Study -> who takes part."""
    found: dict[str, set[str]] = {}
    for held in every_allocation(registry):
        if held.holds:
            found.setdefault(held.study, set()).add(held.participant)
    for each in session_starts(ledgers_in(registry.lab)):
        if each.in_person:
            found.setdefault(each.study, set()).add(each.who.participant)
    gone = withdrawn(registry.lab)
    return {study: people - gone for study, people in found.items() if people - gone}
