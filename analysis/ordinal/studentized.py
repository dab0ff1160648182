"""The range of k standard normal values: its tail and quantiles (the studentized range with infinite df).

P(range > q) = k int phi(z) [Phi(z)^(k-1) - (Phi(z) - Phi(z - q))^(k-1)] dz, z the largest value: every part is
positive, so the smallest tail keeps its digits. The integrand is smooth and falls off like a normal density, where
the trapezoidal rule converges faster than any power of the step (Trefethen & Weideman 2014).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq
from scipy.special import log_ndtr

from palpate.analysis.statistics.pvalues import SMALLEST

STEP = 1 / 32
REACH = 40.0  # beyond so many standard deviations a double holds no density
NEARLY_ONE = -(2.0**-52)  # a logarithm below 0 whose exponential is still below 1


def range_tail(q: float, k: int) -> float:
    """P(largest - smallest of k standard normal values > q), q >= 0; never 0, NaN for NaN."""
    if math.isnan(q):
        return math.nan
    if q <= 0:
        return 1.0
    if q > 2 * REACH:
        return SMALLEST
    z = np.arange(-REACH, REACH + q, STEP)
    below = log_ndtr(z)
    inside = np.log1p(-np.exp(np.minimum(log_ndtr(z - q) - below, NEARLY_ONE)))
    shares = np.exp((k - 1) * below - z * z / 2) * -np.expm1((k - 1) * inside)
    return min(1.0, max(float(shares.sum()) * k * STEP / math.sqrt(2 * math.pi), SMALLEST))


def range_quantile(alpha: float, k: int) -> float:
    """The q with P(range > q) = alpha."""
    return float(brentq(lambda q: range_tail(q, k) - alpha, 0.0, 60.0, xtol=1e-13, rtol=1e-14))
