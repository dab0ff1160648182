"""The same statistics in exact rational arithmetic: the oracle that tests and benchmarks hold the doubles against.

Every double is a fraction whose denominator is a power of two, so the data become integers by one common factor,
and only the last divisions make fractions. Slow (seconds for a million values), never rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, product
from typing import TypeAlias

Cells: TypeAlias = dict[tuple[int, ...], int]


@dataclass(frozen=True)
class ExactEffect:
    """One effect, exact; None where a statistic is undefined (no residual variation)."""

    source: str
    ss: Fraction
    ss_error: Fraction
    df1: int
    df2: int
    f: Fraction | None
    eps: Fraction | None
    np2: Fraction | None
    ng2: Fraction | None


def exact_within(
    values: Iterable[float], shape: Sequence[int], names: Sequence[str], epsilon: bool = True
) -> list[ExactEffect]:
    """Effects of a full factorial table given in row-major order, shape (participants, levels of factor 1, ...).

    `epsilon=False` leaves out the Greenhouse-Geisser epsilon, which costs participants x cells^2 products.
    """
    whole, unit = integers(values)
    table = dict(zip(product(*map(range, shape)), whole, strict=True))
    subject_ss = part_ss(summed_part(table, shape, (0,)), shape, (0,)) * unit
    found = [_parts(table, shape, axes, unit, epsilon) for axes in _subsets(len(names))]
    rest = subject_ss + sum((error for _, error, _ in found), Fraction(0))
    return [
        _effect(":".join(names[axis - 1] for axis in axes), shape, axes, *parts, rest)
        for axes, parts in zip(_subsets(len(names)), found, strict=True)
    ]


def exact_one_way(groups: Sequence[Sequence[float]]) -> ExactEffect:
    """One-way ANOVA between groups of any sizes; epsilon is None, generalized eta squared the classical one."""
    whole, unit = integers(value for group in groups for value in group)
    numbers, n = iter(whole), len(whole)
    parts = [[next(numbers) for _ in group] for group in groups]
    sums = sum((Fraction(sum(part) ** 2, len(part)) for part in parts), Fraction(0))
    ss = (sums - Fraction(sum(whole) ** 2, n)) * unit
    error = (sum(value * value for value in whole) - sums) * unit
    df1, df2 = len(groups) - 1, n - len(groups)
    eta2 = exact_ratio(ss, ss + error)
    return ExactEffect("", ss, error, df1, df2, exact_ratio(ss * df2, error * df1), None, eta2, eta2)


def integers(values: Iterable[float]) -> tuple[list[int], Fraction]:
    """The values as integers, and the square of their common unit."""
    ratios = [float(value).as_integer_ratio() for value in values]
    denominator = max(bottom for _, bottom in ratios)
    return [top * (denominator // bottom) for top, bottom in ratios], Fraction(1, denominator**2)


def _subsets(factors: int) -> Iterator[tuple[int, ...]]:
    for size in range(1, factors + 1):
        yield from combinations(range(1, factors + 1), size)


def summed_part(table: Cells, shape: Sequence[int], axes: Sequence[int]) -> Cells:
    """The table summed over all axes but these and centred along these, times their sizes."""
    part: Cells = {}
    for where, value in table.items():
        key = tuple(where[axis] for axis in axes)
        part[key] = part.get(key, 0) + value
    for place, axis in enumerate(axes):
        part = _centred(part, place, shape[axis])
    return part


def _centred(part: Cells, place: int, size: int) -> Cells:
    sums: Cells = {}
    for where, value in part.items():
        key = where[:place] + where[place + 1 :]
        sums[key] = sums.get(key, 0) + value
    return {where: size * value - sums[where[:place] + where[place + 1 :]] for where, value in part.items()}


def part_ss(part: Cells, shape: Sequence[int], axes: Sequence[int]) -> Fraction:
    """The sum of squares of a `summed_part`."""
    kept = math.prod(shape[axis] for axis in axes)
    return Fraction(sum(value * value for value in part.values()) * kept, math.prod(shape) * kept**2)


def _parts(
    table: Cells, shape: Sequence[int], axes: tuple[int, ...], unit: Fraction, epsilon: bool
) -> tuple[Fraction, Fraction, Fraction | None]:
    """Effect and error sum of squares, and epsilon."""
    residual = summed_part(table, shape, (0, *axes))
    df = math.prod(shape[axis] - 1 for axis in axes)
    eps = exact_epsilon(list(residual.values()), shape[0], df) if epsilon else None
    return (
        part_ss(summed_part(table, shape, axes), shape, axes) * unit,
        part_ss(residual, shape, (0, *axes)) * unit,
        eps,
    )


def exact_epsilon(residual: list[int], n: int, df: int) -> Fraction | None:
    """tr(S)^2 / (df tr(S^2)) from the residuals of each participant in turn."""
    k = len(residual) // n
    columns = [residual[i::k] for i in range(k)]
    rows = [residual[i : i + k] for i in range(0, len(residual), k)]
    vectors = columns if k <= n else rows
    squares = sum(sum(a * b for a, b in zip(u, v, strict=True)) ** 2 for u, v in product(vectors, vectors))
    trace = sum(value * value for value in residual)
    return Fraction(trace**2, df * squares) if squares else None


def _effect(
    source: str,
    shape: Sequence[int],
    axes: tuple[int, ...],
    ss: Fraction,
    error: Fraction,
    eps: Fraction | None,
    rest: Fraction,
) -> ExactEffect:
    df1 = math.prod(shape[axis] - 1 for axis in axes)
    df2 = df1 * (shape[0] - 1)
    f = exact_ratio(ss * df2, error * df1)
    return ExactEffect(source, ss, error, df1, df2, f, eps, exact_ratio(ss, ss + error), exact_ratio(ss, ss + rest))


def exact_ratio(top: Fraction, bottom: Fraction) -> Fraction | None:
    """top / bottom, None where there is nothing to divide by."""
    return top / bottom if bottom else None
