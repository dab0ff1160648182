"""Ranks with ties, where answers that differ only by rounding (0.1 + 0.2 and 0.3) are ties."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.statistics.doubles import ROUNDING, Floats


def levelled(values: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """The different values in order, and which of them each value is; NaN is not allowed.

    Neighbours within four units in the last place of the larger are one value, unless both are whole numbers.
    """
    found, places = np.unique(values, return_inverse=True)
    low, high = found[:-1], found[1:]
    near = high - low <= ROUNDING * np.maximum(np.abs(low), np.abs(high))
    near &= (low % 1 != 0) | (high % 1 != 0)
    starts = np.concatenate(([True], ~near))
    return found[starts], (np.cumsum(starts) - 1)[places.reshape(values.shape)]


def doubled_ranks(values: Floats) -> NDArray[np.int64]:
    """Twice the rank of each value from 1 to n, ties sharing the mean of their ranks: whole numbers throughout."""
    _, level = levelled(values)
    count = np.bincount(level)
    below = np.cumsum(count) - count
    ranks: NDArray[np.int64] = (2 * below + count + 1)[level].astype(np.int64)
    return ranks
