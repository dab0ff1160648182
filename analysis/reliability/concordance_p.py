"""How probable so large a concordance is where every order of each rater's ranks is equally likely."""

from __future__ import annotations

import math
from itertools import permutations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from analysis.reliability.resampling import generator
from analysis.statistics.doubles import Floats
from analysis.statistics.pvalues import SMALLEST

Ranks: TypeAlias = NDArray[np.int64]
ORDERS = 720  # of one rater's ranks
STEP, WORK = 400_000, 4_000_000  # sums of ranks to look at for one rater, and for all


def chi2_tail(statistic: float, df: int) -> float:
    """P(chi squared > statistic): NaN for NaN, never 0."""
    return math.nan if math.isnan(statistic) else max(float(gammaincc(df / 2, statistic / 2)), SMALLEST)


def exact_p(ranks: Ranks, spread: int) -> float | None:
    """The share of all joint orders whose rank sums spread at least as much; None where there are too many.

    `ranks` are doubled (raters, targets), `spread` is the sum of squares of their sums about the mean. The first
    rater stays as it is, and sums that differ only in the order of targets are one state, as what follows treats
    all targets alike.
    """
    m, n = ranks.shape
    states, chances = np.sort(ranks[:1] - (n + 1), axis=1), np.ones(1)
    work = 0
    for row in ranks[1:]:
        orders = _orders(row - (n + 1))
        work += STEP if orders is None else len(states) * len(orders)
        if orders is None or len(states) * len(orders) > STEP or work > WORK or not _fits(m, n):
            return None
        states, chances = _joined(states, chances, orders, m * n)
    reached = (states**2).sum(axis=1) >= spread
    return min(1.0, max(math.fsum(chances[reached].tolist()), SMALLEST))


def permutation_p(ranks: Ranks, spread: int, draws: int, seed: int) -> float:
    """The share of shuffled tables that spread at least as much, the table itself among them: (1 + hits) / (1 + draws).

    Phipson & Smyth 2010: so counted, p is valid and never 0.
    """
    rng = generator(seed, "kendall_w")
    m, n = ranks.shape
    centred = ranks - (n + 1)
    block, hits = max(1, 2_000_000 // ranks.size), 0
    for start in range(0, draws, block):
        size = min(block, draws - start)
        shuffled = rng.permuted(np.broadcast_to(centred, (size, m, n)), axis=2)
        hits += int(((shuffled.sum(axis=1) ** 2).sum(axis=1) >= spread).sum())
    return (1 + hits) / (1 + draws)


def _fits(m: int, n: int) -> bool:
    """Whether a state, a whole number from -m n to m n for each target, fits one 64-bit key."""
    return n * math.log2(2 * m * n + 1) < 62


def _orders(row: NDArray[np.int64]) -> Ranks | None:
    """The different orders of one rater's ranks, each equally likely; None where there are too many."""
    _, runs = np.unique(row, return_counts=True)
    count = math.factorial(len(row)) // math.prod(math.factorial(int(run)) for run in runs)
    if count > ORDERS or len(row) > 8:
        return None
    return np.array(sorted(set(permutations(row.tolist()))), dtype=np.int64)


def _joined(states: Ranks, chances: Floats, orders: Ranks, reach: int) -> tuple[Ranks, Floats]:
    """Every state with every order of one more rater, equal states together."""
    sums = np.sort((states[:, None, :] + orders[None, :, :]).reshape(-1, states.shape[1]), axis=1)
    base = (2 * reach + 1) ** np.arange(sums.shape[1], dtype=np.int64)
    _, first, place = np.unique((sums + reach) @ base, return_index=True, return_inverse=True)
    each = np.repeat(chances / len(orders), len(orders))
    joined: Floats = np.bincount(place, weights=each).astype(np.float64)
    return sums[first], joined
