"""Pearson correlations without loss of digits at any offset and scale, and quantiles of F and the normal."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import betainccinv, betaincinv, ndtri

from palpate.analysis.statistics.doubles import ROUNDING, Floats, centred, differences, row_sums, scaled, sum_of_squares
from palpate.analysis.statistics.f_and_t import t_two_sided


class Correlation(NamedTuple):
    """Pearson's r with Fisher's interval and its two-sided p; NaN if undefined, and `note` says why."""

    r: float
    p: float
    ci_low: float
    ci_high: float
    n: int
    note: str


def deviations(values: Floats) -> Floats:
    """Return a sample's deviations from its mean times its size, scaled by a power of two; 0 if only rounding."""
    x, _ = scaled(values)
    high, low = differences((x, None), 0)
    scaled_deviations = centred(high if low is None else high + low, 0)
    if sum_of_squares(scaled_deviations) / len(scaled_deviations) ** 2 <= len(scaled_deviations) * ROUNDING**2:
        return np.zeros_like(scaled_deviations)
    return scaled(scaled_deviations)[0]


def deviations_of_sum(columns: Floats) -> Floats:
    """Return the deviations of the sums of a matrix' rows, as if added without rounding."""
    x, _ = scaled(columns)
    sums = row_sums(differences((x, None), 0))
    scaled_deviations = centred(sums, 0)
    if sum_of_squares(scaled_deviations) / len(scaled_deviations) ** 2 <= columns.size * ROUNDING**2:
        return np.zeros_like(scaled_deviations)
    return scaled(scaled_deviations)[0]


def product_moment(x: Floats, y: Floats) -> float:
    """Return r from two samples' deviations, NaN if one of them does not vary."""
    xx, yy = sum_of_squares(x), sum_of_squares(y)
    if xx == 0 or yy == 0:
        return math.nan
    return min(1.0, max(-1.0, float(np.add.reduce(x * y)) / (math.sqrt(xx) * math.sqrt(yy))))


def pearson(first: Floats, second: Floats, confidence: float = 0.95) -> Correlation:
    """Return Pearson's r of two samples of equal length, its p (t with n - 2 df) and Fisher's interval."""
    n = len(first)
    if n < 3:
        return Correlation(math.nan, math.nan, math.nan, math.nan, n, f"r needs three pairs or more; there are {n}")
    x, y = deviations(first), deviations(second)
    r = product_moment(x, y)
    if math.isnan(r):
        which = "first" if not x.any() else "second"
        return Correlation(r, r, r, r, n, f"r is undefined: the {which} values do not vary")
    # 1 - r squared from the residuals of a regression, which keeps its digits where r is near 1.
    rest = y - float(np.add.reduce(x * y)) / sum_of_squares(x) * x
    share = sum_of_squares(rest) / sum_of_squares(y)
    unexplained = 0.0 if share <= len(x) * ROUNDING**2 else min(1.0, share)
    if unexplained == 0:
        return Correlation(math.copysign(1.0, r), math.nan, math.nan, math.nan, n, "exactly linear: p is undefined")
    p = t_two_sided(abs(r) * math.sqrt((n - 2) / unexplained), n - 2)
    if n < 4:
        return Correlation(r, p, math.nan, math.nan, n, "the interval of r needs four pairs or more")
    half = normal_upper((1 - confidence) / 2) / math.sqrt(n - 3)
    # tanh(atanh r -+ half); atanh from 1 - r squared where r is near 1 (Fisher 1921).
    z = math.copysign(math.log((1 + abs(r)) / math.sqrt(unexplained)), r)
    return Correlation(r, p, *(math.tanh(z - half), math.tanh(z + half)), n, "")


def f_upper(tail: float, df1: float, df2: float) -> float:
    """Return the value that F exceeds with this probability, from the beta distribution (Abramowitz & Stegun 26.6.2).

    Both x and 1 - x of the beta variable are solved for, so that neither is a difference of nearly equal numbers.
    """
    if math.isnan(df1) or math.isnan(df2):
        return math.nan
    rest = float(betaincinv(df2 / 2, df1 / 2, tail))  # df2 / (df2 + df1 f)
    part = float(betainccinv(df1 / 2, df2 / 2, tail))  # df1 f / (df2 + df1 f)
    return df2 * part / (df1 * rest) if rest > 0 else math.inf


def normal_upper(tail: float) -> float:
    """Return the value that a standard normal variable exceeds with this probability."""
    return -float(ndtri(tail))
