"""Observed over expected disagreement for many weightings of the units at once (one for each bootstrap draw).

With n values, m in a unit, and d a squared difference, alpha = 1 - (n - 1) sum_u D_u / (m_u - 1) / E, where D_u sums d
over the ordered pairs of values of unit u, and E over those of all values (Krippendorff 2011, part D).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from palpate.analysis.ordinal.ranks import refuse_huge, rounding, same_value
from palpate.analysis.statistics.doubles import ROUNDING, Floats, scaled
from palpate.analysis.statistics.refusals import BadValue

Weighted: TypeAlias = Callable[[Floats], Floats]
"""From weights (draws, units) to one alpha for each draw, NaN where no two values differ."""

LEVELS = ("nominal", "ordinal", "interval", "ratio")
BLOCK = 4_000_000


def disagreement_of(values: Floats, level: str) -> Weighted:
    """Alpha of an array (units, raters), each unit with two values or more, as a function of the units' weights.

    Raises BadValue for a value below 0 at level "ratio", and beyond 1e300 at any level but "interval".
    """
    if level == "interval":
        return _interval(values)
    counts, levels = _counts(values)
    if level == "nominal":
        return _nominal(counts)
    return _ordinal(counts) if level == "ordinal" else _ratio(counts, levels)


def _counts(values: Floats) -> tuple[Floats, Floats]:
    """How often each different value occurs in each unit, and the values; those only rounding apart are one."""
    units, _ = np.nonzero(~np.isnan(values))
    found, places = np.unique(values[~np.isnan(values)], return_inverse=True)
    refuse_huge(found)
    room = rounding(found)
    starts = np.append(True, ~same_value(found[1:], found[:-1], np.maximum(room[1:], room[:-1])))
    counts = np.zeros((len(values), int(starts.sum())))
    np.add.at(counts, (units, (np.cumsum(starts) - 1)[places]), 1.0)
    return counts, found[starts]


def _alpha(observed: Floats, expected: Floats, n: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(expected > 0, 1 - (n - 1) * observed / expected, np.nan)


def _nominal(counts: Floats) -> Weighted:
    m = counts.sum(axis=1)
    own = (m**2 - (counts**2).sum(axis=1)) / (m - 1)

    def alpha(w: Floats) -> Floats:
        n, of_value = w @ m, w @ counts
        return _alpha(w @ own, n**2 - (of_value**2).sum(axis=1), n)

    return alpha


def _interval(values: Floats) -> Weighted:
    """Sums of squares about means: a unit's own before anything is added up, so that an offset costs no digit."""
    x, _ = scaled(np.where(np.isnan(values), np.nanmax(values), values))
    given = ~np.isnan(values)
    x = x - x.flat[0]
    m = given.sum(axis=1).astype(np.float64)
    middle = np.where(given, x, 0).sum(axis=1) / m
    within = (np.where(given, x - middle[:, None], 0) ** 2).sum(axis=1)
    noise = values.size * ROUNDING**2

    def alpha(w: Floats) -> Floats:
        n = w @ m
        centre = (w @ (m * middle)) / n
        between = np.stack([np.dot(row * m, (middle - at) ** 2) for row, at in zip(w, centre, strict=True)])
        total = w @ within + between
        return _alpha(w @ (2 * m * within / (m - 1)), np.where(total > noise, 2 * n * total, 0), n)

    return alpha


def _ordinal(counts: Floats) -> Weighted:
    """An interval scale whose values are the mean ranks of all values that can be paired, anew for each draw."""
    m = counts.sum(axis=1)

    def alpha(w: Floats) -> Floats:
        n, of_value = w @ m, w @ counts
        rank = np.cumsum(of_value, axis=1) - of_value / 2 - n[:, None] / 2  # about their mean: multiples of 1/2
        square = rank**2
        own = m * (square @ counts.T) - (rank @ counts.T) ** 2  # exact: 0 where a unit's raters agree
        observed = (w * own / (m - 1)).sum(axis=1)
        return _alpha(2 * observed, 2 * n * (of_value * square).sum(axis=1), n)

    return alpha


def _ratio(counts: Floats, levels: Floats) -> Weighted:
    if levels[0] < 0:
        raise BadValue(f"the value {levels[0]:g} lies below 0; a ratio scale begins at 0: use level 'interval'")
    levels, _ = scaled(levels)  # so that no sum of two overflows
    m = counts.sum(axis=1)
    across = np.zeros((len(counts), len(counts)))
    for part in np.array_split(np.arange(len(levels)), max(1, len(levels) ** 2 // BLOCK)):
        a, b = levels[part][:, None], levels[None, :]
        with np.errstate(invalid="ignore"):
            squares = np.where(a == b, 0.0, (a - b) / (a + b)) ** 2
        across += counts[:, part] @ (squares @ counts.T)
    own = np.diag(across) / (m - 1)

    def alpha(w: Floats) -> Floats:
        return _alpha(w @ own, ((w @ across) * w).sum(axis=1), w @ m)

    return alpha
