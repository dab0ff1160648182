"""Bootstrap intervals of rank statistics from a seed, independent of the order of participants."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.analysis.ordinal.ranks import Ints
from palpate.analysis.statistics.refusals import BadOption, shown

BATCH = 2_000_000  # counts held at once
MOST_DRAWS = 1_000_000


@dataclass(frozen=True)
class Interval:
    """The options of an interval: samples, seed and confidence."""

    draws: int = 2000
    seed: int = 0
    confidence: float = 0.95


def check_interval(draws: object, confidence: object) -> None:
    """Refuse a confidence outside (0, 1) and a number of draws that is no whole number from 100 up."""
    if not isinstance(draws, int) or isinstance(draws, bool) or not 100 <= draws <= MOST_DRAWS:
        raise BadOption(f"draws={shown(draws)}: a whole number from 100 to {MOST_DRAWS:,} is expected")
    if not isinstance(confidence, float) or not 0 < confidence < 1:
        raise BadOption(f"confidence={shown(confidence)}: a number between 0 and 1 is expected, such as 0.95")


def w_interval(ranks: Ints, interval: Interval) -> tuple[float, float, str]:
    """Return the percentile bootstrap interval of Kendall's W over participants, and a note where it is undefined.

    Participants are sorted by their ranks first, so that the draws depend neither on rows nor on labels. Efron &
    Tibshirani 1993, ch. 13.
    """
    if len(ranks) < 3:
        return math.nan, math.nan, "no interval of W: two participants are one pair, whoever is drawn"
    centred = (ranks - (ranks.shape[1] + 1))[np.lexsort(ranks.T)].astype(np.float64)
    # W = (1 + (n - 1) r) / n with r the mean agreement of two participants. A sample holds some participants several
    # times; that they agree with themselves is no agreement, so r is taken over pairs of different ones. Whole numbers
    # are held in doubles, so sums are exact.
    n = len(centred)
    rng = np.random.Generator(np.random.PCG64(interval.seed))
    squares = (centred**2).sum(axis=1)
    parts = []
    for start in range(0, interval.draws, size := max(1, BATCH // n)):
        counts = rng.multinomial(n, np.full(n, 1 / n), size=min(size, interval.draws - start)).astype(np.float64)
        twice = counts * counts
        together, total = ((counts @ centred) ** 2).sum(axis=1) - twice @ squares, counts @ squares
        pairs = n * n - twice.sum(axis=1)
        r = np.divide(together * n, pairs * total, out=np.full(len(counts), np.nan), where=(pairs > 0) & (total > 0))
        parts.append(np.clip((1 + (n - 1) * r) / n, 0.0, 1.0))
    values = np.concatenate(parts)
    defined = values[~np.isnan(values)]
    if len(defined) == 0:
        return math.nan, math.nan, ""
    lost = len(values) - len(defined)
    tail = (1 - interval.confidence) / 2
    low, high = np.quantile(defined, [tail, 1 - tail]).tolist()
    return low, high, f"W undefined in {lost} of {len(values)} bootstrap samples, left out" if lost else ""
