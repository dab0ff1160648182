"""Groups of values and groups of participants from long tables; unsuitable tables are refused."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import (
    Aggregate,
    Cells,
    Coded,
    Counts,
    Missing,
    cell_means,
    check_columns,
    check_options,
    coded,
    name_list,
    numbers_of,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import (
    NO_SUBJECT,
    BadOption,
    DuplicatedCells,
    IncompleteCells,
    TooFew,
    listed,
    refuse_idle,
)
from palpate.protocols.wording import count


@dataclass(frozen=True)
class Groups:
    """The sorted values of each group, so that no result depends on the order of rows."""

    factor: Hashable
    labels: list[Hashable]
    values: list[Floats]
    dropped: list[Hashable] = field(default_factory=list)
    ratings_per_value: tuple[int, int] = (1, 1)

    def attrs(self) -> dict[str, Any]:
        """Return the facts about the table that qualify a result: values per group, rows or participants left out."""
        sizes = [len(values) for values in self.values]
        facts = {"group_sizes": dict(zip(self.labels, sizes, strict=True)), "dropped": self.dropped}
        return facts if self.ratings_per_value == (1, 1) else facts | {"ratings_per_cell": self.ratings_per_value}


def gather_groups(
    data: pd.DataFrame,
    dv: Hashable,
    between: Hashable | Iterable[Hashable],
    subject: Hashable | None = None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Groups:
    """Return the groups of a long table; with `subject`, one value per participant, who belongs to one group.

    `missing="listwise"` leaves out rows (participants) without a value, `aggregate="mean"` averages each
    participant's values.
    Raises UnknownColumn, BadValue, IncompleteCells, DuplicatedCells, BadOption or TooFew.
    """
    check_options(missing, aggregate)
    if subject is None:
        refuse_idle("aggregate", aggregate, None, NO_SUBJECT)
    # The factor that `between` names.
    factors = name_list(between)
    if len(factors) != 1:
        raise BadOption(
            f"between={factors!r} names {len(factors)} factors; this is a one-way test: name one factor, "
            "or join the factors into one column first"
        )
    factor = factors[0]
    check_columns(data, [dv, factor] if subject is None else [dv, factor, subject])
    y, group = numbers_of(data[dv], dv), coded(data[factor], factor)
    if len(group.labels) < 2:
        raise TooFew(f"factor {factor!r} has {count(len(group.labels), 'group')}; a comparison needs two or more")
    units = Coded(np.arange(len(y)), [f"row {i + 1}" for i in range(len(y))])
    ratings = (1, 1)
    if subject is not None:
        units = coded(data[subject], subject)
        y, group, ratings = _per_participant(y, group, units, aggregate)
    lost = np.flatnonzero(np.isnan(y)).tolist()
    dropped = [units.labels[i] for i in lost]
    if dropped and missing == "raise":
        raise IncompleteCells(
            f"no value in column {dv!r} for {listed(map(str, dropped), len(dropped))}; "
            "pass missing='listwise' to leave them out"
        )
    return Groups(factor, group.labels, _values_by_group(y, group, factor), dropped, ratings)


def _values_by_group(y: Floats, group: Coded, factor: Hashable) -> list[Floats]:
    """Return the values of each group, sorted, without the missing ones.

    Raises TooFew if a group has no values left, or no group has more than one.
    """
    order = np.lexsort((y, group.codes))
    present = order[~np.isnan(y[order])]
    ends = np.searchsorted(group.codes[present], np.arange(1, len(group.labels)))
    values = np.split(y[present], ends)
    empty = [label for label, own in zip(group.labels, values, strict=True) if not len(own)]
    if empty:
        listing = listed(map(repr, empty), len(empty))
        raise TooFew(f"no value is left in {factor!r} = {listing}; take the group out or find its values")
    if all(len(own) == 1 for own in values):
        raise TooFew(f"every group of {factor!r} has one value; at least one needs two or more")
    return values


def _per_participant(
    y: Floats, group: Coded, people: Coded, aggregate: Aggregate
) -> tuple[Floats, Coded, tuple[int, int]]:
    """Return one value and one group per participant, and how many ratings a value averages."""
    n = len(people.labels)
    own = np.zeros(n, dtype=np.intp)
    own[people.codes] = group.codes
    moved = np.unique(people.codes[own[people.codes] != group.codes]).tolist()
    if moved:
        listing = listed((repr(people.labels[i]) for i in moved), len(moved))
        raise DuplicatedCells(f"participants in more than one group: {listing}; use `within` for a factor within them")
    count: Counts = np.bincount(people.codes, minlength=n)
    if count.max() > 1 and aggregate is None:
        several = np.flatnonzero(count > 1).tolist()
        listing = listed((f"{people.labels[i]!r} ({count[i]} values)" for i in several), len(several))
        raise DuplicatedCells(
            f"participants with several values: {listing}; pass aggregate='mean' to average each participant's values"
        )
    return cell_means(y, people.codes, count), Coded(own, group.labels), (int(count.min()), int(count.max()))


@dataclass(frozen=True)
class Membership:
    """Participants by group and index, with the last factor varying fastest; one group without factors."""

    factors: list[Hashable]
    levels: list[list[Hashable]]
    groups: list[Counts]

    @property
    def sizes(self) -> list[int]:
        """The number of participants of each group."""
        return [len(group) for group in self.groups]

    def names(self) -> list[str]:
        """Return a description of each group by its level of every factor."""
        return [
            " and ".join(f"{factor!r} = {level!r}" for factor, level in zip(self.factors, levels, strict=True))
            for levels in product(*self.levels)
        ]


def membership(data: pd.DataFrame, cells: Cells, factors: Sequence[Hashable], subject: Hashable) -> Membership:
    """Return the groups of the participants in `cells`.

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
    result = Membership(list(factors), levels, [np.flatnonzero(codes == group) for group in range(count)])
    empty = [name for name, size in zip(result.names(), result.sizes, strict=True) if not size]
    if empty:
        raise TooFew(
            f"no participant has {listed(empty, len(empty))}; every combination of the between factors needs one: "
            "take a level out, or join the factors into one column"
        )
    if result.factors and max(result.sizes) < 2:
        raise TooFew("every group has one participant; at least one group needs two or more")
    return result


def _own_levels(data: pd.DataFrame, factor: Hashable, rows: Counts, cells: Cells) -> tuple[list[Hashable], Counts]:
    group = coded(data[factor], factor)
    used_rows = rows >= 0
    own = np.zeros(len(cells.participants), dtype=np.intp)
    own[rows[used_rows]] = group.codes[used_rows]
    moved = np.unique(rows[used_rows][own[rows[used_rows]] != group.codes[used_rows]]).tolist()
    if moved:
        listing = listed((repr(cells.participants[i]) for i in moved), len(moved))
        raise DuplicatedCells(
            f"participants with several levels of {factor!r}: {listing}; use `within` for a factor within participants"
        )
    used, own = np.unique(own, return_inverse=True)
    if len(used) < 2:
        raise TooFew(f"factor {factor!r} has one level, {group.labels[int(used[0])]!r}; a comparison needs two or more")
    return [group.labels[i] for i in used.tolist()], own
