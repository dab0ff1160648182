"""How probable so large a concordance is where every order of each rater's ranks is equally likely."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import gammaincc

from palpate.analysis.ordinal.ranks import Ints
from palpate.analysis.reliability.resampling import generator
from palpate.analysis.statistics.pvalues import SMALLEST


def chi2_tail(statistic: float, df: int) -> float:
    """P(chi squared > statistic): NaN for NaN, never 0."""
    return math.nan if math.isnan(statistic) else max(float(gammaincc(df / 2, statistic / 2)), SMALLEST)


def permutation_p(ranks: Ints, spread: int, draws: int, seed: int) -> float:
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
