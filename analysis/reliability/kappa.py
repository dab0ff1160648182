"""Kappa: agreement of raters on categories; Cohen's for two raters, Fleiss' for several."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.f_and_t import SMALLEST
from palpate.analysis.statistics.refusals import BadValue, TooFew


class Kappa(NamedTuple):
    """Fleiss' kappa, its standard error under agreement by chance, z and p; NaN if undefined."""

    kappa: float
    se_null: float
    z: float
    p: float
    units: int
    raters: int
    note: str


def fleiss_kappa(counts: Floats) -> Kappa:
    """Return Fleiss' kappa of an array (units, categories): how many raters put each unit into each category.

    Source: Fleiss 1971; the standard error: Fleiss, Nee & Landis 1979. Raises BadValue for counts that are not
    integers, or units with different numbers of raters (use Krippendorff's alpha for these), TooFew for one rater or no
    unit.
    """
    counts = np.asarray(counts, dtype=np.float64)
    if counts.ndim != 2 or not len(counts):
        raise TooFew("no units; counts of shape (units, categories) are expected")
    if not np.isfinite(counts).all() or (counts < 0).any() or (counts % 1 != 0).any():
        raise BadValue("counts must be whole numbers from 0")
    raters = counts.sum(axis=1)
    if (raters != raters[0]).any():
        raise BadValue(
            f"units have {int(raters.min())} to {int(raters.max())} raters; Fleiss' kappa needs the same number for "
            "each: use Krippendorff's alpha"
        )
    if raters[0] < 2:
        raise TooFew("one rater; agreement needs two or more")
    m = int(raters[0])
    n = len(counts)
    share = counts.sum(axis=0) / (n * m)
    # Ordered pairs of raters, in whole numbers: of one unit that disagree, and of all ratings that differ.
    observed = float((m * m - (counts**2).sum(axis=1)).sum()) / (n * m * (m - 1))
    expected = float((n * m) ** 2 - (counts.sum(axis=0) ** 2).sum()) / (n * m) ** 2
    if expected == 0:
        why = "undefined: every rating is of one category, so none could disagree by chance"
        return Kappa(math.nan, math.nan, math.nan, math.nan, n, m, why)
    kappa = 1 - observed / expected
    spread = expected**2 - float((share * (1 - share) * (1 - 2 * share)).sum())
    se = math.sqrt(2 * max(spread, 0.0) / (n * m * (m - 1))) / expected
    if se == 0:
        return Kappa(kappa, math.nan, math.nan, math.nan, n, m, "no standard error")
    z = kappa / se
    note = "negative: raters agree less than by chance" if kappa < 0 else ""
    return Kappa(kappa, se, z, max(math.erfc(abs(z) / math.sqrt(2)), SMALLEST), n, m, note)


class CohenKappa(NamedTuple):
    """Cohen's kappa of two raters, its standard error and interval, the share agreed on; NaN if undefined."""

    kappa: float
    se: float
    low: float
    high: float
    agreement: float
    units: int
    note: str


def cohen_kappa(counts: Floats, confidence: float = 0.95) -> CohenKappa:
    """Return Cohen's kappa of an array (k, k): units by the first rater's category (row) and the second's.

    Source: Cohen 1960; the standard error, for large samples: Fleiss, Cohen & Everitt 1969, equation 13. The interval
    is kappa +- z se, cut at 1 and -1. Raises BadValue for counts that are not integers or not square, and for an
    invalid confidence; TooFew for no unit.
    """
    counts = np.asarray(counts, dtype=np.float64)
    if counts.ndim != 2 or counts.shape[0] != counts.shape[1]:
        raise BadValue("counts of shape (categories, categories) are expected, the same categories for both raters")
    if not np.isfinite(counts).all() or (counts < 0).any() or (counts % 1 != 0).any():
        raise BadValue("counts must be whole numbers from 0")
    if not 0 < confidence < 1:
        raise BadValue(f"confidence {confidence:g}: a share between 0 and 1 is expected")
    if not (n := int(counts.sum())):
        raise TooFew("no units that both raters have put into a category")
    share = counts / n
    row, column = share.sum(axis=1), share.sum(axis=0)
    # In whole numbers, so that what is equal is equal.
    chance = float(counts.sum(axis=1) @ counts.sum(axis=0)) / n**2
    agreed = float(np.trace(counts)) / n
    if chance == 1:
        why = "undefined: both raters put every unit into one and the same category"
        return CohenKappa(math.nan, math.nan, math.nan, math.nan, agreed, n, why)
    kappa = (agreed - chance) / (1 - chance)
    own = float(np.diag(share) @ (1 - (row + column) * (1 - kappa)) ** 2)
    swapped = share * (column[:, None] + row[None, :]) ** 2
    others = (1 - kappa) ** 2 * float(swapped.sum() - np.trace(swapped))
    se = math.sqrt(max(own + others - (kappa - chance * (1 - kappa)) ** 2, 0.0) / n) / (1 - chance)
    half = NormalDist().inv_cdf((1 + confidence) / 2) * se
    note = "negative: raters agree less than by chance" if kappa < 0 else ""
    return CohenKappa(kappa, se, max(kappa - half, -1.0), min(kappa + half, 1.0), agreed, n, note)
