"""Differences and sums of doubles with their rounding errors: pairs (high, low) with high + low exact.

Sources: D. Knuth, TAOCP 2, 4.2.2, theorem B (error-free sum); J. Shewchuk 1997 (exact sum, here `math.fsum`);
Ogita, Rump & Oishi 2005 (sums with carried errors).
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Pair: TypeAlias = tuple[Floats, Floats | None]  # no low part: every difference so far was exact
ROUNDING_ULPS = 4  # variation below so many units in the last place of the data says nothing
ROUNDING = ROUNDING_ULPS * 2.0**-53  # the same for values scaled into [0.5, 1)
FEW = 4096  # up to here one exact sum after the other beats vector operations


def scaled(values: Floats) -> tuple[Floats, int]:
    """Return the values divided by the power of two that brings the largest into [0.5, 1), and its exponent.

    The scaling is exact; it prevents that squares overflow or underflow, and that a unit of measurement changes F.
    """
    _, exponent = math.frexp(float(np.maximum.reduce(np.abs(values), axis=None)))
    return np.ldexp(values, -exponent), exponent


def rescaled(value: float, exponent: int) -> float:
    """Return value * 2**exponent, infinite only where the true product exceeds every double."""
    try:
        return math.ldexp(value, exponent)
    except OverflowError:
        return math.copysign(math.inf, value)


def difference(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return a - b rounded, and the rounding error, exactly."""
    high = a - b
    back = high - a
    return high, (a - (high - back)) - (b + back)


def differences(pair: Pair, axis: int) -> Pair:
    """Return every slice along an axis minus the first one."""
    high, low = pair
    first = (slice(None),) * axis + (slice(0, 1),)
    new, lost = difference(high, high[first])
    if low is not None:
        lost += low - low[first]
    return new, (lost if np.count_nonzero(lost) else None)


def row_sums(pair: Pair) -> Floats:
    """Return the sum of each row of a matrix, as if added without rounding and rounded once."""
    high, low = pair
    if high.size > FEW:
        low = np.zeros_like(high) if low is None else low
        while (width := high.shape[1]) > 1:
            half = width // 2
            total, lost = difference(high[:, :half], -high[:, half : 2 * half])
            lost += low[:, :half] + low[:, half : 2 * half]
            if width % 2:
                total = np.concatenate((total, high[:, -1:]), axis=1)
                lost = np.concatenate((lost, low[:, -1:]), axis=1)
            high, low = total, lost
        return high[:, 0] + low[:, 0]
    rows = high.tolist() if low is None else np.concatenate((high, low), axis=1).tolist()
    return np.array([math.fsum(row) for row in rows])


def centred(array: Floats, axis: int) -> Floats:
    """Return size * array - sum along an axis: the deviations from the mean times the size, exact on integers."""
    deviations: Floats = array.shape[axis] * array - np.add.reduce(array, axis, keepdims=True)
    return deviations


def sum_of_squares(array: Floats) -> float:
    """Return the sum of squares of all elements, summed pairwise in one fixed order."""
    flat = array.ravel()
    return float(np.add.reduce(flat * flat))


def deviation_ss(values: Floats) -> float:
    """Return the sum of squares about the mean of one sample, from differences from its first value."""
    high, low = differences((values, None), 0)
    deviations = centred(high if low is None else high + low, 0)
    return sum_of_squares(deviations) / len(values) ** 2


def exact_sum(values: Floats, pivot: float) -> Fraction:
    """Return the sum of the deviations from a data value, to twice the precision of a double."""
    terms = values.tolist()
    terms += [-pivot] * len(terms)
    high = math.fsum(terms)
    return Fraction(high) + Fraction(math.fsum([*terms, -high]))
