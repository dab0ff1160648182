"""Which group each participant belongs to: one level of every between factor, and someone in every combination."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import Cells, Counts
from palpate.analysis.statistics.labels import coded
from palpate.analysis.statistics.refusals import DuplicatedCells, TooFew, listed


@dataclass(frozen=True)
class Membership:
    """`groups` has each group's participants by place, the last factor running fastest; one group where no factor."""

    factors: list[Hashable]
    levels: list[list[Hashable]]
    groups: list[Counts]

    @property
    def sizes(self) -> list[int]:
        """How many participants each group has."""
        return [len(group) for group in self.groups]

    def names(self) -> list[str]:
        """Each group in words: its level of every factor."""
        return [_named(self.factors, where) for where in product(*self.levels)]


def membership(data: pd.DataFrame, cells: Cells, factors: Sequence[Hashable], subject: Hashable) -> Membership:
    """The groups of the participants that `cells` kept.

    Raises DuplicatedCells for a participant with two levels of a factor, TooFew for a factor with one level or a
    combination of levels without a participant, BadValue for a row without a label.
    """
    place = {label: i for i, label in enumerate(cells.participants)}
    people = coded(data[subject], subject)
    who = np.array([place.get(label, -1) for label in people.labels], dtype=np.intp)
    rows = who[people.codes]
    levels, codes = [], np.zeros(len(place), dtype=np.intp)
    for factor in factors:
        labels, own = _own_levels(data, factor, rows, cells)
        levels.append(labels)
        codes = codes * len(labels) + own
    count = math.prod(map(len, levels))
    found = Membership(list(factors), levels, [np.flatnonzero(codes == group) for group in range(count)])
    _refuse_empty(found)
    return found


def _own_levels(data: pd.DataFrame, factor: Hashable, rows: Counts, cells: Cells) -> tuple[list[Hashable], Counts]:
    group = coded(data[factor], factor)
    kept = rows >= 0
    own = np.zeros(len(cells.participants), dtype=np.intp)
    own[rows[kept]] = group.codes[kept]
    moved = np.unique(rows[kept][own[rows[kept]] != group.codes[kept]]).tolist()
    if moved:
        found = listed((repr(cells.participants[i]) for i in moved), len(moved))
        raise DuplicatedCells(
            f"participants with several levels of {factor!r}: {found}; use `within` for a factor within participants"
        )
    used, own = np.unique(own, return_inverse=True)
    if len(used) < 2:
        raise TooFew(f"factor {factor!r} has one level, {group.labels[int(used[0])]!r}; a comparison needs two or more")
    return [group.labels[i] for i in used.tolist()], own


def _refuse_empty(found: Membership) -> None:
    empty = [name for name, size in zip(found.names(), found.sizes, strict=True) if not size]
    if empty:
        raise TooFew(
            f"no participant has {listed(empty, len(empty))}; every combination of the between factors needs one: "
            "take a level out, or join the factors into one column"
        )
    if found.factors and max(found.sizes) < 2:
        raise TooFew("every group has one participant; at least one group needs two or more")


def _named(factors: Sequence[Hashable], where: tuple[Hashable, ...]) -> str:
    return " and ".join(f"{factor!r} = {level!r}" for factor, level in zip(factors, where, strict=True))
