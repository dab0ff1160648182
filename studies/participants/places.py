"""The rows of a study as they stand: held, given up, on offer; from the registry and the lab's own sessions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from palpate.studies.participants.allocations import Allocation
from palpate.studies.participants.taken_rows import rows_taken

Place = tuple[str | None, int]
Recorded = Mapping[str, Place]
"""Participant -> the row that their session here was recorded with."""


@dataclass(frozen=True)
class Places:
    """held: place -> who holds it. given_up: places nobody holds any more -> who gave them up last."""

    held: dict[Place, str]
    given_up: dict[Place, str]

    def offer(self, group: str | None) -> int:
        """The row that the next participant of a group gets: the lowest given up, else the lowest never taken."""
        rows = sorted(row for of, row in self.given_up if of == group)
        return rows[0] if rows else next(row for row in count() if (group, row) not in self.held)

    def holders(self, group: str | None) -> int:
        """How many hold a row of the group."""
        return sum(of == group for of, _ in self.held)


def recorded_rows(lab: Path, study: str) -> dict[str, Place]:
    """The rows of the sessions in the lab's folder: a lab that ran before it had a registry gives none twice."""
    taken = rows_taken(lab, study, simulated=False)
    return {who: place for place, holders in taken.items() for who in sorted(holders)}


def places(allocations: Sequence[Allocation], recorded: Recorded, gone: set[str]) -> Places:
    """The rows of a study. The registry overrules sessions; `gone` are those who withdrew."""
    known = {each.participant for each in allocations} | gone
    held = {place: who for who, place in sorted(recorded.items()) if who not in known}
    held |= {each.place: each.participant for each in allocations if each.holds}
    given_up = {each.place: each.participant for each in allocations if not each.holds and each.place not in held}
    return Places(held, given_up)


def emptiest(found: Places, groups: Sequence[str]) -> str | None:
    """The group with the fewest holders, the first in order of those; None where there are no groups."""
    return min(sorted(groups), key=found.holders, default=None)
