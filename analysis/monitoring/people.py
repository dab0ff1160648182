"""Who withdrew and who holds which row: the monitor's one look at a lab's registry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from palpate.studies.participants.allocations import Allocation, every_allocation
from palpate.studies.participants.lab import ParticipantError
from palpate.studies.participants.registry import find_registry, withdrawn

AGAIN_S = 5.0
"""The registry may lie on a server: it is not asked at every look."""


@dataclass(frozen=True)
class People:
    """Pseudonyms that withdrew, and the allocations by study; `problem` says why they are not known."""

    withdrawn: frozenset[str] = frozenset()
    allocations: Mapping[str, tuple[Allocation, ...]] = field(default_factory=dict)
    problem: str | None = None
    asked_at: float = float("-inf")


def people_of(lab: Path, known: People, now: float) -> People:
    """What the lab's registry says, nothing where it has none; what is known where it was asked a moment ago.

    Where the registry cannot be read, the last known stands, with the problem.
    """
    if 0 <= now - known.asked_at < AGAIN_S:
        return known
    try:
        return replace(_asked(lab), asked_at=now)
    except ParticipantError as error:
        return replace(known, problem=f"Who withdrew or holds a row may be out of date: {error}", asked_at=now)


def _asked(lab: Path) -> People:
    registry = find_registry(lab)
    if registry is None:
        return People()
    found: dict[str, list[Allocation]] = {}
    for each in every_allocation(registry):
        found.setdefault(each.study, []).append(each)
    return People(frozenset(withdrawn(lab)), {study: tuple(some) for study, some in found.items()})
