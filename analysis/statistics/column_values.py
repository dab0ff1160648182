"""A column of ratings to doubles; what a double cannot hold is refused by name, never rounded without a word."""

from __future__ import annotations

import math
from collections.abc import Hashable
from decimal import Decimal
from numbers import Integral, Real
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadValue, listed

INTEGERS_END = 2**53  # from here on a double does not hold every integer

NOT_A_NUMBER = "must hold finite numbers; found {found}; correct these rows or take them out"
DECIMAL = "holds Decimal numbers; found {found}; convert with astype(float)"
ROUNDED = "holds numbers beyond 2**53, which a double rounds; found {found}; subtract a constant first"


def numbers_of(column: pd.Series[Any], name: Hashable) -> Floats:
    """A column as doubles, NaN where it has no value; a fraction or a long double becomes the nearest double.

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
    found = [_double(value) for value in values]
    complaints = [complaint for complaint in found if isinstance(complaint, str)]
    if complaints:
        rows = [row for row, complaint in enumerate(found) if complaint == complaints[0]]
        where = listed((f"{_brief(values[row])} in row {row + 1}" for row in rows), len(rows))
        raise BadValue(f"column {name!r} " + complaints[0].format(found=where))
    return np.array(found, dtype=np.float64)


def _double(value: Any) -> float | str:
    """The nearest double, NaN for no value; or what is wrong with the value."""
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
    """A value as it is written, cut where it is very long; Python writes no integer of more than 4300 digits."""
    try:
        text = repr(value)
    except ValueError:
        return f"an enormous {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."
