"""The sums of every group in every within cell as integers, and the sums of squares of effects made from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from palpate.analysis.statistics.doubles import Floats, exact_sum
from palpate.analysis.statistics.hypotheses import Effect, Form, Projection, SumOfSquares, Whole, form, subsets
from palpate.analysis.statistics.memberships import Membership


@dataclass(frozen=True)
class GroupSums:
    """`sums` (groups, levels of within factor 1, ...) in units of 1 / `unit`, and each between effect's form."""

    sums: Whole
    unit: int
    forms: dict[Effect, Form | Projection]

    def effect(self, between: Effect, axes: tuple[int, ...]) -> tuple[int, Fraction]:
        """Rank between groups and sum of squares of an effect."""
        found = self.forms[between]
        kept = math.prod(self.sums.shape[axis] for axis in axes)
        scale = math.prod(self.sums.shape[1:]) * kept * self.unit**2
        return found.df, found.of(within_part(self.sums, axes)) / scale


def group_sums(x: Floats, groups: Membership, kind: SumOfSquares) -> GroupSums:
    """The sums of the groups of an array (participants, levels of within factor 1, ...), to twice double precision.

    They are sums of deviations from one value of the data, which no effect depends on.
    """
    pivot, rows = float(x.flat[0]), x.reshape(len(x), -1)
    found = [[exact_sum(column, pivot) for column in rows[group].T] for group in groups.groups]
    unit = max(value.denominator for row in found for value in row)
    whole = np.array([[value.numerator * (unit // value.denominator) for value in row] for row in found], dtype=object)
    return GroupSums(whole.reshape(len(groups.groups), *x.shape[1:]), unit, forms_of(groups, kind))


def forms_of(groups: Membership, kind: SumOfSquares) -> dict[Effect, Form | Projection]:
    """The form of every effect between groups, the mean of all among them."""
    levels = [len(own) for own in groups.levels]
    return {effect: form(levels, groups.sizes, effect, kind) for effect in subsets(len(levels))}


def within_part(sums: Whole, axes: tuple[int, ...]) -> Whole:
    """The sums (groups, ...) summed over all within axes but these and centred along these, times their sizes."""
    others = tuple(axis for axis in range(1, sums.ndim) if axis not in axes)
    part = np.asarray(sums.sum(axis=others)) if others else sums
    for axis in range(1, part.ndim):
        part = part.shape[axis] * part - part.sum(axis=axis, keepdims=True)
    return part.reshape(len(sums), -1)
