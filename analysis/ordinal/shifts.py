"""Hodges-Lehmann estimates of a shift, with the interval that belongs to the rank test.

Medians of the pairwise means of differences (one sample) or of all differences between two samples; the interval
lies between two of these values, counted off by the exact distribution of the test without ties (Hollander, Wolfe &
Chicken 2014, 3.2, 3.3, 4.2, 4.3). With ties or zeros its confidence is at least that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from palpate.analysis.ordinal.permutations import MOST_SIGNED, lower_quantile, rank_sum_chances, signed_rank_chances
from palpate.analysis.statistics.doubles import Floats

MOST_MEANS = 5_000_000  # pairwise means or differences held at once


@dataclass(frozen=True)
class Shift:
    """An estimate in the data's unit and its interval; NaN where `note` says why."""

    estimate: float
    low: float
    high: float
    note: str = ""


def one_sample_shift(values: Floats, confidence: float) -> Shift:
    """The median of the means of all pairs of values (each with itself too), and its interval."""
    n = len(values)
    if n * (n + 1) // 2 > MOST_MEANS:
        return _too_many(n * (n + 1) // 2)
    first, second = np.triu_indices(n)
    return _between(values[first] / 2 + values[second] / 2, _signed_count(n, (1 - confidence) / 2), confidence)


def two_sample_shift(a: Floats, b: Floats, confidence: float) -> Shift:
    """The median of all differences between a value of the first and one of the second sample, and its interval."""
    if len(a) * len(b) > MOST_MEANS:
        return _too_many(len(a) * len(b))
    return _between(np.subtract.outer(a, b).ravel(), _sum_count(len(a), len(b), (1 - confidence) / 2), confidence)


def _too_many(count: int) -> Shift:
    return Shift(*(math.nan,) * 3, f"shift not estimated: {count:,} differences are too many")


def _between(values: Floats, count: int, confidence: float) -> Shift:
    """The median, and the count-th value from either end; no interval where even the ends are not wide enough."""
    last = len(values) - 1
    ends = [count - 1, last - count + 1] if count > 0 else []
    values.partition([last // 2, (last + 1) // 2, *ends])
    estimate = float(values[last // 2] / 2 + values[(last + 1) // 2] / 2)
    if not ends:
        note = f"too few values for an interval with confidence {confidence:.3g}"
        return Shift(estimate, math.nan, math.nan, note)
    return Shift(estimate, *values[ends].tolist())


def _signed_count(n: int, tail: float) -> int:
    """How many pairwise means to count off: R's qsignrank(tail, n), 0 where the ends fall short of the confidence."""
    if n > MOST_SIGNED:
        return round(n * (n + 1) / 4 + float(ndtri(tail)) * math.sqrt(n * (n + 1) * (2 * n + 1) / 24))
    return _count(signed_rank_chances(np.arange(1, n + 1, dtype=np.int64)), tail)


def _sum_count(n_a: int, n_b: int, tail: float) -> int:
    """The same for two samples: R's qwilcox(tail, n_a, n_b)."""
    small, n = min(n_a, n_b), n_a + n_b
    chances = rank_sum_chances(np.arange(1, n + 1, dtype=np.int64), small)
    if chances is None:
        return round(n_a * n_b / 2 + float(ndtri(tail)) * math.sqrt(n_a * n_b * (n + 1) / 12))
    return _count(chances[small * (small + 1) // 2 :], tail)


def _count(chances: Floats, tail: float) -> int:
    """The least count whose tail exceeds the wished one; 0 where the outermost value alone weighs more than that."""
    return lower_quantile(chances, tail)
