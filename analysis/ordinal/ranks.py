"""Midranks in integers, and the rule that decides when two values are tied.

Written values are exact, computed ones have rounding errors: 0.3 and 0.30000000000000004 (0.1 + 0.2) are one value.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.statistics.doubles import ROUNDING_ULPS, Floats
from palpate.analysis.statistics.refusals import BadValue

Ints: TypeAlias = NDArray[np.int64]
Truths: TypeAlias = NDArray[np.bool_]
WRITTEN_DIGITS = 15  # so many decimal digits always survive a double, so what needs no more is what was written
WHOLE_END = 2.0**53  # up to here a double holds every whole number
LARGEST = 1e300  # differences of larger values leave the range of doubles


def refuse_huge(values: Floats) -> None:
    """Refuse values whose differences overflow double precision."""
    if float(np.abs(values).max()) > LARGEST:
        raise BadValue(f"values beyond {LARGEST:g}, whose differences no double holds; express them in a larger unit")


def rounding(values: Floats) -> Floats:
    """Return the possible rounding of a value of this size: 4 units in its last place."""
    allowed: Floats = ROUNDING_ULPS * np.spacing(np.abs(values))
    return allowed


def row_rounding(rows: Floats) -> Floats:
    """Return the possible rounding in each row of a matrix, by its largest value, in the matrix' shape."""
    largest: Floats = np.abs(rows).max(axis=1, keepdims=True)
    return np.broadcast_to(rounding(largest), rows.shape)


def doubled_ranks(rows: Floats, allowed: Floats, computed: bool | Truths = False) -> Ints:
    """Return twice the midranks (1 .. k) within each row of a matrix, which are integers even with ties.

    Neighbours in a sorted row are tied where they are equal, or differ by no more than the larger of their `allowed`
    (same shape) and not both are short decimals, which are as they were written, unless one of them was `computed`
    from numbers that are not (all of them, or an array of the same shape). Reversing the sign of all values reverses
    the ranks exactly.
    """
    order = np.argsort(rows, axis=1, kind="stable")
    values, room = np.take_along_axis(rows, order, 1), np.take_along_axis(allowed, order, 1)
    blurred = np.take_along_axis(np.broadcast_to(computed, rows.shape), order, 1)
    either = blurred[:, 1:] | blurred[:, :-1]
    tied = same_value(values[:, 1:], values[:, :-1], np.maximum(room[:, 1:], room[:, :-1]), either)
    # For each place of a sorted row: the first plus the last place of its group of tied neighbours.
    places = np.arange(tied.shape[1] + 1, dtype=np.int64)
    edge = np.zeros((len(tied), 1), dtype=bool)
    starts = np.where(np.hstack((edge, tied)), -1, places)
    ends = np.where(np.hstack((tied, edge)), len(places), places)
    first: Ints = np.maximum.accumulate(starts, axis=1)
    last: Ints = np.minimum.accumulate(ends[:, ::-1], axis=1)[:, ::-1]
    sums = (first + last) + 2
    ranks = np.empty_like(sums)
    np.put_along_axis(ranks, order, sums, 1)
    return ranks


def same_value(a: Floats, b: Floats, allowed: Floats, computed: bool | Truths = False) -> Truths:
    """Return where two arrays have the same values: equal, or different only by rounding.

    Two short decimals are the same only where they are equal.
    """
    gap: Floats = np.abs(a - b)
    same: Truths = gap == 0
    doubtful = (gap <= allowed) & ~same
    if doubtful.any():
        blurred = np.broadcast_to(computed, same.shape)[doubtful]
        same[doubtful] = blurred | ~(written(a[doubtful]) & written(b[doubtful]))
    return same


def written(values: Floats) -> Truths:
    """Return whether each value is an integer or a decimal of at most 15 digits, so without rounding by arithmetic."""
    return np.array(
        [
            float(f"{value:.{WRITTEN_DIGITS}g}") == value or (abs(value) <= WHOLE_END and value.is_integer())
            for value in values.tolist()
        ],
        dtype=bool,
    )
