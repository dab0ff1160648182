"""How much the fixed and the random effects explain: Nakagawa & Schielzeth 2013, Johnson 2014."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.analysis.mixed_models.problem import Problem
from palpate.analysis.statistics.doubles import Floats

STEP = 65536


def fixed_variance(problem: Problem, coefficients: Floats) -> float:
    """The variance (n - 1) of what the fixed effects predict, in internal units."""
    n = len(problem.y)
    parts = [slice(start, min(start + STEP, n)) for start in range(0, n, STEP)]
    predicted = np.concatenate([problem.fixed.columns(p, p.stop - p.start) @ coefficients for p in parts])
    return float(np.var(predicted, ddof=1))


def mean_variances(problem: Problem, factors: Sequence[Floats], sigma2: float) -> list[float]:
    """Each random term's variance, averaged over the values: the mean of z' Sigma z."""
    n, found = len(problem.y), []
    for term, factor in zip(problem.random, factors, strict=True):
        total = 0.0
        for start in range(0, n, STEP):
            rows = slice(start, min(start + STEP, n))
            spread = term.design.columns(rows, rows.stop - start) @ factor
            total += float((spread * spread).sum())
        found.append(sigma2 * total / n)
    return found
