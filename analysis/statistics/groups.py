"""A long table to groups of independent values, one per row or per participant; anything else is refused by name."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import (
    Aggregate,
    Counts,
    Missing,
    cell_means,
    check_columns,
    check_options,
    name_list,
)
from palpate.analysis.statistics.column_values import numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.labels import Coded, coded
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
    """The values of each group, each sorted (so that no result depends on the order of rows)."""

    factor: Hashable
    labels: list[Hashable]
    values: list[Floats]
    dropped: list[Hashable] = field(default_factory=list)
    ratings_per_value: tuple[int, int] = (1, 1)

    def attrs(self) -> dict[str, Any]:
        """What a result says of how its table was made: values per group, rows or participants left out."""
        sizes = [len(values) for values in self.values]
        made = {"group_sizes": dict(zip(self.labels, sizes, strict=True)), "dropped": self.dropped}
        return made if self.ratings_per_value == (1, 1) else made | {"ratings_per_cell": self.ratings_per_value}


def gather_groups(
    data: pd.DataFrame,
    dv: Hashable,
    between: Hashable | Iterable[Hashable],
    subject: Hashable | None = None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Groups:
    """The groups of a long table; with `subject`, one value per participant, who belongs to one group.

    `missing="listwise"` leaves out rows (participants) without a value, `aggregate="mean"` averages each
    participant's values.
    Raises UnknownColumn, BadValue, IncompleteCells, DuplicatedCells, BadOption or TooFew.
    """
    check_options(missing, aggregate)
    if subject is None:
        refuse_idle("aggregate", aggregate, None, NO_SUBJECT)
    factor = _single(between)
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
    return Groups(factor, group.labels, _split(factor, y, group), dropped, ratings)


def _single(between: Hashable | Iterable[Hashable]) -> Hashable:
    factors = name_list(between)
    if len(factors) != 1:
        raise BadOption(
            f"between={factors!r} names {len(factors)} factors; this is a one-way test: name one factor, "
            "or join the factors into one column first"
        )
    return factors[0]


def _per_participant(
    y: Floats, group: Coded, people: Coded, aggregate: Aggregate
) -> tuple[Floats, Coded, tuple[int, int]]:
    """One value and one group per participant, and how many ratings a value is the mean of."""
    n = len(people.labels)
    own = np.zeros(n, dtype=np.intp)
    own[people.codes] = group.codes
    moved = np.unique(people.codes[own[people.codes] != group.codes]).tolist()
    if moved:
        found = listed((repr(people.labels[i]) for i in moved), len(moved))
        raise DuplicatedCells(f"participants in more than one group: {found}; use `within` for a factor within them")
    count: Counts = np.bincount(people.codes, minlength=n)
    if count.max() > 1 and aggregate is None:
        several = np.flatnonzero(count > 1).tolist()
        found = listed((f"{people.labels[i]!r} ({count[i]} values)" for i in several), len(several))
        raise DuplicatedCells(
            f"participants with several values: {found}; pass aggregate='mean' to average each participant's values"
        )
    return cell_means(y, people.codes, count), Coded(own, group.labels), (int(count.min()), int(count.max()))


def _split(factor: Hashable, y: Floats, group: Coded) -> list[Floats]:
    """The values of each group, sorted, without the missing ones."""
    order = np.lexsort((y, group.codes))
    kept = order[~np.isnan(y[order])]
    ends = np.searchsorted(group.codes[kept], np.arange(1, len(group.labels)))
    values = np.split(y[kept], ends)
    empty = [label for label, found in zip(group.labels, values, strict=True) if not len(found)]
    if empty:
        found = listed(map(repr, empty), len(empty))
        raise TooFew(f"no value is left in {factor!r} = {found}; take the group out or find its values")
    if all(len(found) == 1 for found in values):
        raise TooFew(f"every group of {factor!r} has one value; at least one needs two or more")
    return values
