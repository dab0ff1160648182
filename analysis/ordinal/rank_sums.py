"""The rank-sum test of two independent samples (Wilcoxon, Mann-Whitney), exact whatever is tied."""

from __future__ import annotations

import math

import numpy as np

from palpate.analysis.ordinal.permutations import rank_sum_chances, two_sided
from palpate.analysis.ordinal.ranks import Ints, doubled_ranks, rounding
from palpate.analysis.ordinal.shifts import two_sample_shift
from palpate.analysis.ordinal.signed_ranks import NO_EXACT_MANY, RankComparison, corrected_z
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.pvalues import SMALLEST, p_note


def rank_sums(a: Floats, b: Floats, confidence: float = 0.95) -> RankComparison:
    """The test of two samples: statistic W (Mann-Whitney's U of the first), as in R's wilcox.test.

    The exact p is P(|W - mean| >= the distance found) over all ways to split the values found; the effect size
    2 W / (n_a n_b) - 1 is the rank-biserial correlation (Cliff's delta). Mann & Whitney 1947; Hollander, Wolfe &
    Chicken 2014, 4.1.
    """
    both = np.concatenate((a, b))
    ranks = doubled_ranks(both[None], rounding(both)[None])[0]
    shift = two_sample_shift(a, b, confidence)
    sizes = (len(a), len(b))
    if np.ptp(ranks) == 0:
        return RankComparison(sizes, 0, *(math.nan,) * 5, shift, "W is undefined: all values are the same")
    total = int(ranks[: len(a)].sum())
    u = (total - len(a) * (len(a) + 1)) / 2
    z, p_normal = corrected_z(total - len(a) * (len(both) + 1), _sd(ranks, *sizes))
    p_exact = _exact(ranks, sizes)
    notes = [NO_EXACT_MANY if math.isnan(p_exact) else "", shift.note, p_note([p_normal, p_exact])]
    size = (total - len(a) * (len(both) + 1)) / (len(a) * len(b))  # 2 U / (n_a n_b) - 1, in whole numbers
    return RankComparison(sizes, 0, u, z, p_normal, p_exact, size, shift, "; ".join(filter(None, notes)))


def _sd(ranks: Ints, n_a: int, n_b: int) -> float:
    """Standard deviation of a doubled rank sum, drawn without replacement from the ranks found."""
    n = n_a + n_b
    centred = ranks - (n + 1)
    return math.sqrt(n_a * n_b * float(np.dot(centred, centred)) / (n * (n - 1)))


def _exact(ranks: Ints, sizes: tuple[int, int]) -> float:
    """The exact p, from the smaller group: its distance from the mean is the same."""
    small = int(sizes[1] < sizes[0])
    own = ranks[sizes[0] :] if small else ranks[: sizes[0]]
    chances = rank_sum_chances(ranks, sizes[small])
    if chances is None:
        return math.nan
    return max(two_sided(chances, int(own.sum()), 2 * sizes[small] * (len(ranks) + 1)), SMALLEST)
