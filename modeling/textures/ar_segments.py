"""Cutting a recording where its spectrum or level changes, by minimum description length (Davis et al. 2006).

The cost of a cut is that of AutoPARM: what it takes to tell the borders, each stretch's order, its coefficients, and
the samples that they leave unexplained. AutoPARM searches with a genetic algorithm; here borders lie on a grid, so the
best cut of all is found by dynamic programming.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal.windows import hann

from palpate.signals.arrays import Array

STEP = 25
"""Samples between places where a border may lie."""
SHORTEST, LONGEST = 4, 80
"""Steps of a stretch: 0.1 s to 2 s."""
HIGHEST = 20
"""Order that a stretch's cost is looked at with."""
LEAST = 1e-20
"""Power, relative to the whole recording's, below which a stretch is silent."""


@dataclass(frozen=True)
class Stretch:
    """Samples [start, stop) whose spectrum hardly changes."""

    start: int
    stop: int


def segmented(acceleration: Array, parts: Sequence[tuple[int, int]]) -> tuple[Stretch, ...]:
    """The stretches of least description length within each part [start, stop); all of it where it is short."""
    floor = LEAST * float(np.mean([np.mean(acceleration[a:b] ** 2) for a, b in parts])) + np.finfo(float).tiny
    found: list[Stretch] = []
    total = sum(b - a for a, b in parts)
    for start, stop in parts:
        borders = _borders(acceleration[start:stop], floor, total)
        edges = [start, *(start + STEP * each for each in borders), stop]
        found += [Stretch(a, b) for a, b in pairwise(edges)]
    return tuple(found)


def _borders(samples: Array, floor: float, total: int) -> list[int]:
    """The inner borders of one part, in steps."""
    lags = _lags(samples)
    count = len(lags)
    if count < 2 * SHORTEST:
        return []
    costs = _costs(lags, floor, total)
    best, last = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=int)
    best[0] = 0
    for stop in range(SHORTEST, count + 1):
        starts = np.arange(max(0, stop - LONGEST), stop - SHORTEST + 1)
        all_costs = best[starts] + costs[stop - starts, starts]
        last[stop] = starts[all_costs.argmin()]
        best[stop] = all_costs.min()
    borders: list[int] = []
    place = int(last[count])
    while place:
        borders.insert(0, place)
        place = int(last[place])
    return borders


def _lags(samples: Array) -> Array:
    """(steps, HIGHEST + 1): the autocorrelation about each step, tapered: any sum of them belongs to a signal."""
    width = 2 * STEP
    padded = np.pad(samples, (STEP // 2, STEP // 2 + width))
    count = len(samples) // STEP
    frames = sliding_window_view(padded, width)[: count * STEP : STEP] * hann(width, sym=False)
    return np.stack([(frames[:, lag:] * frames[:, : width - lag]).sum(axis=1) for lag in range(HIGHEST + 1)], axis=1)


def _costs(lags: Array, floor: float, total: int) -> Array:
    """(LONGEST + 1, steps): the description length in nats of so many steps from each one on."""
    count = len(lags)
    sums = np.concatenate([np.zeros((1, lags.shape[1])), np.cumsum(lags, axis=0)])
    costs = np.full((LONGEST + 1, count), np.inf)
    taper = float((hann(2 * STEP, sym=False) ** 2).sum())
    for steps in range(SHORTEST, min(LONGEST, count) + 1):
        errors = _errors((sums[steps:] - sums[:-steps]) / (steps * taper), floor)
        size = steps * STEP
        orders = np.arange(1, HIGHEST + 1)
        told = np.log(total) + np.log(orders) + (orders + 2) / 2 * np.log(size)
        costs[steps, : count - steps + 1] = (size / 2 * np.log(2 * np.pi * errors) + told).min(axis=1)
    return costs


def _errors(lags: Array, floor: float) -> Array:
    """(n, HIGHEST): the error of the best predictor of each order, by the recursion of Levinson and Durbin."""
    error = lags[:, 0] + floor
    found = np.empty((len(lags), HIGHEST))
    filters = np.zeros((len(lags), HIGHEST + 1))
    filters[:, 0] = 1
    for order in range(1, HIGHEST + 1):
        across = (filters[:, :order] * lags[:, order:0:-1]).sum(axis=1)
        reflection = -across / error
        filters[:, : order + 1] += reflection[:, None] * filters[:, order::-1]
        error = np.maximum(error * (1 - reflection**2), floor)
        found[:, order - 1] = error
    return found
