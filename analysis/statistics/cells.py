"""Long tables to dense arrays: columns as numbers and as coded labels, one value per participant and cell.

Values that a double cannot represent are refused, never rounded silently; the order of labels depends neither on the
order of rows nor on the labels' types. Groups of values and of participants are in `groups`.
"""

from __future__ import annotations

import math
import operator
import re
from collections import Counter
from collections.abc import Collection, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from numbers import Integral, Number, Real
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pandas.api.types import infer_dtype, is_scalar

from palpate.analysis.statistics.doubles import Floats, scaled
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    DuplicatedCells,
    IncompleteCells,
    UnknownColumn,
    listed,
    shown,
)

Missing: TypeAlias = Literal["raise", "listwise"]
Aggregate: TypeAlias = Literal["mean"] | None
Counts: TypeAlias = NDArray[np.intp]
INTEGERS_END = 2**53  # from here on a double does not hold every integer
NOT_A_NUMBER = "must hold finite numbers; found {found}; correct these rows or take them out"
DECIMAL = "holds Decimal numbers; found {found}; convert with astype(float)"
ROUNDED = "holds numbers beyond 2**53, which a double rounds; found {found}; subtract a constant first"
Codes: TypeAlias = NDArray[np.intp]
FEW = 4096  # rows up to which a dict beats pandas' hash table
PLAIN = ({int}, {str})  # columns of one of these types have a label in every row, and different labels read differently
Truth = bool | np.bool_
ENDS = (math.inf, -math.inf)
ALIKE = str.maketrans("123456789", "000000000")
_digits = re.compile(r"(\d+)")


def numbers_of(column: pd.Series[Any], name: Hashable) -> Floats:
    """Return a column as doubles, NaN for missing values; a fraction or a long double becomes the nearest double.

    Raises BadValue for text, infinities, Decimal numbers and integers that a double would round.
    """
    raw = column.to_numpy() if isinstance(column.dtype, np.dtype) else None
    if raw is None or raw.dtype.kind not in "fiub" or raw.dtype.itemsize > 8:
        return _one_by_one(column.tolist(), name)
    values: Floats = raw.astype(np.float64)
    if raw.dtype.kind in "iu" and raw.size and np.abs(values).max() >= INTEGERS_END:
        return _one_by_one(column.tolist(), name)
    if raw.dtype.kind == "f" and np.count_nonzero(np.isinf(values)):
        return _one_by_one(column.tolist(), name)
    return values


def _one_by_one(values: list[Any], name: Hashable) -> Floats:
    doubles = [_double(value) for value in values]
    complaints = [complaint for complaint in doubles if isinstance(complaint, str)]
    if complaints:
        rows = [row for row, complaint in enumerate(doubles) if complaint == complaints[0]]
        where = listed((f"{_brief(values[row])} in row {row + 1}" for row in rows), len(rows))
        raise BadValue(f"column {name!r} " + complaints[0].format(found=where))
    return np.array(doubles, dtype=np.float64)


def _double(value: Any) -> float | str:
    """Return the nearest double, NaN for a missing value, or what is wrong with the value."""
    if value is None or value is pd.NA:
        return math.nan
    if not isinstance(value, Real):
        return DECIMAL if isinstance(value, Decimal) else NOT_A_NUMBER
    whole: Any = int(value) if isinstance(value, Integral) else value  # NumPy would compare as doubles
    try:
        double = float(whole)
    except OverflowError:
        return ROUNDED
    if math.isinf(double):
        return NOT_A_NUMBER if whole == double else ROUNDED
    return ROUNDED if double != whole and whole % 1 == 0 else double


def _brief(value: Any) -> str:
    """Return a value as text, cut if it is very long; Python prints no integer of more than 4300 digits."""
    try:
        text = repr(value)
    except ValueError:
        return f"an enormous {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


class Coded(NamedTuple):
    """One code per row, and the label of each code."""

    codes: Codes
    labels: list[Hashable]


def coded(column: pd.Series[Any], name: Hashable) -> Coded:
    """Return codes of a column of labels: equal labels share a code, codes follow `ordered`, unused levels do not
    count.

    Raises BadValue for a row without a label (None, NA, NaT, a NaN of any type), labels that cannot be compared, and
    different labels with the same text: 1 and "1", True and 1.
    """
    if len(column) > FEW and (column.dtype != object or infer_dtype(column, skipna=False) in ("string", "integer")):
        codes, uniques = pd.factorize(column)
        _refuse_missing(np.flatnonzero(codes < 0).tolist(), name)
        distinct = uniques.tolist()
        labels = ordered(_distinct(distinct, name))
        rank = {label: i for i, label in enumerate(labels)}
        order = np.array([rank[label] for label in distinct], dtype=np.intp)
        return Coded(order[codes], labels)
    values = column.tolist()
    labels = ordered(_distinct(values, name))
    code = {label: i for i, label in enumerate(labels)}
    return Coded(np.fromiter(map(code.__getitem__, values), np.intp, len(values)), labels)


def _distinct(values: list[Any], name: Hashable) -> Collection[Hashable]:
    """Return the different labels in a column. Raises BadValue for labels with the same text."""
    if set(map(type, values)) in PLAIN:
        return set(values)
    _refuse_missing([i for i, value in enumerate(values) if _missing(value)], name)
    try:
        typed_labels = {(type(value), value) for value in values}
    except TypeError:
        raise BadValue(f"column {name!r} holds labels that cannot be compared (such as lists); use text") from None
    labels = [label for _, label in sorted(typed_labels, key=lambda typed: typed[0].__name__)]
    # Different labels that a reader, or the next program to read the table, takes for the same are refused.
    seen: dict[str, Any] = {}
    for label in labels:
        is_whole = isinstance(label, Integral | Truth) or (
            isinstance(label, Real) and label not in ENDS and label % 1 == 0
        )
        # A whole number is also compared by its digits alone, since 1.0 and True may be written as "1".
        for text in (str(label), str(int(label))) if is_whole else (str(label),):
            twin = seen.setdefault(text, label)
            if len({twin, label}) > 1 or isinstance(twin, Truth) != isinstance(label, Truth):
                both = " and ".join(sorted((repr(twin), repr(label)), reverse=True))
                raise BadValue(f"{both} both occur in column {name!r}; make the column one type")
    return dict.fromkeys(labels)  # of 1 and 1.0, which are one label, always the same one stays


def ordered(labels: Collection[Any]) -> list[Hashable]:
    """Return labels in natural order (2 before 10, also within text), the same for 2 and "2"."""
    kinds = set(map(type, labels))
    if kinds == {int}:
        return sorted(labels)
    # Texts that begin with a letter and differ only in digits: their plain order is the natural one. A number could
    # begin with a digit, a sign, a point or a space, and 1e5 and 9e4 would then stand the wrong way round.
    shapes = {text.translate(ALIKE) for text in labels} if kinds == {str} else set()
    if len(shapes) == 1 and shapes.pop()[:1].isalpha():
        return sorted(labels)
    if kinds == {str} and all(map(str.isdecimal, labels)):
        return sorted(labels, key=lambda text: (int(text), text))
    return sorted(labels, key=_natural)


def _natural(label: Hashable) -> tuple[Any, ...]:
    text = str(label)
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    parts = _digits.split(text)
    parts[1::2] = map(int, parts[1::2])
    tail = (parts, text, type(label).__name__)
    return (0, number, *tail) if math.isfinite(number) else (1, 0.0, *tail)


def _missing(value: Any) -> bool:
    """Return whether a value is no label: None, NA, NaT, or any NaN, which is not equal to itself."""
    if value is None or value is pd.NA:
        return True
    try:
        return bool(operator.ne(value, value)) or (is_scalar(value) and bool(pd.isna(value)))
    except (
        TypeError,
        ValueError,
        ArithmeticError,
    ):  # arrays compare by element; a signalling NaN compares with nothing
        return isinstance(value, Number)


def _refuse_missing(rows: list[int], name: Hashable) -> None:
    if rows:
        where = listed((f"row {row + 1}" for row in rows), len(rows))
        raise BadValue(f"column {name!r} has no label in {where}; name every row or take these rows out")


@dataclass(frozen=True)
class Cells:
    """One value per participant and cell: `values` has the shape (participants, levels of factor 1, ...)."""

    values: Floats
    participants: list[Hashable]
    factors: list[Hashable]
    levels: list[list[Hashable]]
    dropped: list[Hashable] = field(default_factory=list)
    ratings_per_cell: tuple[int, int] = (1, 1)

    def attrs(self) -> dict[str, Any]:
        """Return the facts about the table that qualify a result: values per group, rows or participants left out."""
        facts = {"participants": len(self.participants), "dropped": self.dropped}
        return facts if self.ratings_per_cell == (1, 1) else facts | {"ratings_per_cell": self.ratings_per_cell}


@dataclass(frozen=True)
class _Grid:
    """The cell of each row of the long table."""

    axes: list[Coded]
    names: list[Hashable]
    flat: Counts

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(axis.labels) for axis in self.axes)

    def described(self, cell: int, state: str = "") -> str:
        """Return a description of a cell: participant, state, levels."""
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
    """Return the dense array of a long table, sorted by label, independent of the order of the rows.

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
    """Return the dense array of a long table as `gather` does; `factors` may be empty: then one value per participant.

    Raises what `gather` raises.
    """
    check_options(missing, aggregate)
    names = [subject, *factors]
    check_columns(data, [dv, *names])
    y = numbers_of(data[dv], dv)
    axes = [coded(data[name], name) for name in names]
    shape = [len(axis.labels) for axis in axes]
    if math.prod(shape) > max(1_000_000, 16 * len(y)):  # a wrong column, not a design with gaps
        sizes_by_name = " x ".join(f"{size:,} {name!r}" for size, name in zip(shape, names, strict=True))
        raise IncompleteCells(
            f"{sizes_by_name} make {math.prod(shape):,} cells, the table has {len(y):,} rows; check the columns"
        )
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
    """Raise BadOption for unknown values of the two options that every test has."""
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
    """Raise UnknownColumn for a missing or duplicate column, or a name that is used twice."""
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


def _repaired(y: Floats, grid: _Grid, missing: Missing, aggregate: Aggregate) -> Cells:
    """Return the array of a table with gaps or repetitions, as specified by `missing` and `aggregate`."""
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
        cells = np.flatnonzero(np.isnan(values.ravel()))
        gaps = listed((grid.described(int(cell), " has no value") for cell in cells), len(cells))
        raise IncompleteCells(
            f"{gaps}; {len(cells)} {'cell' if len(cells) == 1 else 'cells'} missing in all; "
            "pass missing='listwise' to leave such participants out"
        )
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
    """Return the mean of each cell, NaN if a value is missing or there is none, independent of the order of rows."""
    if count.max(initial=0) <= 1:
        values = np.full(len(count), np.nan)
        values[flat] = y
        return values
    small, exponent = scaled(np.nan_to_num(y))
    listed_values = np.where(np.isnan(y), np.nan, small)[np.argsort(flat, kind="stable")].tolist()
    ends = np.cumsum(count).tolist()
    runs = [listed_values[start:end] for start, end in zip([0, *ends], ends, strict=False)]
    means = [math.fsum(values) / len(values) if values else math.nan for values in runs]
    result: Floats = np.ldexp(np.array(means), exponent)
    return result
