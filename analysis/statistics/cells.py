"""Long tables to dense arrays: one value per participant and cell, groups of values, groups of participants.

Whatever does not fit is refused by name.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.analysis.statistics.columns import Coded, coded, numbers_of
from palpate.analysis.statistics.doubles import Floats, scaled
from palpate.analysis.statistics.refusals import (
    NO_SUBJECT,
    BadOption,
    BadValue,
    DuplicatedCells,
    IncompleteCells,
    TooFew,
    UnknownColumn,
    listed,
    refuse_idle,
    shown,
)
from palpate.protocols.wording import count

Missing: TypeAlias = Literal["raise", "listwise"]
Aggregate: TypeAlias = Literal["mean"] | None
Counts: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True)
class Cells:
    """One value per participant and cell: `values` has shape (participants, levels of factor 1, ...)."""

    values: Floats
    participants: list[Hashable]
    factors: list[Hashable]
    levels: list[list[Hashable]]
    dropped: list[Hashable] = field(default_factory=list)
    ratings_per_cell: tuple[int, int] = (1, 1)

    def attrs(self) -> dict[str, Any]:
        """Return the facts about the table that a result rests on: values per group, rows or participants left out."""
        facts = {"participants": len(self.participants), "dropped": self.dropped}
        return facts if self.ratings_per_cell == (1, 1) else facts | {"ratings_per_cell": self.ratings_per_cell}


@dataclass(frozen=True)
class _Grid:
    """Where each row of the long table belongs."""

    axes: list[Coded]
    names: list[Hashable]
    flat: Counts

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(axis.labels) for axis in self.axes)

    def described(self, cell: int, state: str = "") -> str:
        """Return a cell in words: who, in which state, at which levels."""
        where = np.unravel_index(cell, self.shape)
        labels = [axis.labels[int(i)] for axis, i in zip(self.axes, where, strict=True)]
        places = ", ".join(f"{n}={v!r}" for n, v in zip(self.names[1:], labels[1:], strict=True))
        return f"participant {labels[0]!r}{state}" + (f" at {places}" if places else "")


def gather(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable | Iterable[Hashable],
    subject: Hashable,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Cells:
    """Return the dense array of a long table, sorted by label, whatever the order of the rows.

    `missing="listwise"` leaves out participants without a value in every cell, `aggregate="mean"` averages several
    values of one participant in one cell (so also over factors that `within` leaves out).
    Raises UnknownColumn, BadValue, IncompleteCells, DuplicatedCells or BadOption.
    """
    factors = name_list(within)
    if not factors:
        raise BadOption("within names no factor; give the name of a column or a list of names")
    return gather_all(data, dv, factors, subject, missing, aggregate)


def gather_all(
    data: pd.DataFrame,
    dv: Hashable,
    factors: list[Hashable],
    subject: Hashable,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Cells:
    """Return `gather`, also with no factor at all: one value per participant."""
    check_options(missing, aggregate)
    names = [subject, *factors]
    check_columns(data, [dv, *names])
    y = numbers_of(data[dv], dv)
    axes = [coded(data[name], name) for name in names]
    shape = [len(axis.labels) for axis in axes]
    _refuse_sparse(shape, names, len(y))
    flat = axes[0].codes
    for axis in axes[1:]:
        flat = flat * len(axis.labels) + axis.codes
    values = np.full(math.prod(shape), np.nan)
    values[flat] = y
    # As many rows as cells and a number in each: then each cell has exactly one.
    if len(y) != values.size or np.count_nonzero(np.isnan(values)):
        return _repaired(y, _Grid(axes, names, flat), missing, aggregate)
    return Cells(values.reshape(shape), axes[0].labels, factors, [axis.labels for axis in axes[1:]])


def check_options(missing: object, aggregate: object) -> None:
    """Refuse unknown values of the two options that every test takes."""
    if not isinstance(missing, str) or missing not in ("raise", "listwise"):
        raise BadOption(f"missing={shown(missing)} is unknown: 'raise' or 'listwise'")
    if aggregate is not None and (not isinstance(aggregate, str) or aggregate != "mean"):
        raise BadOption(f"aggregate={shown(aggregate)} is unknown: None or 'mean'")


def name_list(names: Hashable | Iterable[Hashable]) -> list[Hashable]:
    """Return one column name or several as a list."""
    if isinstance(names, str | bytes | tuple) or not isinstance(names, Iterable):
        return list(names) if isinstance(names, tuple) else [names]
    return list(names)


def check_columns(data: pd.DataFrame, names: Sequence[Hashable]) -> None:
    """Refuse a table without one of these columns, with two of the same name, or a name that is used twice."""
    if not isinstance(data, pd.DataFrame):
        raise UnknownColumn(f"data is a {type(data).__name__}; expected a pandas DataFrame in long form")
    columns: Counter[Hashable] = Counter(data.columns.tolist())
    for i, name in enumerate(names):
        if name is None or not isinstance(name, Hashable) or name not in columns:
            known = ", ".join(map(repr, columns))
            raise UnknownColumn(f"the table has no column {name!r}; its columns are {known}")
        if name in names[:i]:
            raise UnknownColumn(f"column {name!r} is named twice; dv, subject and factors must be different columns")
        if columns[name] > 1:
            raise UnknownColumn(f"the table has two columns of the same name, {name!r}; rename or drop one")
    if len(data) == 0:
        raise BadValue("the table has no rows")


def _refuse_sparse(sizes: list[int], names: list[Hashable], rows: int) -> None:
    """Refuse a table that would need far more cells than it has rows: a wrong column, not a design with gaps."""
    if math.prod(sizes) <= max(1_000_000, 16 * rows):
        return
    sizes_by_name = " x ".join(f"{size:,} {name!r}" for size, name in zip(sizes, names, strict=True))
    raise IncompleteCells(
        f"{sizes_by_name} make {math.prod(sizes):,} cells, the table has {rows:,} rows; check the columns"
    )


def _repaired(y: Floats, grid: _Grid, missing: Missing, aggregate: Aggregate) -> Cells:
    """Return the array of a table with gaps or repetitions, as `missing` and `aggregate` say."""
    size = math.prod(grid.shape)
    count = np.bincount(grid.flat, minlength=size)
    if count.max(initial=0) > 1 and aggregate is None:
        cells = np.flatnonzero(count > 1)
        repeated = listed((grid.described(int(cell)) for cell in cells), len(cells))
        raise DuplicatedCells(
            f"several values in one cell: {repeated}; name every repeated factor in `within`, "
            "or pass aggregate='mean' to average them"
        )
    values = cell_means(y, grid.flat, count).reshape(grid.shape)
    complete = np.asarray(np.isfinite(values).reshape(len(values), -1).all(axis=1))
    if not complete.all() and missing == "raise":
        _refuse_gaps(grid, np.flatnonzero(np.isnan(values.ravel())))
    counts = count.reshape(len(values), -1)[complete]
    if not counts.size:
        raise IncompleteCells("no participant has a value in every cell; nothing is left after listwise deletion")
    people = [(label, bool(whole)) for label, whole in zip(grid.axes[0].labels, complete, strict=True)]
    return Cells(
        values[complete],
        [label for label, whole in people if whole],
        grid.names[1:],
        [axis.labels for axis in grid.axes[1:]],
        [label for label, whole in people if not whole],
        (int(counts.min()), int(counts.max())),
    )


def cell_means(y: Floats, flat: Counts, count: Counts) -> Floats:
    """Return the mean of each cell, NaN for a missing value or none; the same for every order of the rows."""
    if count.max(initial=0) <= 1:
        values = np.full(len(count), np.nan)
        values[flat] = y
        return values
    small, exponent = scaled(np.nan_to_num(y))
    listed_values = np.where(np.isnan(y), np.nan, small)[np.argsort(flat, kind="stable")].tolist()
    ends = np.cumsum(count).tolist()
    means = [math.fsum(values) / len(values) if values else math.nan for values in _runs(listed_values, ends)]
    result: Floats = np.ldexp(np.array(means), exponent)
    return result


def _runs(values: list[float], ends: list[int]) -> Iterator[list[float]]:
    for start, end in zip([0, *ends], ends, strict=False):
        yield values[start:end]


def _refuse_gaps(grid: _Grid, cells: Counts) -> None:
    gaps = listed((grid.described(int(cell), " has no value") for cell in cells), len(cells))
    raise IncompleteCells(
        f"{gaps}; {len(cells)} {'cell' if len(cells) == 1 else 'cells'} missing in all; "
        "pass missing='listwise' to leave such participants out"
    )


@dataclass(frozen=True)
class Groups:
    """The values of each group, each sorted (so that no result depends on the order of rows)."""

    factor: Hashable
    labels: list[Hashable]
    values: list[Floats]
    dropped: list[Hashable] = field(default_factory=list)
    ratings_per_value: tuple[int, int] = (1, 1)

    def attrs(self) -> dict[str, Any]:
        """Return the facts about the table that a result rests on: values per group, rows or participants left out."""
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
    return Groups(factor, group.labels, _split(factor, y, group), dropped, ratings)


def _per_participant(
    y: Floats, group: Coded, people: Coded, aggregate: Aggregate
) -> tuple[Floats, Coded, tuple[int, int]]:
    """Return one value and one group per participant, and how many ratings a value is the mean of."""
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


def _split(factor: Hashable, y: Floats, group: Coded) -> list[Floats]:
    """Return the values of each group, sorted, without the missing ones."""
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
        """Return each group in words: its level of every factor."""
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
