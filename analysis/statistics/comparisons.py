"""The numbers of pairwise t tests: one comparison per pair, paired or between groups."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from palpate.analysis.statistics.doubles import (
    ROUNDING_ULPS,
    Floats,
    centred,
    deviation_ss,
    difference,
    differences,
    exact_sum,
    rescaled,
    row_sums,
    scaled,
)


class Comparison(NamedTuple):
    """Level A minus level B: mean difference and its standard error in the data's unit, t, df, standardised size.

    `spread` is what the size is in units of: the standard deviation of the differences, or the groups' pooled one.
    Where t is undefined, `t` and `size` are NaN and `note` says why.
    """

    a: Hashable
    b: Hashable
    mean: float
    error: float
    t: float
    df: float
    size: float
    note: str
    spread: float


def paired(labels: Sequence[Hashable], values: Floats) -> Iterator[Comparison]:
    """Every pair of columns of an array (participants, levels); size is dz = mean / SD of the differences."""
    x, exponent = scaled(values)
    limits = ROUNDING_ULPS * np.spacing(np.abs(x).max(axis=0))
    for i in range(len(labels) - 1):
        means, spreads = _differences_to(x, i)
        floors = np.maximum(limits[i], limits[i + 1 :])
        found = zip(labels[i + 1 :], means.tolist(), spreads.tolist(), floors.tolist(), strict=True)
        for label, mean, spread, floor in found:
            yield _paired(labels[i], label, (mean, spread, floor), len(x), exponent)


def _differences_to(x: Floats, i: int) -> tuple[Floats, Floats]:
    """Mean and standard deviation of column i minus each later column."""
    n = len(x)
    high, low = difference(x[:, i : i + 1], x[:, i + 1 :])
    change, rest = differences((high, low), 0)
    deviations = centred(change if rest is None else change + rest, 0) / n
    spreads = np.sqrt(np.add.reduce(deviations * deviations, axis=0) / (n - 1))
    return row_sums((high.T, low.T)) / n, spreads


def _paired(a: Hashable, b: Hashable, scaled_pair: tuple[float, float, float], n: int, exponent: int) -> Comparison:
    mean, spread, floor = scaled_pair
    error = spread / math.sqrt(n)
    note = "" if spread > floor else _same(mean, floor, spread, "differences")
    t, size = (math.nan, math.nan) if note else (mean / error, mean / spread)
    plain, own_error, own_spread = (rescaled(value, exponent) for value in (mean, error, spread))
    return Comparison(a, b, plain, own_error, t, n - 1, size, note, own_spread)


def _same(mean: float, floor: float, spread: float, what: str) -> str:
    level = "do not vary" if spread == 0 else "vary only at the rounding level of the data"
    return f"t is undefined: the {what} {level}" + (" and their mean is zero" if abs(mean) <= floor else "")


class _Sample(NamedTuple):
    """One group in scaled units: size, exact mean deviation from the common pivot, sum of squares, rounding level."""

    label: Hashable
    n: int
    mean: float
    low: float  # what `mean` as a double leaves out
    ss: float
    floor: float


def unpaired(labels: Sequence[Hashable], groups: Sequence[Floats]) -> Iterator[Comparison]:
    """Every pair of groups; pooled variance for equal sizes, Welch's test otherwise; size is Hedges' g."""
    x, exponent = scaled(np.concatenate(groups))
    parts = np.split(x, np.cumsum([len(group) for group in groups])[:-1])
    samples = [_sample(label, part, float(x[0])) for label, part in zip(labels, parts, strict=True)]
    for a, b in combinations(samples, 2):
        yield _unpaired(a, b, exponent)


def _sample(label: Hashable, part: Floats, pivot: float) -> _Sample:
    mean = exact_sum(part, pivot) / len(part)
    high = float(mean)
    floor = ROUNDING_ULPS * float(np.spacing(np.abs(part).max()))
    return _Sample(label, len(part), high, float(mean - type(mean)(high)), deviation_ss(part), floor)


def _unpaired(a: _Sample, b: _Sample, exponent: int) -> Comparison:
    mean = (a.mean - b.mean) + (a.low - b.low)
    floor, df = max(a.floor, b.floor), float(a.n + b.n - 2)
    if min(a.n, b.n) == 1 and (df == 0 or a.n != b.n):
        note, error = "t is undefined: a group has one value", math.nan
    else:
        spread = math.sqrt((a.ss + b.ss) / (a.n + b.n))
        note = "" if spread > floor else _same(mean, floor, spread, "values of each group")
        error, df = _welch(a, b) if a.n != b.n and not note else (_pooled(a, b), df)
    size = math.nan if note else hedges_g(mean, a.ss + b.ss, a.n + b.n)
    t = math.nan if note else mean / error
    pooled = math.sqrt((a.ss + b.ss) / (a.n + b.n - 2)) if a.n + b.n > 2 else math.nan
    plain, own_error, own_spread = (rescaled(value, exponent) for value in (mean, error, pooled))
    return Comparison(a.label, b.label, plain, own_error, t, df, size, note, own_spread)


def _pooled(a: _Sample, b: _Sample) -> float:
    return math.sqrt((a.ss + b.ss) / (a.n + b.n - 2) * (1 / a.n + 1 / b.n))


def _welch(a: _Sample, b: _Sample) -> tuple[float, float]:
    """Standard error and degrees of freedom of Welch 1947."""
    va, vb = a.ss / (a.n - 1) / a.n, b.ss / (b.n - 1) / b.n
    share = va / (va + vb)
    return math.sqrt(va + vb), 1 / (share**2 / (a.n - 1) + (1 - share) ** 2 / (b.n - 1))


def hedges_g(mean: float, ss: float, n: int) -> float:
    """Mean difference in pooled standard deviations, with the small-sample factor 1 - 3 / (4 n - 9) (Hedges 1981)."""
    return mean / math.sqrt(ss / (n - 2)) * (1 - 3 / (4 * n - 9))
