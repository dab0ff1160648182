"""Confidence intervals of standardised mean differences: dz of paired values, Hedges' g of two groups."""

from __future__ import annotations

import math

from palpate.analysis.statistics.eta_intervals import checked_confidence
from palpate.analysis.statistics.noncentral import Limits, t_noncentrality


def dz_interval(dz: float, n: int, *, confidence: float = 0.95) -> Limits:
    """The interval of dz, the mean of n differences over their standard deviation; NaN where dz is.

    The limits of the noncentrality of t = dz sqrt(n) with n - 1 degrees of freedom, over sqrt(n) (Steiger & Fouladi
    1997; Goulet-Pelletier & Cousineau 2018). Raises BadOption for a confidence outside 0..1.
    """
    root = math.sqrt(n)
    low, high = t_noncentrality(dz * root, n - 1, checked_confidence(confidence))
    return low / root, high / root


def hedges_interval(g: float, n1: int, n2: int, *, confidence: float = 0.95) -> Limits:
    """The interval of Hedges' g of two groups; NaN where g is, and for fewer than 4 participants.

    From t = d sqrt(n1 n2 / (n1 + n2)) with n1 + n2 - 2 degrees of freedom, d = g / J; limits times J, the factor for
    small samples that g has (Hedges 1981). Raises BadOption for a confidence outside 0..1.
    """
    n = n1 + n2
    level = checked_confidence(confidence)
    if math.isnan(g) or n < 4:
        return math.nan, math.nan
    root = math.sqrt(n1 * n2 / n) / (1 - 3 / (4 * n - 9))
    low, high = t_noncentrality(g * root, n - 2, level)
    return low / root, high / root
