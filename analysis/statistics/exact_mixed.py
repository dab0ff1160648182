"""Any complete design in exact rational arithmetic: factors within participants, between them, or both."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from itertools import product

import numpy as np

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.exact import (
    ExactEffect,
    exact_epsilon,
    exact_ratio,
    integers,
    part_ss,
    summed_part,
)
from palpate.analysis.statistics.group_sums import GroupSums, forms_of
from palpate.analysis.statistics.hypotheses import SumOfSquares, Whole, subsets
from palpate.analysis.statistics.mixed import Design


def exact_mixed(design: Design, kind: SumOfSquares) -> list[ExactEffect]:
    """Every effect of a design, exact, in the order of `mixed_anova`; the values are taken as the doubles they are."""
    values: Floats = design.cells.values
    flat, unit = integers(values.ravel().tolist())
    whole = np.array(flat, dtype=object).reshape(values.shape)
    parts = [whole[group] for group in design.groups.groups]
    errors = {axes: _error(parts, axes) for axes in subsets(values.ndim - 1, first=1)}
    rest = sum((ss for ss, _ in errors.values()), Fraction(0))
    sums = GroupSums(np.array([part.sum(axis=0) for part in parts], dtype=object), 1, forms_of(design.groups, kind))
    return list(_effects(design, sums, errors, (unit, rest)))


def _effects(
    design: Design,
    sums: GroupSums,
    errors: dict[tuple[int, ...], tuple[Fraction, Fraction | None]],
    scale: tuple[Fraction, Fraction],
) -> Iterator[ExactEffect]:
    unit, rest = scale
    for axes, between in design.terms():
        error, eps = errors[axes]
        rank, ss = sums.effect(between, axes)
        d = math.prod(design.cells.values.shape[axis] - 1 for axis in axes)
        df1, df2 = d * rank, d * design.error_df
        f, partial, generalized = exact_ratio(ss * df2, error * df1), *(exact_ratio(ss, ss + r) for r in (error, rest))
        yield ExactEffect(design.source(between, axes), ss * unit, error * unit, df1, df2, f, eps, partial, generalized)


def _error(parts: list[Whole], axes: tuple[int, ...]) -> tuple[Fraction, Fraction | None]:
    """The error sum of squares within groups, and epsilon, of one set of within axes."""
    common = math.lcm(*map(len, parts))
    ss, residual = Fraction(0), []
    for part in parts:
        table = dict(zip(product(*map(range, part.shape)), part.ravel().tolist(), strict=True))
        own = summed_part(table, part.shape, (0, *axes))
        ss += part_ss(own, part.shape, (0, *axes))
        residual += [value * (common // len(part)) for value in own.values()]
    d = math.prod(parts[0].shape[axis] - 1 for axis in axes)
    return ss, exact_epsilon(residual, sum(map(len, parts)), d) if axes else None
