"""Tail probabilities of F and t from the incomplete beta function, and families of p values."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence

from scipy.special import betainc, betaincc, stdtrit

SMALLEST = math.ulp(0.0)  # 5e-324


def f_tail(statistic: float, df1: float, df2: float) -> float:
    """Return P(F > statistic): NaN for NaN, never 0 (the smallest double stands for everything below it).

    Abramowitz & Stegun 26.6.2, from the side whose argument keeps its digits.
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
    """Return a note on p values at the end of double precision, or "": p is never 0, but may have lost its digits."""
    smallest = min((value for value in values if value >= 0), default=1.0)
    if smallest == SMALLEST:
        return "p < 5e-324"
    return "p < 2.3e-308 has lost digits" if smallest < sys.float_info.min else ""


def adjusted(p: Sequence[float], method: str, family: int | None = None) -> list[float]:
    """Return the p values adjusted for their family by "none", "bonf" or "holm" (Holm 1979).

    The family has as many members as `p`, or `family` (at least as many): an undefined one (NaN) stays NaN, keeps its
    place, and stands last in Holm's order, which is the cautious choice for the others; so do those not in `p`.
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
