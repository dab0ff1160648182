"""Intraclass correlations: all six of Shrout & Fleiss, each with its F, p and confidence interval.

From the mean squares of a complete table of rows by columns, without loss where offsets are huge.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import pandas as pd

from palpate.analysis.reliability.correlating import f_upper
from palpate.analysis.reliability.crossed import cross_table, refuse_few
from palpate.analysis.statistics.anova import component
from palpate.analysis.statistics.cells import Aggregate
from palpate.analysis.statistics.doubles import ROUNDING, Floats, Pair, differences, scaled
from palpate.analysis.statistics.f_and_t import f_tail, p_note
from palpate.analysis.statistics.refusals import BadOption, shown

Missing: TypeAlias = Literal["raise", "drop_targets", "drop_raters"]
GAPS = {"raise": "raise", "drop_targets": "drop_rows", "drop_raters": "drop_columns"}
NAMES = {  # Shrout & Fleiss' name: McGraw & Wong's, and what it says
    "ICC1": ("ICC(1)", "one rating, raters not told apart (one-way random)"),
    "ICC2": ("ICC(A,1)", "one rating, absolute agreement (two-way random)"),
    "ICC3": ("ICC(C,1)", "one rating, consistency (two-way mixed)"),
    "ICC1k": ("ICC(k)", "mean of k ratings, raters not told apart (one-way random)"),
    "ICC2k": ("ICC(A,k)", "mean of k ratings, absolute agreement (two-way random)"),
    "ICC3k": ("ICC(C,k)", "mean of k ratings, consistency (two-way mixed)"),
}
NEGATIVE = "negative: ratings of one target differ more than targets do; commonly read as no reliability"
NO_LIMITS = "no interval: Satterthwaite's approximation fails on so few ratings"
NO_TOTAL = "undefined: the estimated variance of a rating is not above 0"


class Icc(NamedTuple):
    """One intraclass correlation, NaN if it or a part of it is undefined; `note` says why."""

    type: str
    name: str
    description: str
    icc: float
    f: float
    df1: int
    df2: int
    p: float
    ci_low: float
    ci_high: float
    note: str


class _F(NamedTuple):
    """An F ratio with its degrees of freedom and its bounds; a bound is NaN if F has no denominator."""

    value: float
    df1: int
    df2: int
    low: float
    high: float


def icc(
    data: pd.DataFrame,
    dv: Hashable,
    targets: Hashable,
    raters: Hashable,
    *,
    confidence: float = 0.95,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return the six intraclass correlations of a long table, one row each, with F tests and intervals.

    Columns: type (Shrout & Fleiss 1979), name (McGraw & Wong 1996), description, ICC, F, df1, df2, p, ci_low, ci_high,
    note. Every rater must have rated every target once: `missing` leaves out targets or raters with gaps,
    `aggregate="mean"` averages repetitions, and `attrs` say how many.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    """
    demand_confidence(confidence)
    if not isinstance(missing, str) or missing not in GAPS:
        raise BadOption(f"missing={shown(missing)} is unknown: one of {', '.join(map(repr, GAPS))}")
    table = cross_table(data, dv, targets, raters, gaps=GAPS[missing], aggregate=aggregate)  # type: ignore[arg-type]
    refuse_few(table, f"targets ({targets})", f"raters ({raters})")
    coefficients = pd.DataFrame(iccs(table.values, confidence)).rename(columns={"icc": "ICC", "f": "F"})
    coefficients.attrs.update(table.attrs("targets", "raters") | {"confidence": confidence})
    return coefficients


def demand_confidence(confidence: object) -> None:
    """Raise BadOption unless the confidence is strictly between 0 and 1."""
    if not isinstance(confidence, int | float) or not 0 < confidence < 1:
        raise BadOption(f"confidence={shown(confidence)}: a number between 0 and 1 is expected, such as 0.95")


def iccs(values: Floats, confidence: float = 0.95) -> list[Icc]:
    """Return the six intraclass correlations of an array (targets, raters), at least 2 by 2, without gaps."""
    ms, tail = mean_squares(values), (1 - confidence) / 2
    n, k = ms.n, ms.k
    one = _ratio(ms.rows, ms.within, n - 1, n * (k - 1), tail)
    two = _ratio(ms.rows, ms.residual, n - 1, (n - 1) * (k - 1), tail)
    agreement = absolute(ms)
    mean_agreement = _share(ms.rows - ms.residual, ms.rows + (ms.columns - ms.residual) / n)
    single = _agreement_limits(ms, agreement if mean_agreement <= 1 else math.nan, tail)
    # Stepped up by Spearman-Brown; NaN where a limit lies so low that the mean of k ratings would have no variance.
    stepped_up = [k * limit / total if (total := 1 + (k - 1) * limit) > 0 else math.nan for limit in single]
    return [
        _row("ICC1", _share(ms.rows - ms.within, ms.rows + (k - 1) * ms.within), one, *_single_limits(one, k)),
        _row("ICC2", agreement, two, *_agreement_limits(ms, agreement, tail)),
        _row("ICC3", _share(ms.rows - ms.residual, ms.rows + (k - 1) * ms.residual), two, *_single_limits(two, k)),
        _row("ICC1k", _share(ms.rows - ms.within, ms.rows), one, 1 - 1 / one.low, 1 - 1 / one.high),
        _row("ICC2k", mean_agreement, two, *stepped_up),
        _row("ICC3k", _share(ms.rows - ms.residual, ms.rows), two, 1 - 1 / two.low, 1 - 1 / two.high),
    ]


def absolute(ms: MeanSquares) -> float:
    """Return ICC(A,1), the agreement of single ratings; NaN if the variance of a rating has no positive estimate."""
    total = ms.rows + (ms.k - 1) * ms.residual + ms.k * (ms.columns - ms.residual) / ms.n
    return _share(ms.rows - ms.residual, total)


def _share(part: float, total: float) -> float:
    return part / total if total > 0 else math.nan


def _ratio(top: float, bottom: float, df1: int, df2: int, tail: float) -> _F:
    if bottom == 0 or top == 0:
        f = math.nan if bottom == 0 else 0.0
        return _F(f, df1, df2, math.nan, math.nan)
    f = top / bottom
    return _F(f, df1, df2, f / f_upper(tail, df1, df2), f * f_upper(tail, df2, df1))


def _single_limits(f: _F, k: int) -> tuple[float, float]:
    """Return the limits of single ratings (Shrout & Fleiss 1979, p. 424 and 425)."""
    return (f.low - 1) / (f.low + k - 1), (f.high - 1) / (f.high + k - 1)


def _agreement_limits(ms: MeanSquares, estimate: float, tail: float) -> tuple[float, float]:
    """Return Satterthwaite's limits of ICC(A,1) (McGraw & Wong 1996, table 7; Shrout & Fleiss 1979, p. 424)."""
    if ms.residual == 0 or ms.rows == 0 or math.isnan(estimate):
        return math.nan, math.nan
    n, k = ms.n, ms.k
    raters = k * estimate * (ms.columns / ms.residual)
    rest = n * (1 + (k - 1) * estimate) - k * estimate
    bottom = (n - 1) * raters**2 + rest**2
    if bottom == 0:
        return math.nan, math.nan
    df = (k - 1) * (n - 1) * (raters + rest) ** 2 / bottom
    if df <= 0:
        return math.nan, math.nan
    upper, lower = f_upper(tail, n - 1, df), f_upper(tail, df, n - 1)
    shared = k * ms.columns + (k * n - k - n) * ms.residual
    low = n * (ms.rows - upper * ms.residual) / (upper * shared + n * ms.rows)
    high = n * (lower * ms.rows - ms.residual) / (shared + n * lower * ms.rows)
    # With few degrees of freedom the approximation can miss the estimate that it is about: then it says nothing.
    return (low, high) if low <= estimate <= high else (math.nan, math.nan)


def _row(kind: str, estimate: float, f: _F, low: float, high: float) -> Icc:
    name, description = NAMES[kind]
    p = f_tail(f.value, f.df1, f.df2)
    notes = []
    if math.isnan(estimate):
        alike = "undefined: the targets do not differ and the ratings of a target agree"
        notes.append(NO_TOTAL if f.value >= 0 else alike)
    elif estimate < 0:
        notes.append(NEGATIVE)
    if math.isnan(f.value) and not math.isnan(estimate):
        notes.append("the raters agree exactly, or but for a constant of each: F and the interval are undefined")
    elif f.value == 0:
        notes.append("the targets' means are equal: F = 0 and the interval is undefined")
    elif not math.isnan(estimate) and (math.isnan(low) or math.isnan(high)):
        notes.append("the interval has no lower limit" if not math.isnan(high) else NO_LIMITS)
    note = "; ".join(filter(None, [*notes, p_note([p])]))
    return Icc(kind, name, description, estimate, f.value, f.df1, f.df2, p, low, high, note)


@dataclass(frozen=True)
class MeanSquares:
    """Mean squares of n rows by k columns: between rows, between columns, residual, and within rows.

    They are in units of a power of two squared, so that no square overflows, since only their ratios matter. A mean
    square that is only rounding is 0.
    """

    rows: float
    columns: float
    residual: float
    within: float
    n: int
    k: int
    exponent: int


def mean_squares(values: Floats) -> MeanSquares:
    """Return the two-way decomposition of an array (rows, columns), each at least 2 (Shrout & Fleiss 1979, table 3)."""
    n, k = values.shape
    x, exponent = scaled(values)
    plain: Pair = (x, None)
    by_row = differences(plain, 0)
    noise = x.size * ROUNDING**2
    sums = (component(by_row, (0,), 0)[1], component(plain, (1,))[1], component(by_row, (0, 1), 0)[1])
    rows, columns, residual = (ss if ss > noise else 0.0 for ss in sums)
    free = (n - 1) * (k - 1)
    return MeanSquares(
        rows / (n - 1), columns / (k - 1), residual / free, (columns + residual) / (n * (k - 1)), n, k, exponent
    )
