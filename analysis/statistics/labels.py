"""Labels of participants and conditions to codes, in an order that depends neither on rows nor on label types."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Collection, Hashable, Iterable, Iterator
from numbers import Integral, Number, Real
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pandas.api.types import infer_dtype, is_scalar

from palpate.analysis.statistics.refusals import BadValue, listed

Codes: TypeAlias = NDArray[np.intp]

FEW = 4096  # rows up to which a dict beats pandas' hash table
PLAIN = ({int}, {str})  # columns of one of these types have a label in every row, and different labels read differently
Truth = bool | np.bool_
ENDS = (math.inf, -math.inf)
ALIKE = str.maketrans("123456789", "000000000")
_digits = re.compile(r"(\d+)")


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
    """The different labels among the values of a column, each found to be a label and to read like no other."""
    if set(map(type, values)) in PLAIN:
        return set(values)
    _refuse_missing([i for i, value in enumerate(values) if _missing(value)], name)
    try:
        found = {(type(value), value) for value in values}
    except TypeError:
        raise BadValue(f"column {name!r} holds labels that cannot be compared (such as lists); use text") from None
    labels = [label for _, label in sorted(found, key=lambda typed: typed[0].__name__)]
    _refuse_twins(labels, name)
    return dict.fromkeys(labels)  # of 1 and 1.0, which are one label, always the same one stays


def ordered(labels: Collection[Any]) -> list[Hashable]:
    """Labels in natural order (2 before 10, also within text), the same for 2 and "2"."""
    kinds = set(map(type, labels))
    if kinds == {int} or (kinds == {str} and _read_alike(labels)):
        return sorted(labels)
    if kinds == {str} and all(map(str.isdecimal, labels)):
        return sorted(labels, key=lambda text: (int(text), text))
    return sorted(labels, key=_natural)


def _read_alike(texts: Iterable[str]) -> bool:
    """Whether texts begin with a letter and differ only in digits ("P001", "P010"): their plain order is the natural.

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
    found = uniques.tolist()
    labels = ordered(_distinct(found, name))
    rank = {label: i for i, label in enumerate(labels)}
    order = np.array([rank[label] for label in found], dtype=np.intp)
    return Coded(order[codes], labels)


def _missing(value: Any) -> bool:
    """Whether this stands for no label: None, NA, NaT, and every NaN, the one thing that is not equal to itself."""
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


def _refuse_twins(labels: Iterable[Any], name: Hashable) -> None:
    """Refuse different labels that a reader, or the next program to read the table, takes for the same."""
    seen: dict[str, Any] = {}
    for label in labels:
        for text in _readings(label):
            twin = seen.setdefault(text, label)
            if len({twin, label}) > 1 or isinstance(twin, Truth) != isinstance(label, Truth):
                both = " and ".join(sorted((repr(twin), repr(label)), reverse=True))
                raise BadValue(f"{both} both occur in column {name!r}; make the column one type")


def _readings(label: Any) -> Iterator[str]:
    """The texts that a label may be written as: 1.0 also as "1", True also as "1"."""
    yield str(label)
    if _whole(label):
        yield str(int(label))


def _whole(label: Any) -> bool:
    return isinstance(label, Integral | Truth) or (isinstance(label, Real) and label not in ENDS and label % 1 == 0)
