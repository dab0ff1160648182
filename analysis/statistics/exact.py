"""Analyses of variance in exact rational arithmetic, and a self-check of the doubles against it.

Every double is a fraction whose denominator is a power of two, so the data become integers by one common factor,
and only the last divisions make fractions. Slow (seconds for a million values), never rounded.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, product
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.statistics.anova import Effect
from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.hypotheses import EXACT_GROUPS, GroupSums, SumOfSquares, forms_of, subsets
from palpate.analysis.statistics.mixed_anova import Design, Names, gather_design, mixed_effects, refuse_unknown_type

Cells: TypeAlias = dict[tuple[int, ...], int]
MOST_VALUES = 20_000
NUMBERS = ("ss", "ss_error", "f", "eps", "np2", "ng2")


@dataclass(frozen=True)
class ExactEffect:
    """One exact effect; None for an undefined statistic (no residual variation)."""

    source: str
    ss: Fraction
    ss_error: Fraction
    df1: int
    df2: int
    f: Fraction | None
    eps: Fraction | None
    np2: Fraction | None
    ng2: Fraction | None


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
    """Return how far `mixed_anova` (so `rm_anova` and `anova`) is from exact arithmetic: one row per effect.

    `difference` is the largest relative difference over SS, error SS, F, epsilon and both eta squared, `number` the one
    that differs most, `exact_F` the exact F rounded once. `checked` is False, with a `note`, for a table of more than
    `most` values (0.02 s for 40 participants x 45 conditions; the time grows with participants x conditions squared)
    and for an effect without F. The doubles are used after any averaging. Raises a StatisticsError as `mixed_anova`
    does.
    """
    refuse_unknown_type(sum_of_squares, within, between)
    design = gather_design(data, dv, within, between, subject, missing, aggregate)
    effects = [effect for _, effect in mixed_effects(design, sum_of_squares)]
    size, groups = design.cells.values.size, len(design.groups.groups)
    note = ""
    if size > most:
        note = f"not checked: {size:,} values, more than {most:,}"
    elif not all(form.exact for form in forms_of(design.groups, sum_of_squares).values()):
        note = f"not checked: {groups} groups of different sizes by several factors, more than {EXACT_GROUPS}"
    if note:
        return pd.DataFrame([_row(effect, math.nan, "", None, note) for effect in effects])
    exact = exact_mixed(design, sum_of_squares)
    rows = []
    for effect, expected in zip(effects, exact, strict=True):
        if math.isnan(effect.f):
            rows.append(_row(effect, math.nan, "", expected.f, f"not checked: {effect.note}"))
            continue
        # Relative differences, without rounding; absolute where 0 is expected, infinite for no number.
        apart: dict[str, float] = {}
        for name in NUMBERS:
            value, whole = getattr(effect, name), getattr(expected, name)
            if whole is not None:
                relative = abs(Fraction(value) - whole) / (abs(whole) or 1) if math.isfinite(value) else math.inf
                apart[name] = float(relative)
        worst = max(apart, key=apart.__getitem__)
        rows.append(_row(effect, apart[worst], worst, expected.f, effect.note))
    return pd.DataFrame(rows)


def exact_within(
    values: Iterable[float], shape: Sequence[int], names: Sequence[str], epsilon: bool = True
) -> list[ExactEffect]:
    """Return the effects of a full factorial table in row-major order, shape (participants, levels of factor 1, ...).

    `epsilon=False` leaves out the Greenhouse-Geisser epsilon, which costs participants x cells^2 products.
    """
    whole, unit = integers(values)
    table = dict(zip(product(*map(range, shape)), whole, strict=True))
    subject_ss = part_ss(summed_part(table, shape, (0,)), shape, (0,)) * unit
    # Effect and error sum of squares, and epsilon.
    sums = []
    for axes in _subsets(len(names)):
        residual = summed_part(table, shape, (0, *axes))
        df = math.prod(shape[axis] - 1 for axis in axes)
        eps = exact_epsilon(list(residual.values()), shape[0], df) if epsilon else None
        sums.append(
            (
                part_ss(summed_part(table, shape, axes), shape, axes) * unit,
                part_ss(residual, shape, (0, *axes)) * unit,
                eps,
            )
        )
    rest = subject_ss + sum((error for _, error, _ in sums), Fraction(0))
    effects = []
    for axes, (ss, error, eps) in zip(_subsets(len(names)), sums, strict=True):
        source = ":".join(names[axis - 1] for axis in axes)
        df1 = math.prod(shape[axis] - 1 for axis in axes)
        df2 = df1 * (shape[0] - 1)
        f, partial, generalized = exact_ratio(ss * df2, error * df1), *(exact_ratio(ss, ss + r) for r in (error, rest))
        effects.append(ExactEffect(source, ss, error, df1, df2, f, eps, partial, generalized))
    return effects


def integers(values: Iterable[float]) -> tuple[list[int], Fraction]:
    """Return the values as integers, and the square of their common unit."""
    ratios = [float(value).as_integer_ratio() for value in values]
    denominator = max(bottom for _, bottom in ratios)
    return [top * (denominator // bottom) for top, bottom in ratios], Fraction(1, denominator**2)


def _subsets(factors: int) -> Iterator[tuple[int, ...]]:
    for size in range(1, factors + 1):
        yield from combinations(range(1, factors + 1), size)


def summed_part(table: Cells, shape: Sequence[int], axes: Sequence[int]) -> Cells:
    """Return the table summed over all other axes and centred along these, times their sizes."""
    part: Cells = {}
    for where, value in table.items():
        key = tuple(where[axis] for axis in axes)
        part[key] = part.get(key, 0) + value
    for place, axis in enumerate(axes):
        sums: Cells = {}
        for where, value in part.items():
            key = where[:place] + where[place + 1 :]
            sums[key] = sums.get(key, 0) + value
        part = {where: shape[axis] * value - sums[where[:place] + where[place + 1 :]] for where, value in part.items()}
    return part


def part_ss(part: Cells, shape: Sequence[int], axes: Sequence[int]) -> Fraction:
    """Return the sum of squares of a `summed_part`."""
    size = math.prod(shape[axis] for axis in axes)
    return Fraction(sum(value * value for value in part.values()) * size, math.prod(shape) * size**2)


def exact_epsilon(residual: list[int], n: int, df: int) -> Fraction | None:
    """Return tr(S)^2 / (df tr(S^2)) from the residuals of each participant in turn."""
    k = len(residual) // n
    columns = [residual[i::k] for i in range(k)]
    rows = [residual[i : i + k] for i in range(0, len(residual), k)]
    vectors = columns if k <= n else rows
    squares = sum(sum(a * b for a, b in zip(u, v, strict=True)) ** 2 for u, v in product(vectors, vectors))
    trace = sum(value * value for value in residual)
    return Fraction(trace**2, df * squares) if squares else None


def exact_ratio(top: Fraction, bottom: Fraction) -> Fraction | None:
    """Return top / bottom, None if bottom is zero."""
    return top / bottom if bottom else None


def exact_mixed(design: Design, kind: SumOfSquares) -> list[ExactEffect]:
    """Return every effect of a design in exact arithmetic, in the order of `mixed_anova`."""
    values: Floats = design.cells.values
    flat, unit = integers(values.ravel().tolist())
    whole = np.array(flat, dtype=object).reshape(values.shape)
    parts = [whole[group] for group in design.groups.groups]
    # The error sum of squares within groups, and epsilon, of one set of within axes.
    errors = {}
    for axes in subsets(values.ndim - 1, first=1):
        common = math.lcm(*map(len, parts))
        ss, residual = Fraction(0), []
        for part in parts:
            table = dict(zip(product(*map(range, part.shape)), part.ravel().tolist(), strict=True))
            own = summed_part(table, part.shape, (0, *axes))
            ss += part_ss(own, part.shape, (0, *axes))
            residual += [value * (common // len(part)) for value in own.values()]
        d = math.prod(parts[0].shape[axis] - 1 for axis in axes)
        errors[axes] = (ss, exact_epsilon(residual, sum(map(len, parts)), d) if axes else None)
    rest = sum((ss for ss, _ in errors.values()), Fraction(0))
    sums = GroupSums(np.array([part.sum(axis=0) for part in parts], dtype=object), 1, forms_of(design.groups, kind))
    effects = []
    for axes, between in design.terms():
        error, eps = errors[axes]
        rank, ss = sums.effect(between, axes)
        d = math.prod(values.shape[axis] - 1 for axis in axes)
        df1, df2 = d * rank, d * design.error_df
        f, partial, generalized = exact_ratio(ss * df2, error * df1), *(exact_ratio(ss, ss + r) for r in (error, rest))
        source = design.source(between, axes)
        effects.append(ExactEffect(source, ss * unit, error * unit, df1, df2, f, eps, partial, generalized))
    return effects


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
