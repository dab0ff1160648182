"""Distributions of values: summaries, densities, and places of points without overlap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.analysis.statistics.doubles import Floats

POINTS = 161
MOST_PLACED = 250
"""The number of points above which a swarm becomes a scatter within the density, which is faster and as clear."""


def swarm(values: Sequence[float], diameter: float, reach: float, *, one_sided: bool = False) -> list[float]:
    """Return the sideways offset of each point so that no two are nearer than `diameter` (in units of the values).

    Each point goes to the free place nearest to the middle, right before left; equal values keep their order. A swarm
    wider than `reach` is compressed. One-sided offsets are 0 or more. More than 250 points are scattered within their
    density instead, by a deterministic sequence.
    """
    order, aside = sorted(range(len(values)), key=lambda i: (values[i], i)), [0.0] * len(values)
    if len(values) > MOST_PLACED:
        # Places from van der Corput's sequence in base 2, as wide as the density of the values there.
        at, heights = density(values)
        for rank, i in enumerate(order):
            wide = float(np.interp(values[i], at, heights)) if len(at) else 1.0
            share = int(f"{rank + 1:020b}"[::-1], 2) / 2**20
            aside[i] = reach * wide * (share if one_sided else 2 * share - 1)
        return aside
    placed: list[tuple[float, float]] = []
    for i in order:
        near = [(v, a) for v, a in placed if values[i] - v < diameter]
        # The free place nearest to the middle, at which the point touches none of those near it.
        taken = [(a, float(np.sqrt(max(diameter**2 - (values[i] - v) ** 2, 0.0)))) for v, a in near]
        places = [0.0, *(a + sign * gap for a, gap in taken for sign in (1, -1))]
        slack = 1e-9 * diameter
        free = [p for p in places if all(abs(p - a) >= gap - slack for a, gap in taken) and not (one_sided and p < 0)]
        aside[i] = min(free, key=lambda p: (round(abs(p) / diameter, 6), p < 0))
        placed = [*near, (values[i], aside[i])]
    widest = max((abs(a) for a in aside), default=0.0)
    return [a * reach / widest for a in aside] if widest > reach else aside


def density(values: Sequence[float], least: float | None = None, most: float | None = None) -> tuple[Floats, Floats]:
    """Return a Gaussian kernel density over the values' range: places, and heights with a maximum of 1.

    Bandwidth 0.9 min(SD, IQR / 1.34) n^(-1/5) (Silverman 1986, eq. 3.31). Density below `least` or above `most`, which
    are the limits of possible values, is mirrored back. Fewer than three different values have no density: both arrays
    are empty.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    if len(np.unique(ordered)) < 3:
        return np.empty(0), np.empty(0)
    low, span = ordered[0], ordered[-1] - ordered[0]
    unit = (ordered - low) / span
    sd, quarter = float(np.std(unit, ddof=1)), float(np.subtract(*np.quantile(unit, [0.75, 0.25]))) / 1.34
    width: float = 0.9 * (min(sd, quarter) if quarter > 0 else sd) * len(unit) ** -0.2
    places = np.linspace(0.0, 1.0, POINTS)
    heights = _kernels(places, unit, width)
    for end in (least, most):
        if end is not None:
            heights += _kernels(2 * (end - low) / span - places, unit, width)
    return low + places * span, heights / heights.max()


def _kernels(places: Floats, unit: Floats, width: float) -> Floats:
    total: Floats = np.exp(-0.5 * ((places[:, None] - unit[None, :]) / width) ** 2).sum(axis=1)
    return total


def quartiles(values: Sequence[float]) -> tuple[float, float, float]:
    """Return lower quartile, median and upper quartile (Hyndman & Fan 1996, definition 7)."""
    given = np.asarray(values, dtype=np.float64)
    low, middle, high = (float(q) for q in np.quantile(given - given.min(), [0.25, 0.5, 0.75]) + given.min())
    return low, middle, high


def whiskers(values: Sequence[float]) -> tuple[float, float]:
    """Return the furthest values within 1.5 interquartile ranges of the box (Tukey 1977)."""
    low, _, high = quartiles(values)
    reach = 1.5 * (high - low)
    inside = [value for value in values if low - reach <= value <= high + reach]
    return min(inside), max(inside)


def summary(values: Sequence[float]) -> dict[str, float | int | None]:
    """Return n, mean, SD (n - 1; None for one value), minimum, quartiles and maximum of at least one value.

    The mean is computed from distances to the minimum, so that a large common offset costs no digits.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    above = ordered - ordered[0]
    low, middle, high = quartiles(values)
    sd = float(np.std(above, ddof=1)) if len(ordered) > 1 else None
    mean = float(ordered[0] + above.mean())
    ends = {"min": float(ordered[0]), "q1": low, "median": middle, "q3": high, "max": float(ordered[-1])}
    return {"n": len(ordered), "mean": mean, "sd": sd, **ends}
