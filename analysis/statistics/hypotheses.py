"""Sums of squares of effects between groups of any sizes, types II and III, in exact integers.

The full factorial model of the groups has as many parameters as groups, so every sum of squares is a quadratic form of
the groups' sums: with X the columns of the effect, X0 those of the effects that it is adjusted for (sum-to-zero
coding), D the group sizes and t the sums of the groups,

    A = X' - X'D X0 (X0'D X0)^-1 X0'      SS = (A t)' (A D X)^-1 (A t)

Type III adjusts an effect for all others, type II for all that do not contain it (Fox 2016, Applied Regression
Analysis, 8.2.5; R's car::Anova). Integers cost little for few groups, and huge differences between groups cannot cost
another effect its digits. Many groups of several factors and of different sizes (more than `EXACT_GROUPS`) are
projected in doubles, on deviations from the exact mean.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.statistics.doubles import Floats, exact_sum
from palpate.analysis.statistics.groups import Membership

SumOfSquares: TypeAlias = Literal["II", "III"]
Whole: TypeAlias = NDArray[Any]  # of Python integers, which have no end
Effect: TypeAlias = tuple[int, ...]
EXACT_GROUPS = 24
"""The most groups for exact elimination, which then takes some hundredths of a second and grows faster than cubically.
"""


@dataclass(frozen=True)
class Form:
    """An effect's sum of squares as a quadratic form t' (top / bottom) t of the groups' sums t; `df` is its rank."""

    df: int
    top: Whole
    bottom: int

    exact = True

    def of(self, sums: Whole) -> Fraction:
        """Return the sum of the form over the columns of `sums` (groups, columns)."""
        return Fraction(int((sums * (self.top @ sums)).sum()), self.bottom)


@dataclass(frozen=True)
class Projection:
    """The form in doubles: the squared length of the groups' weighted means along the columns of `basis`."""

    df: int
    basis: Floats
    sizes: tuple[int, ...]

    exact = False

    def of(self, sums: Whole) -> Fraction:
        """Return what `Form.of` does, rounded; the overall mean, which no effect here involves, is removed exactly."""
        total = sum(self.sizes)
        sizes = np.array(self.sizes, dtype=object)[:, None]
        deviations = total * sums - sizes * sums.sum(axis=0)
        largest = max(1, *(abs(int(value)) for value in deviations.flat))
        unit = 1 << largest.bit_length()
        means = np.array([[int(value) / unit for value in row] for row in deviations])
        weighted = means / np.sqrt(np.array(self.sizes, dtype=np.float64))[:, None]
        return Fraction(float(np.sum((self.basis.T @ weighted) ** 2))) * Fraction(unit, total) ** 2


def form(levels: Sequence[int], sizes: Sequence[int], effect: Effect, kind: SumOfSquares) -> Form | Projection:
    """Return the quadratic form of one effect: a set of factors by index, () for the overall mean.

    `levels` are the factors' numbers of levels, `sizes` how many participants each of their combinations has, with the
    last factor varying fastest; all at least 1.
    """
    if len(set(sizes)) == 1:
        # Groups of one size: types II and III are one, the projection on the effect divided by that size.
        size = sizes[0]
        top = np.ones((1, 1), dtype=object)
        for place, count in enumerate(levels):
            ones = np.ones((count, count), dtype=object)
            top = np.kron(top, count * np.eye(count, dtype=int).astype(object) - ones if place in effect else ones)
        df = math.prod(levels[place] - 1 for place in effect)
        return _reduced(df, top, int(size) * math.prod(levels))
    if not effect:
        # The form of the mean of all: of participants for type II, which adjusts it for nothing, else of groups.
        if kind == "II":
            return Form(1, np.ones((len(sizes),) * 2, dtype=object), sum(map(int, sizes)))
        common = math.lcm(*map(int, sizes))
        weights = np.array([common // int(size) for size in sizes], dtype=object)
        return _reduced(1, np.outer(weights, weights), common * int(weights.sum()))
    if len(levels) == 1:
        # sum t^2 / n - (sum t)^2 / N.
        common, total = math.lcm(*map(int, sizes)), sum(map(int, sizes))
        shares = [total * (common // int(size)) for size in sizes]
        return _reduced(len(sizes) - 1, np.diag(np.array(shares, dtype=object)) - common, common * total)
    own = _columns(levels, effect)
    others = list(subsets(len(levels)))
    if kind == "III":
        adjusted_for = [other for other in others if other != effect]
    else:
        adjusted_for = [other for other in others if not set(effect) <= set(other)]
    rest = np.concatenate([_columns(levels, other) for other in adjusted_for], axis=1)
    return (_eliminated if len(sizes) <= EXACT_GROUPS else _projected)(own, rest, sizes)


def _eliminated(own: Whole, rest: Whole, sizes: Sequence[int]) -> Form:
    weights = np.array(list(map(int, sizes)), dtype=object)[:, None]
    solved, scale = _solved(rest.T @ (weights * rest), rest.T)
    rows = scale * own.T - (weights * own).T @ rest @ solved
    answers, bottom = _solved(rows @ (weights * own), rows)
    return _reduced(own.shape[1], rows.T @ answers, bottom * scale)


def _projected(own: Whole, rest: Whole, sizes: Sequence[int]) -> Projection:
    roots = np.sqrt(np.array(sizes, dtype=np.float64))[:, None]
    known = np.linalg.qr(roots * rest.astype(np.float64))[0]
    new = roots * own.astype(np.float64)
    for _ in range(2):  # twice is enough (Parlett 1998, 6.9)
        new = new - known @ (known.T @ new)
    return Projection(own.shape[1], np.linalg.qr(new)[0].astype(np.float64), tuple(map(int, sizes)))


def subsets(factors: int, first: int = 0) -> Iterator[Effect]:
    """Yield every set of factors by index, from the empty one to all of them; indices begin at `first`."""
    for size in range(factors + 1):
        yield from combinations(range(first, first + factors), size)


def _columns(levels: Sequence[int], effect: Effect) -> Whole:
    """Return the columns of an effect, one row per group, coded to sum to zero over the levels of each factor."""
    columns = np.ones((1, 1), dtype=object)
    for place, count in enumerate(levels):
        one = np.ones((count, 1), dtype=object)
        coding = np.concatenate((np.eye(count - 1, dtype=int).astype(object), -one[:1].repeat(count - 1, axis=1)))
        columns = np.kron(columns, coding if place in effect else one)
    return columns


def _solved(matrix: Whole, right: Whole) -> tuple[Whole, int]:
    """Return X and s with matrix X = s right, all integers; matrix is positive definite (Bareiss 1968)."""
    size = len(matrix)
    table = np.concatenate((matrix, right), axis=1)
    last = 1
    for k in range(size):
        pivot, row = int(table[k, k]), table[k].copy()
        table = (pivot * table - table[:, k : k + 1] * row) // last
        table[k] = row
        last = pivot
    return table[:, size:], last


def _reduced(df: int, top: Whole, bottom: int) -> Form:
    common = math.gcd(bottom, *(int(value) for value in top.flat))
    return Form(df, top // common, bottom // common)


@dataclass(frozen=True)
class GroupSums:
    """Sums of groups, `sums` (groups, levels of within factor 1, ...) in units of 1 / `unit`, and between effects'
    forms.
    """

    sums: Whole
    unit: int
    forms: dict[Effect, Form | Projection]

    def effect(self, between: Effect, axes: tuple[int, ...]) -> tuple[int, Fraction]:
        """Return the rank between groups and the sum of squares of an effect."""
        form = self.forms[between]
        size = math.prod(self.sums.shape[axis] for axis in axes)
        scale = math.prod(self.sums.shape[1:]) * size * self.unit**2
        return form.df, form.of(within_part(self.sums, axes)) / scale


def group_sums(x: Floats, groups: Membership, kind: SumOfSquares) -> GroupSums:
    """Return the groups' sums of an array (participants, levels of within factor 1, ...), to twice double precision.

    They are sums of deviations from one value of the data, which no effect depends on.
    """
    pivot, rows = float(x.flat[0]), x.reshape(len(x), -1)
    sums = [[exact_sum(column, pivot) for column in rows[group].T] for group in groups.groups]
    unit = max(value.denominator for row in sums for value in row)
    whole = np.array([[value.numerator * (unit // value.denominator) for value in row] for row in sums], dtype=object)
    return GroupSums(whole.reshape(len(groups.groups), *x.shape[1:]), unit, forms_of(groups, kind))


def forms_of(groups: Membership, kind: SumOfSquares) -> dict[Effect, Form | Projection]:
    """Return the form of every effect between groups, including the overall mean."""
    levels = [len(own) for own in groups.levels]
    return {effect: form(levels, groups.sizes, effect, kind) for effect in subsets(len(levels))}


def within_part(sums: Whole, axes: tuple[int, ...]) -> Whole:
    """Return the sums (groups, ...) over all other within axes, centred along these, times their sizes."""
    others = tuple(axis for axis in range(1, sums.ndim) if axis not in axes)
    part = np.asarray(sums.sum(axis=others)) if others else sums
    for axis in range(1, part.ndim):
        part = part.shape[axis] * part - part.sum(axis=axis, keepdims=True)
    return part.reshape(len(sums), -1)
