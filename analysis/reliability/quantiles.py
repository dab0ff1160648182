"""Quantiles of F and the normal distribution, to full precision."""

from __future__ import annotations

import math

from scipy.special import betainccinv, betaincinv, ndtri


def f_upper(tail: float, df1: float, df2: float) -> float:
    """The value that F exceeds with this probability, from the beta distribution (Abramowitz & Stegun 26.6.2).

    Both halves of the beta variable are solved for, so that neither is a difference of nearly equal numbers.
    """
    if math.isnan(df1) or math.isnan(df2):
        return math.nan
    rest = float(betaincinv(df2 / 2, df1 / 2, tail))  # df2 / (df2 + df1 f)
    part = float(betainccinv(df1 / 2, df2 / 2, tail))  # df1 f / (df2 + df1 f)
    return df2 * part / (df1 * rest) if rest > 0 else math.inf


def normal_upper(tail: float) -> float:
    """The value that a standard normal variable exceeds with this probability."""
    return -float(ndtri(tail))
