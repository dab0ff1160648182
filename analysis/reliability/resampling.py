"""Bootstrap draws as counts of how often each unit is drawn, and the intervals that follow from them.

Source: Efron & Tibshirani 1993, ch. 13 (percentile) and 14 (BCa).
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import ndtr, ndtri

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown

Interval: TypeAlias = Literal["percentile", "bca"]
INTERVALS = ("percentile", "bca")


def generator(seed: int, purpose: str) -> np.random.Generator:
    """Return random numbers that depend on the seed and on their purpose alone."""
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise BadOption(f"seed={shown(seed)}: a whole number from 0 is expected")
    return np.random.Generator(np.random.PCG64([seed, zlib.crc32(purpose.encode())]))


def demand_draws(draws: object) -> None:
    """Refuse a number of draws too small for the tails of an interval; 0 means no interval."""
    if isinstance(draws, bool) or not isinstance(draws, int) or (draws != 0 and draws < 100):
        raise BadOption(f"draws={shown(draws)}: at least 100 are expected, or 0 for no interval")


def refuse_without_draws(draws: int, **options: tuple[object, object]) -> None:
    """Refuse options of an interval, each given with its default, where there are no draws to make one from."""
    for name, (value, default) in options.items() if not draws else ():
        refuse_idle(name, value, default, "with draws=0: there is no interval")


def demand_interval(interval: object) -> None:
    """Refuse an unknown kind of interval."""
    if interval not in INTERVALS:
        raise BadOption(f"interval={shown(interval)} is unknown: 'percentile' or 'bca'")


def weights(rng: np.random.Generator, units: int, draws: int, at_once: int = 500) -> Iterator[Floats]:
    """Yield how often each of the units is drawn, in blocks of shape (up to `at_once`, units)."""
    for start in range(0, draws, at_once):
        yield rng.multinomial(units, [1 / units] * units, size=min(at_once, draws - start)).astype(np.float64)


def left_out(units: int) -> Floats:
    """Return the weights of a jackknife: each row leaves one unit out."""
    jackknife: Floats = np.ones((units, units)) - np.eye(units)
    return jackknife


def percentile(drawn: Floats, confidence: float) -> tuple[float, float]:
    """Return the interval between two quantiles of the draws; NaN draws are left out, NaN if fewer than half remain."""
    defined = drawn[~np.isnan(drawn)]
    if not len(drawn) or 2 * len(defined) < len(drawn):
        return math.nan, math.nan
    tail = (1 - confidence) / 2
    low, high = np.quantile(defined, [tail, 1 - tail])
    return float(low), float(high)


def bca(estimate: float, drawn: Floats, jackknife: Floats, confidence: float) -> tuple[float, float]:
    """Return the bias-corrected and accelerated interval; NaN where the draws all lie on one side of the estimate.

    Draws equal to the estimate count half on either side, as shares of few people are often equal.
    """
    defined = drawn[~np.isnan(drawn)]
    if not len(drawn) or 2 * len(defined) < len(drawn) or math.isnan(estimate) or np.isnan(jackknife).any():
        return math.nan, math.nan
    if defined.min() == defined.max() == estimate:
        return estimate, estimate
    below = (np.count_nonzero(defined < estimate) + np.count_nonzero(defined == estimate) / 2) / len(defined)
    if not 0 < below < 1:
        return math.nan, math.nan
    bias, tail = float(ndtri(below)), (1 - confidence) / 2
    spread = jackknife.mean() - jackknife
    square = float((spread**2).sum())
    faster = float((spread**3).sum()) / (6 * square**1.5) if square > 0 else 0.0
    ends = []
    for z in (float(ndtri(tail)), -float(ndtri(tail))):
        shifted = bias + z
        ends.append(float(ndtr(bias + shifted / (1 - faster * shifted))))
    low, high = np.quantile(defined, sorted(ends))
    return float(low), float(high)
