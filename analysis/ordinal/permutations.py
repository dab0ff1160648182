"""Exact distributions of rank statistics given the ties, in whole (doubled) ranks.

Probabilities and counts only ever add, so the smallest tail keeps its digits.
"""

from __future__ import annotations

import numpy as np

from palpate.analysis.ordinal.ranks import Ints
from palpate.analysis.statistics.doubles import Floats

MOST_SIGNED = 300  # pairs up to which the distribution of signed ranks is computed
MOST_STEPS = 200_000_000  # additions up to which the distribution of a rank sum is computed
MOST_VALUES = 500  # values in both groups: binomial coefficients stay within doubles


def signed_rank_chances(ranks: Ints) -> Floats:
    """P(sum of the positive ranks = 0, 1, ...) when every rank is positive or negative with chance 1/2."""
    chances = np.zeros(int(ranks.sum()) + 1)
    chances[0], end = 1.0, 0
    for rank in np.sort(ranks).tolist():
        end += rank
        grown = chances[: end + 1] / 2
        grown[rank:] += chances[: end + 1 - rank] / 2
        chances[: end + 1] = grown
    return chances


def rank_sum_chances(ranks: Ints, size: int) -> Floats | None:
    """P(sum of a group's ranks = 0, 1, ...) when any `size` of the values form the group; None where too costly."""
    total = int(np.sort(ranks)[len(ranks) - size :].sum())
    if len(ranks) > MOST_VALUES or len(ranks) * size * total > MOST_STEPS:
        return None
    counts = np.zeros((size + 1, total + 1))
    counts[0, 0] = 1.0
    for done, rank in enumerate(np.sort(ranks).tolist()):
        most = min(done + 1, size)
        counts[1 : most + 1, rank:] += counts[:most, : total + 1 - rank].copy()
    found: Floats = counts[size]
    found /= found.sum()
    return found


def two_sided(chances: Floats, found: int, doubled_mean: int) -> float:
    """P(|statistic - mean| >= |found - mean|); `doubled_mean` is twice the mean."""
    apart = np.abs(2 * np.arange(len(chances)) - doubled_mean)
    return min(1.0, float(chances[apart >= abs(2 * found - doubled_mean)].sum()))


def lower_quantile(chances: Floats, share: float) -> int:
    """The smallest value whose cumulative chance reaches `share`."""
    return int(np.searchsorted(np.cumsum(chances), share * (1 - 1e-12)))
