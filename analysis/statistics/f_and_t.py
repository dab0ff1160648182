"""p values, families of them, and intervals of effect sizes, from the distributions of F and t.

p values come from the incomplete beta function. Intervals (partial and generalized eta squared, dz, Hedges' g) come
from the limits of the noncentrality of F and t (Steiger & Fouladi 1997; Steiger 2004, Psychological Methods 9). F's
distribution function is SciPy's where it is defined; its inverse in the noncentrality is computed here by bracketing,
because SciPy's (`ncfdtrinc`) stops at 1e-3. t's is integrated here, because SciPy's is undefined beyond t = 1e4.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd
from scipy.special import betainc, betaincc, chdtr, chdtri, gammaln, ncfdtr, ndtr, stdtrit, xlogy

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, UnknownColumn, refuse_idle, shown

Corrected: TypeAlias = Literal["GG", "HF", "none"]
EPSILONS = {"GG": "eps", "HF": "eps_HF"}
TINY = "the interval of eta squared is 0 to 0: F is smaller than chance alone would make it"
ABOVE = "eta squared lies above its own interval: F is so small that chance alone would often make a larger one"
BEYOND = "no interval of eta squared: F is beyond what the noncentral F distribution can tell"
Limits: TypeAlias = tuple[float, float]
NONE: Limits = (math.nan, math.nan)
FARTHEST = 1e9
"""The greatest noncentrality of F in the search."""
NODES, REACH = 200, 9.0
"""Nodes of the integrals, and their range in standard deviations to either side."""
SMALLEST = math.ulp(0.0)  # 5e-324


def f_tail(statistic: float, df1: float, df2: float) -> float:
    """Return P(F > statistic): NaN for NaN, never 0 (the smallest double stands for everything below it).

    Source: Abramowitz & Stegun 26.6.2, from the side whose argument loses no digits.
    """
    if math.isnan(statistic):
        return math.nan
    load = df1 * statistic
    if load > df2:
        tail = float(betainc(df2 / 2, df1 / 2, df2 / (df2 + load)))
    else:
        tail = float(betaincc(df1 / 2, df2 / 2, load / (df2 + load)))
    return max(tail, SMALLEST)


def t_two_sided(statistic: float, df: float) -> float:
    """Return P(|T| > |statistic|): NaN for NaN, never 0."""
    return f_tail(statistic * statistic, 1.0, df)


def t_upper(statistic: float, df: float) -> float:
    """Return P(T > statistic): NaN for NaN, never 0."""
    half = t_two_sided(statistic, df) / 2
    return 1 - half if statistic < 0 else max(half, SMALLEST)


def t_critical(df: float, confidence: float = 0.95) -> float:
    """Return the half-width of a two-sided interval in standard errors, from Student's t."""
    return float(stdtrit(df, (1 + confidence) / 2))


def p_note(values: Iterable[float]) -> str:
    """Return a note on p values at the limit of double precision, or "": p is never 0, but may have lost digits."""
    smallest = min((value for value in values if value >= 0), default=1.0)
    if smallest == SMALLEST:
        return "p < 5e-324"
    return "p < 2.3e-308 has lost digits" if smallest < sys.float_info.min else ""


def adjusted(p: Sequence[float], method: str, family: int | None = None) -> list[float]:
    """Return the p values adjusted for their family by "none", "bonf" or "holm" (Holm 1979).

    The family has as many members as `p`, or `family` (at least as many): an undefined one (NaN) stays NaN and counts
    as the last in Holm's order, which is conservative for the others; so do those not in `p`.
    """
    size = len(p) if family is None else family
    if method == "none":
        return list(p)
    if method == "bonf":
        return [min(1.0, value * size) if value >= 0 else value for value in p]
    result = [math.nan] * len(p)
    largest = 0.0
    defined = [i for i, value in enumerate(p) if not math.isnan(value)]
    for place, i in enumerate(sorted(defined, key=lambda i: p[i])):
        largest = max(largest, min(1.0, p[i] * (size - place)))
        result[i] = largest
    return result


def eta_squared_interval(
    f: float, df1: float, df2: float, *, confidence: float = 0.90, added: float = 0.0
) -> tuple[float, float]:
    """Return the interval of partial eta squared for an F with its degrees of freedom: nc / (nc + df2 + added).

    nc are the limits of F's noncentrality (Steiger 2004). `added` = 0 is the scale on which F df1 / (F df1 + df2) is
    partial eta squared itself (as in R's effectsize); `added` = df1 + 1 divides by the number of participants of a
    design between groups (Steiger 2004, eq. 51; R's MBESS). 90 % by default, which excludes 0 if p < .05. NaN if F is
    NaN. Raises BadOption for a confidence outside 0..1.
    """
    low, high = f_noncentrality(f, df1, df2, checked_confidence(confidence))
    return low / (low + df2 + added), high / (high + df2 + added)


def eta_squared_intervals(
    table: pd.DataFrame, *, confidence: float = 0.90, correction: Corrected = "none"
) -> pd.DataFrame:
    """Return intervals for every row of a result of `rm_anova`, `mixed_anova` or `anova`: one row per effect.

    `np2_low` and `np2_high` come from the noncentral F with the effect's degrees of freedom, times epsilon where
    `correction` is "GG" or "HF" and the effect has one. `ng2_low` and `ng2_high` are the same limits converted to
    generalized eta squared, with the observed ratio of this effect's error to all others; a table of `anova` has
    `eta2_low` and `eta2_high` instead. A row without F has NaN and a `note`. Raises BadOption, and UnknownColumn for a
    table that none of these calls made.
    """
    level = checked_confidence(confidence)
    if not isinstance(correction, str) or correction not in ("none", *EPSILONS):
        raise BadOption(f"correction={shown(correction)} is unknown: 'GG', 'HF' or 'none'")
    missing = {"Source", "F", "ddof1", "ddof2", "np2", "note"} - set(table.columns)
    if missing:
        raise UnknownColumn(
            f"the table has no column {min(missing)!r}; pass a result of rm_anova, mixed_anova or anova"
        )
    if correction in EPSILONS and EPSILONS[correction] not in table:
        refuse_idle("correction", correction, "none", "on a table without epsilon, such as one of `anova`")
    rows = []
    for row in table.to_dict("records"):
        eps = float(row.get(EPSILONS.get(correction, ""), 1.0))
        partial, note = NONE, ""
        if not math.isnan(row["F"] * eps):
            partial = eta_squared_interval(row["F"], row["ddof1"] * eps, row["ddof2"] * eps, confidence=level)
        if not math.isnan(row["F"]):
            if math.isnan(sum(partial)):
                note = BEYOND
            elif not partial[1] >= row["np2"]:
                note = TINY if partial[1] == 0 else ABOVE
        name = "ng2" if "ng2" in row else "eta2"
        generalized = tuple(_carried(limit, row) for limit in partial)
        intervals = {**_named("np2", row["np2"], partial), **_named(name, row[name], generalized)}
        rows.append({"Source": row["Source"], **intervals, "note": "; ".join(filter(None, (row["note"], note)))})
    return pd.DataFrame(rows)


def dz_interval(dz: float, n: int, *, confidence: float = 0.95) -> Limits:
    """Return the interval of dz, the mean of n differences over their standard deviation; NaN if dz is.

    The limits of the noncentrality of t = dz sqrt(n) with n - 1 degrees of freedom, over sqrt(n) (Steiger & Fouladi
    1997; Goulet-Pelletier & Cousineau 2018). Raises BadOption for a confidence outside 0..1.
    """
    root = math.sqrt(n)
    low, high = t_noncentrality(dz * root, n - 1, checked_confidence(confidence))
    return low / root, high / root


def hedges_interval(g: float, n1: int, n2: int, *, confidence: float = 0.95) -> Limits:
    """Return the interval of Hedges' g of two groups; NaN if g is, and for fewer than 4 participants.

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


def checked_confidence(confidence: object) -> float:
    """Return the confidence. Raises BadOption unless it is between 0 and 1."""
    if isinstance(confidence, bool) or not isinstance(confidence, int | float) or not 0 < confidence < 1:
        raise BadOption(f"confidence={shown(confidence)} is unknown: a number between 0 and 1, such as 0.90")
    return float(confidence)


def _named(name: str, value: float, limits: tuple[float, ...]) -> dict[str, float]:
    return {name: value, f"{name}_low": limits[0], f"{name}_high": limits[1]}


def _carried(limit: float, row: Mapping[Hashable, Any]) -> float:
    """Return a limit of partial eta squared converted to generalized eta squared.

    It is SS / (SS + r SS_error) with the observed r.
    """
    partial, generalized = row["np2"], row.get("ng2", row["np2"])
    if not (limit > 0 and partial > 0):
        return limit
    ratio = partial / (1 - partial) / (generalized / (1 - generalized))
    odds = limit / (1 - limit) / ratio
    return float(odds / (1 + odds))


def f_noncentrality(f: float, df1: float, df2: float, confidence: float) -> Limits:
    """Return the limits of F's noncentrality; the lower is 0 if F is smaller than expected by chance.

    NaN if F is, or if a limit exceeds 1e9.
    """
    if not math.isfinite(f):
        return NONE
    tail = (1 - confidence) / 2
    start = df1 * f + df1 + 1.0

    def chance(nc: float) -> float:
        return f_chance(f, df1, df2, nc)

    # The noncentrality at which a falling probability reaches the level; 0 where it begins below.
    at_0 = chance(0.0)
    low, high = (0.0 if at_0 <= level else _crossing(chance, level, 0.0, start) for level in (1 - tail, tail))
    return low, high


def f_chance(f: float, df1: float, df2: float, nc: float) -> float:
    """Return P(F <= f) of the noncentral F.

    If SciPy's is undefined, it is the sum over Poisson probabilities (A & S 26.6.18).
    """
    chance = float(ncfdtr(df1, df2, nc, f))
    if not math.isnan(chance) or not 0 <= nc <= FARTHEST:
        return chance
    half = nc / 2
    reach = 12 * math.sqrt(half) + 40
    j = np.arange(max(0.0, math.floor(half - reach)), half + reach)
    weights = np.exp(xlogy(j, half) - half - gammaln(j + 1))
    below = betainc(df1 / 2 + j, df2 / 2, df1 * f / (df1 * f + df2))
    return float(weights @ below / weights.sum())


def t_noncentrality(t: float, df: float, confidence: float) -> Limits:
    """Return the limits of t's noncentrality; NaN if t is."""
    if not math.isfinite(t):
        return NONE
    tail = (1 - confidence) / 2
    width = 4.0 + 4.0 * abs(t) / math.sqrt(2 * df)
    low, high = (_crossing(lambda nc: t_chance(t, df, nc), p, t - width, t + width) for p in (1 - tail, tail))
    return low, high


def t_chance(t: float, df: float, nc: float) -> float:
    """Return P(T <= t) of the noncentral t: P(Z + nc <= t s), Z normal, s an independent chi over the root of its df.

    It is integrated over the variable with the smoother integrand, to about 1e-13.
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
    """Return nodes of s and their probabilities."""
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


def _crossing(chance: Callable[[float], float], level: float, low: float, high: float) -> float:
    """Return where a falling probability crosses `level`, by a bracket that is widened until it contains it."""
    from scipy.optimize import brentq

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
