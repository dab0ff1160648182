"""Mean squares of a complete table of rows by columns, without loss where offsets are huge."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.analysis.statistics.doubles import ROUNDING, Floats, Pair, differences, scaled
from palpate.analysis.statistics.within import component


@dataclass(frozen=True)
class MeanSquares:
    """Of n rows by k columns: between rows, between columns, residual, and within rows, each over its df.

    In units of a power of two squared, so that no square overflows: ratios are what they are for. A mean square that
    only the rounding of the data makes is 0.
    """

    rows: float
    columns: float
    residual: float
    within: float
    n: int
    k: int
    exponent: int


def mean_squares(values: Floats) -> MeanSquares:
    """The two-way decomposition of an array (rows, columns), each at least 2 (Shrout & Fleiss 1979, table 3)."""
    n, k = values.shape
    x, exponent = scaled(values)
    plain: Pair = (x, None)
    by_row = differences(plain, 0)
    noise = x.size * ROUNDING**2
    sums = (component(by_row, (0,), 0)[1], component(plain, (1,))[1], component(by_row, (0, 1), 0)[1])
    rows, columns, residual = (ss if ss > noise else 0.0 for ss in sums)
    free = (n - 1) * (k - 1)
    return MeanSquares(
        rows / (n - 1), columns / (k - 1), residual / free, (columns + residual) / (n * (k - 1)), n, k, exponent
    )
