"""Labels of participants and conditions to codes, in an order that depends neither on rows nor on label types."""

from __future__ import annotations

import math
import re
from collections.abc import Hashable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.statistics.refusals import BadValue, listed

Codes: TypeAlias = NDArray[np.intp]

FEW = 4096  # rows up to which a dict beats pandas' hash table
PLAIN = frozenset({int, str})
_digits = re.compile(r"(\d+)")


class Coded(NamedTuple):
    """One code a row, and the label of each code."""

    codes: Codes
    labels: list[Hashable]


def coded(column: pd.Series[Any], name: Hashable) -> Coded:
    """Code a column of labels: equal labels share a code, codes follow `ordered`, levels without a row do not count.

    Raises BadValue where a row has no label (None, NaN, NA, NaT) or one that cannot be compared.
    """
    if len(column) > FEW and column.dtype != object:
        return _coded_by_pandas(column, name)
    values = column.tolist()
    kinds = set(map(type, values))
    if not kinds <= PLAIN:
        _refuse_missing([i for i, value in enumerate(values) if _missing(value)], name)
    if bool in kinds and len(kinds) > 1:
        return _coded_apart(values)
    try:
        labels = ordered(list(set(values)))
    except TypeError:
        raise BadValue(f"column {name!r} holds labels that cannot be compared (such as lists); use text") from None
    code = {label: i for i, label in enumerate(labels)}
    return Coded(np.array([code[value] for value in values], dtype=np.intp), labels)


def ordered(labels: Sequence[Hashable]) -> list[Hashable]:
    """Labels in natural order (2 before 10, also within text), the same for 2 and "2"."""
    if set(map(type, labels)) == {int}:
        return sorted(labels)  # type: ignore[type-var]
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


def _coded_by_pandas(column: pd.Series[Any], name: Hashable) -> Coded:
    codes, uniques = pd.factorize(column)
    _refuse_missing(np.flatnonzero(codes < 0).tolist(), name)
    found = list(uniques.tolist())
    labels = ordered(found)
    rank = {label: i for i, label in enumerate(labels)}
    order = np.array([rank[label] for label in found], dtype=np.intp)
    return Coded(order[codes], labels)


def _coded_apart(values: list[Any]) -> Coded:
    """Code labels where True and 1 both occur: Python takes them for equal, a reader does not."""
    keys = [(isinstance(value, bool), value) for value in values]
    unique = sorted(set(keys), key=lambda key: _natural(key[1]))
    code = {key: i for i, key in enumerate(unique)}
    return Coded(np.array([code[key] for key in keys], dtype=np.intp), [label for _, label in unique])


def _missing(value: Any) -> bool:
    return value is None or value is pd.NA or value is pd.NaT or (isinstance(value, float) and math.isnan(value))


def _refuse_missing(rows: list[int], name: Hashable) -> None:
    if rows:
        where = listed((f"row {row + 1}" for row in rows), len(rows))
        raise BadValue(f"column {name!r} has no label in {where}; name every row or take these rows out")
