"""Columns of a table as numbers and as coded labels.

What a double cannot hold is refused by name, never rounded silently; the order of labels depends neither on the order
of rows nor on the labels' types.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Collection, Hashable, Iterable, Iterator
from decimal import Decimal
from numbers import Integral, Number, Real
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pandas.api.types import infer_dtype, is_scalar

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadValue, listed

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
    """Return a column as doubles, NaN where it has no value; a fraction or a long double becomes the nearest double.

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
    """Return the nearest double, NaN for no value; or what is wrong with the value."""
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
    """Return a value as it is written, cut where it is very long; Python writes no integer of more than 4300 digits."""
    try:
        text = repr(value)
    except ValueError:
        return f"an enormous {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


class Coded(NamedTuple):
    """One code a row, and the label of each code."""

    codes: Codes
    labels: list[Hashable]


def coded(column: pd.Series[Any], name: Hashable) -> Coded:
    """Code a column of labels: equal labels share a code, codes follow `ordered`, levels without a row do not count.

    Raises BadValue where a row has no label (None, NA, NaT, a NaN of any type), where labels cannot be compared, and
    where different labels read the same: 1 and "1", True and 1.
    """
    if len(column) > FEW and (column.dtype != object or infer_dtype(column, skipna=False) in ("string", "integer")):
        return _coded_by_pandas(column, name)
    values = column.tolist()
    labels = ordered(_distinct(values, name))
    code = {label: i for i, label in enumerate(labels)}
    return Coded(np.fromiter(map(code.__getitem__, values), np.intp, len(values)), labels)


def _distinct(values: list[Any], name: Hashable) -> Collection[Hashable]:
    """Return the different labels among the values of a column, each a label that reads like no other."""
    if set(map(type, values)) in PLAIN:
        return set(values)
    _refuse_missing([i for i, value in enumerate(values) if _missing(value)], name)
    try:
        typed_labels = {(type(value), value) for value in values}
    except TypeError:
        raise BadValue(f"column {name!r} holds labels that cannot be compared (such as lists); use text") from None
    labels = [label for _, label in sorted(typed_labels, key=lambda typed: typed[0].__name__)]
    # Refuse different labels that a reader, or the next program to read the table, takes for the same.
    seen: dict[str, Any] = {}
    for label in labels:
        for text in _readings(label):
            twin = seen.setdefault(text, label)
            if len({twin, label}) > 1 or isinstance(twin, Truth) != isinstance(label, Truth):
                both = " and ".join(sorted((repr(twin), repr(label)), reverse=True))
                raise BadValue(f"{both} both occur in column {name!r}; make the column one type")
    return dict.fromkeys(labels)  # of 1 and 1.0, which are one label, always the same one stays


def ordered(labels: Collection[Any]) -> list[Hashable]:
    """Return labels in natural order (2 before 10, also within text), the same for 2 and "2"."""
    kinds = set(map(type, labels))
    if kinds == {int} or (kinds == {str} and _read_alike(labels)):
        return sorted(labels)
    if kinds == {str} and all(map(str.isdecimal, labels)):
        return sorted(labels, key=lambda text: (int(text), text))
    return sorted(labels, key=_natural)


def _read_alike(texts: Iterable[str]) -> bool:
    """Return whether texts begin with a letter and differ only in digits: their plain order is the natural one.

    A number could begin with a digit, a sign, a point or a space, and 1e5 and 9e4 would then stand the wrong way round.
    """
    shapes = {text.translate(ALIKE) for text in texts}
    return len(shapes) == 1 and shapes.pop()[:1].isalpha()


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


def _coded_by_pandas(column: pd.Series[Any], name: Hashable) -> Coded:
    codes, uniques = pd.factorize(column)
    _refuse_missing(np.flatnonzero(codes < 0).tolist(), name)
    distinct = uniques.tolist()
    labels = ordered(_distinct(distinct, name))
    rank = {label: i for i, label in enumerate(labels)}
    order = np.array([rank[label] for label in distinct], dtype=np.intp)
    return Coded(order[codes], labels)


def _missing(value: Any) -> bool:
    """Return whether this stands for no label: None, NA, NaT, and every NaN, which is not equal to itself."""
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


def _readings(label: Any) -> Iterator[str]:
    """Yield the texts that a label may be written as: 1.0 also as "1", True also as "1"."""
    yield str(label)
    if _whole(label):
        yield str(int(label))


def _whole(label: Any) -> bool:
    return isinstance(label, Integral | Truth) or (isinstance(label, Real) and label not in ENDS and label % 1 == 0)
