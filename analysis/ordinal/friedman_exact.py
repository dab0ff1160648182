"""The exact distribution of Friedman's statistic given each participant's ties, by adding one participant at a time."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np

from palpate.analysis.ordinal.ranks import Ints
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.pvalues import SMALLEST

MOST_ARRANGEMENTS = 5040  # 7!: distinct orders of one participant's ranks
MOST_SUMS = 1_500_000  # column sums times orders, over all participants
MOST_KEY = 2**62


def exact_tail(ranks: Ints) -> float:
    """P(statistic >= the one found) when each participant's ranks fall in any order; NaN where that costs too much.

    Under the hypothesis every order of a participant's own (mid)ranks is equally likely. The columns are
    interchangeable, so sets of column sums are kept sorted. Probabilities only ever add, so none loses digits.
    """
    n, k = ranks.shape
    centred = ranks - (k + 1)
    rows = min(_in_order(centred), _in_order(-centred), key=lambda each: each.tolist())  # a turned scale costs as much
    if not _affordable(rows, n, k):
        return math.nan
    found = int((centred.sum(axis=0) ** 2).sum())
    sums, weights, done = rows[:1], np.ones(1), 0
    for row in rows[1:]:
        orders = _orders(row)
        done += len(sums) * len(orders)
        if done > MOST_SUMS:
            return math.nan
        sums, weights = _step(sums, weights, orders)
    reached = (sums * sums).sum(axis=1) >= found
    return min(1.0, max(float(weights[reached].sum()), SMALLEST))


def _in_order(rows: Ints) -> Ints:
    """Each row's ranks rising, and the rows in order: what the distribution rests on."""
    rising = np.sort(rows, axis=1)
    ordered: Ints = rising[np.lexsort(rising.T)]
    return ordered


def _affordable(rows: Ints, n: int, k: int) -> bool:
    orders = max(_order_count(row) for row in np.unique(rows, axis=0))
    return orders <= MOST_ARRANGEMENTS and (4 * n * (k + 1)) ** k < MOST_KEY


def _order_count(row: Ints) -> int:
    counts = np.unique(row, return_counts=True)[1].tolist()
    return math.factorial(len(row)) // math.prod(math.factorial(count) for count in counts)


def _orders(row: Ints) -> Ints:
    """Every distinct order of a row, one after the other."""
    if len(row) <= 7:
        return np.array(sorted(set(permutations(row.tolist()))), dtype=np.int64)
    return np.array(list(_distinct(tuple(row.tolist()))), dtype=np.int64)


def _distinct(row: tuple[int, ...]) -> set[tuple[int, ...]]:
    """The distinct orders of many values of which most are tied."""
    if len(row) == 1:
        return {row}
    return {
        (value, *rest)
        for value in set(row)
        for rest in _distinct(row[: row.index(value)] + row[row.index(value) + 1 :])
    }


def _step(sums: Ints, weights: Floats, orders: Ints) -> tuple[Ints, Floats]:
    """Add one participant: each set of sums with each order, equal outcomes (in any column order) joined."""
    k = sums.shape[1]
    added = np.sort((sums[:, None, :] + orders[None, :, :]).reshape(-1, k), axis=1)
    base = int(added.max() - added.min()) + 1
    key = np.zeros(len(added), dtype=np.int64)
    for column in range(k):
        key = key * base + (added[:, column] - added.min())
    _, first, place = np.unique(key, return_index=True, return_inverse=True)
    shares = np.repeat(weights / len(orders), len(orders))
    joined: Floats = np.bincount(place, weights=shares).astype(np.float64)
    return added[first].astype(np.int64), joined
