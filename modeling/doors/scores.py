"""How wrong predictions are: the measures of thesis 5.5.3."""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array


def mae(actual: Array, predicted: Array) -> float:
    """Return the mean absolute difference (equation 5.5)."""
    return float(np.mean(np.abs(predicted - actual)))


def rmse(actual: Array, predicted: Array) -> float:
    """Return the root mean square difference (equation 5.6)."""
    return float(np.sqrt(np.mean((predicted - actual) ** 2)))


def r2(actual: Array, predicted: Array) -> float | None:
    """1 - residual over total sum of squares around each column's mean (equation 5.7); None where nothing varies."""
    total = float(np.sum((actual - actual.mean(axis=0)) ** 2))
    if total <= 1e-12 * actual.size:
        return None
    return 1.0 - float(np.sum((predicted - actual) ** 2)) / total


def by_level(levels: tuple[str, ...]) -> dict[str, list[int]]:
    """Return the rows of each level, in the order in which the levels first come."""
    rows: dict[str, list[int]] = {}
    for row, level in enumerate(levels):
        rows.setdefault(level, []).append(row)
    return rows
