"""An analysis of variance held against exact rational arithmetic on the same doubles."""

from __future__ import annotations

import math
from collections.abc import Hashable
from fractions import Fraction
from typing import Any

import pandas as pd

from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.effects import Effect
from palpate.analysis.statistics.exact import ExactEffect
from palpate.analysis.statistics.exact_mixed import exact_mixed
from palpate.analysis.statistics.group_sums import forms_of
from palpate.analysis.statistics.hypotheses import EXACT_GROUPS, SumOfSquares
from palpate.analysis.statistics.mixed import Design, Names, gather_design, mixed_effects, refuse_unknown_type

MOST_VALUES = 20_000
NUMBERS = ("ss", "ss_error", "f", "eps", "np2", "ng2")


def self_check(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Names = None,
    between: Names = None,
    subject: Hashable | None = None,
    sum_of_squares: SumOfSquares = "III",
    missing: Missing = "raise",
    aggregate: Aggregate = None,
    most: int = MOST_VALUES,
) -> pd.DataFrame:
    """How far `mixed_anova` (so `rm_anova` and `anova`) is from exact arithmetic on the same values: a row per effect.

    `difference` is the largest relative difference over SS, error SS, F, epsilon and both eta squared, `number` the
    one that differs most, `exact_F` the exact F rounded once. `checked` is False, with a `note`, for a table of more
    than `most` values (0.02 s for 40 participants x 45 conditions; the time grows with participants x conditions
    squared) and for an effect without F. The values are taken as the doubles they are, after any averaging.
    Raises a StatisticsError as `mixed_anova` does.
    """
    refuse_unknown_type(sum_of_squares, within, between)
    design = gather_design(data, dv, within, between, subject, missing, aggregate)
    found = [effect for _, effect in mixed_effects(design, sum_of_squares)]
    if note := _beyond(design, sum_of_squares, most):
        return pd.DataFrame([_row(effect, math.nan, "", None, note) for effect in found])
    exact = exact_mixed(design, sum_of_squares)
    return pd.DataFrame([_checked(*pair) for pair in zip(found, exact, strict=True)])


def _beyond(design: Design, kind: SumOfSquares, most: int) -> str:
    """Why a design is not checked, or ""."""
    size, groups = design.cells.values.size, len(design.groups.groups)
    if size > most:
        return f"not checked: {size:,} values, more than {most:,}"
    if not all(form.exact for form in forms_of(design.groups, kind).values()):
        return f"not checked: {groups} groups of different sizes by several factors, more than {EXACT_GROUPS}"
    return ""


def _checked(effect: Effect, exact: ExactEffect) -> dict[str, Any]:
    if math.isnan(effect.f):
        return _row(effect, math.nan, "", exact.f, f"not checked: {effect.note}")
    pairs = {name: (getattr(effect, name), getattr(exact, name)) for name in NUMBERS}
    apart = {name: _apart(*pair) for name, pair in pairs.items() if pair[1] is not None}
    worst = max(apart, key=apart.__getitem__)
    return _row(effect, apart[worst], worst, exact.f, effect.note)


def _apart(found: float, expected: Fraction) -> float:
    """The relative difference, without rounding; the absolute one where 0 is expected, infinite for no number."""
    if not math.isfinite(found):
        return math.inf
    return float(abs(Fraction(found) - expected) / (abs(expected) or 1))


def _row(effect: Effect, difference: float, number: str, exact: Fraction | None, note: str) -> dict[str, Any]:
    return {
        "Source": effect.source,
        "F": effect.f,
        "exact_F": math.nan if exact is None else float(exact),
        "difference": difference,
        "number": number,
        "checked": not math.isnan(difference),
        "note": note,
    }
