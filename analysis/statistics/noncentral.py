"""Confidence limits of the noncentrality of F and t: the values under which what was found is just not too extreme.

Steiger & Fouladi 1997; Steiger 2004, Psychological Methods 9. F's distribution function is SciPy's where it has a
value; its inverse in the noncentrality is found here by bracketing, because SciPy's own (`ncfdtrinc`) stops at 1e-3.
t's is integrated here, because SciPy's has no value beyond t = 1e4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from scipy.optimize import brentq
from scipy.special import betainc, chdtr, chdtri, gammaln, ncfdtr, ndtr, xlogy

from palpate.analysis.statistics.doubles import Floats

Limits: TypeAlias = tuple[float, float]
NONE: Limits = (math.nan, math.nan)
FARTHEST = 1e9
"""No noncentrality of F beyond it is looked for."""
NODES, REACH = 200, 9.0
"""Nodes of the integrals, and standard deviations to either side."""


def f_noncentrality(f: float, df1: float, df2: float, confidence: float) -> Limits:
    """Lower and upper limit of F's noncentrality; the lower is 0 where F is smaller than chance would make it.

    NaN where F is, or where a limit lies beyond 1e9.
    """
    if not math.isfinite(f):
        return NONE
    tail = (1 - confidence) / 2
    start = df1 * f + df1 + 1.0
    found = [_largest(lambda nc: f_chance(f, df1, df2, nc), level, start) for level in (1 - tail, tail)]
    return found[0], found[1]


def f_chance(f: float, df1: float, df2: float, nc: float) -> float:
    """P(F <= f) of the noncentral F; where SciPy's has no value, the sum over Poisson's chances (A & S 26.6.18)."""
    found = float(ncfdtr(df1, df2, nc, f))
    if not math.isnan(found) or not 0 <= nc <= FARTHEST:
        return found
    half = nc / 2
    reach = 12 * math.sqrt(half) + 40
    j = np.arange(max(0.0, math.floor(half - reach)), half + reach)
    weights = np.exp(xlogy(j, half) - half - gammaln(j + 1))
    below = betainc(df1 / 2 + j, df2 / 2, df1 * f / (df1 * f + df2))
    return float(weights @ below / weights.sum())


def t_noncentrality(t: float, df: float, confidence: float) -> Limits:
    """Lower and upper limit of t's noncentrality; NaN where t is."""
    if not math.isfinite(t):
        return NONE
    tail = (1 - confidence) / 2
    width = 4.0 + 4.0 * abs(t) / math.sqrt(2 * df)
    low, high = (_crossing(lambda nc: t_chance(t, df, nc), p, t - width, t + width) for p in (1 - tail, tail))
    return low, high


def t_chance(t: float, df: float, nc: float) -> float:
    """P(T <= t) of the noncentral t: P(Z + nc <= t s), Z normal and s independent, a chi over the root of its df.

    Integrated over whichever of the two makes the smoother integrand; good to about 1e-13.
    """
    if t < 0:
        return 1 - t_chance(-t, df, -nc)
    if t * t <= 2 * df:
        s, weights = _chi(df)
        return float(weights @ ndtr(t * s - nc))
    low = max(-REACH, -nc)
    z, weights = _nodes(min(low, REACH), REACH)
    return 1 - float(weights @ (np.exp(-z * z / 2) * chdtr(df, df * ((nc + z) / t) ** 2))) / math.sqrt(2 * math.pi)


@lru_cache(maxsize=256)
def _chi(df: float) -> tuple[Floats, Floats]:
    """Nodes of s and their chances."""
    low = max(0.0, 1 - 1.2 * REACH / math.sqrt(2 * df))
    s, weights = _nodes(low, math.sqrt(float(chdtri(df, 1e-19)) / df))
    density = weights * np.exp((df - 1) * np.log(s) - df * (s * s - 1) / 2)
    return s, density / density.sum()


def _nodes(low: float, high: float) -> tuple[Floats, Floats]:
    x, weights = _legendre()
    half = (high - low) / 2
    return low + half * (x + 1), half * weights


@lru_cache(maxsize=1)
def _legendre() -> tuple[Floats, Floats]:
    x, weights = np.polynomial.legendre.leggauss(NODES)
    return x, weights


def _largest(chance: Callable[[float], float], level: float, start: float) -> float:
    """The noncentrality at which a falling probability reaches `level`; 0 where it begins below."""
    return 0.0 if chance(0.0) <= level else _crossing(chance, level, 0.0, start)


def _crossing(chance: Callable[[float], float], level: float, low: float, high: float) -> float:
    """Where a falling probability crosses `level`, from a bracket that is widened until it holds the place."""
    step = high - low
    while not chance(high) <= level:
        low, high, step = high, high + step, 2 * step
        if high > FARTHEST:
            return math.nan
    while not chance(low) >= level:
        low, step = low - step, 2 * step
        if low < -FARTHEST:
            return math.nan
    try:
        return float(brentq(lambda nc: chance(nc) - level, low, high, xtol=1e-13, rtol=1e-14))
    except ValueError:  # the distribution function has no value in between
        return math.nan
