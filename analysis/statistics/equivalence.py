"""Equivalence tests: two one-sided t tests of every pair of levels of one factor (Schuirmann 1987; Lakens 2017)."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import asdict, dataclass
from numbers import Real

import pandas as pd

from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.f_and_t import p_note, t_critical, t_upper
from palpate.analysis.statistics.pairwise import Comparison, Comparisons, compare_levels
from palpate.analysis.statistics.refusals import BadOption, shown


@dataclass(frozen=True)
class Equivalence:
    """One pair, A minus B: `p_low` tests that the difference is above the lower bound, `p_high` below the upper."""

    Contrast: str
    A: Hashable
    B: Hashable
    Paired: bool
    mean_diff: float
    bound_low: float
    bound_high: float
    T_low: float
    T_high: float
    dof: float
    p_low: float
    p_high: float
    p: float
    ci_low: float
    ci_high: float
    equivalent: bool | None
    note: str


def equivalence_tests(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    bounds: Sequence[float] | None = None,
    bounds_dz: float | None = None,
    within: Hashable | Iterable[Hashable] | None = None,
    subject: Hashable | None = None,
    between: Hashable | Iterable[Hashable] | None = None,
    alpha: float = 0.05,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return the two one-sided tests (TOST) of every pair of levels, A minus B: one row per pair.

    Give `bounds`, a lower and an upper one in the unit of the values, or `bounds_dz`, one number: the bounds are that
    many standard deviations of the differences (between groups: pooled standard deviations) to either side of 0, as
    estimated from the data. `p` is the larger of the two one-sided p, `equivalent` says whether it is below `alpha`,
    which is equivalent to whether the interval of 1 - 2 alpha (`ci_low`, `ci_high`) lies within the bounds. t is the
    one of `pairwise_tests`: paired, pooled for groups of one size, Welch's otherwise. No p is adjusted for a family. A
    pair whose values do not vary has NaN and None with a `note`. Raises a StatisticsError (a ValueError) that names
    what is wrong with the table or the request.
    """
    if (bounds is None) == (bounds_dz is None):
        raise BadOption("give either `bounds`, a lower and an upper one, or `bounds_dz`, one number")
    ends = (-bounds_dz, bounds_dz) if _is_number(bounds_dz) and bounds_dz is not None else bounds
    if not isinstance(ends, Sequence) or isinstance(ends, str) or len(ends) != 2:
        raise BadOption(f"bounds={shown(bounds if bounds_dz is None else bounds_dz)} are not two numbers")
    low, high = ends
    if not all(_is_number(end) and math.isfinite(end) for end in (low, high)) or not low < high:
        raise BadOption(f"bounds ({low}, {high}) cannot be: the lower one must be a finite number below the upper")
    limits = float(low), float(high)
    if isinstance(alpha, bool) or not isinstance(alpha, int | float) or not 0 < alpha < 0.5:
        raise BadOption(f"alpha={shown(alpha)} is unknown: a number above 0 and below 0.5, such as 0.05")
    comparisons = compare_levels(data, dv, within, subject, between, missing, aggregate)
    rows = []
    for pair in comparisons.pairs:
        own = limits if bounds_dz is None else (limits[0] * pair.spread, limits[1] * pair.spread)
        rows.append(asdict(_tested(comparisons, pair, own, alpha)))
    table = pd.DataFrame(rows).astype({"equivalent": object})
    table.attrs.update(comparisons.attrs | {"alpha": alpha})
    return table


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _tested(comparisons: Comparisons, pair: Comparison, bounds: tuple[float, float], alpha: float) -> Equivalence:
    low, high = bounds
    undefined = bool(pair.note)
    t_low, t_high = ((math.nan if undefined else (pair.mean - end) / pair.error) for end in bounds)
    p_low, p_high = t_upper(t_low, pair.df), t_upper(-t_high, pair.df)
    p = math.nan if undefined else max(p_low, p_high)
    half = t_critical(pair.df, 1 - 2 * alpha) * pair.error
    return Equivalence(
        *(
            str(comparisons.factor),
            pair.a,
            pair.b,
            comparisons.within,
            pair.mean,
            low,
            high,
            t_low,
            t_high,
            float(pair.df),
        ),
        *(p_low, p_high, p, pair.mean - half, pair.mean + half, None if undefined else p < alpha),
        pair.note or p_note([p_low, p_high]),
    )
