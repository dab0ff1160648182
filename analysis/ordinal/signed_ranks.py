"""Wilcoxon's signed-rank test of paired values, exact whatever is tied or zero."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import ndtr

from palpate.analysis.ordinal.permutations import MOST_SIGNED, signed_rank_chances, two_sided
from palpate.analysis.ordinal.ranks import Ints, Truths, doubled_ranks, rounding, same_value, written
from palpate.analysis.ordinal.shifts import Shift, one_sample_shift
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.pvalues import SMALLEST, p_note

Zeros: TypeAlias = Literal["wilcoxon", "pratt"]
NO_EXACT_MANY = "exact p not computed: too many values; the normal approximation stands in"


@dataclass(frozen=True)
class RankComparison:
    """Two samples compared by ranks, the first minus the second; NaN where `note` says why.

    `statistic` is R's W or V, `p` is `p_exact` where that was computed and `p_normal` otherwise, `size` a
    rank-biserial correlation, `shift` the Hodges-Lehmann estimate with its interval.
    """

    n: tuple[int, int]
    zeros: int
    statistic: float
    z: float
    p_normal: float
    p_exact: float
    size: float
    shift: Shift
    note: str

    @property
    def p(self) -> float:
        """The p to report: exact where it was computed."""
        return self.p_normal if math.isnan(self.p_exact) else self.p_exact


def signed_ranks(a: Floats, b: Floats, zeros: Zeros = "wilcoxon", confidence: float = 0.95) -> RankComparison:
    """The test of paired values a, b (same length): statistic V, the sum of the ranks of positive differences.

    "wilcoxon" leaves zero differences out before ranking, "pratt" ranks them and leaves their ranks out. Zeros and ties
    are decided as in `ranks`. Wilcoxon 1945; Pratt 1959; Hollander, Wolfe & Chicken 2014, 3.1.
    """
    change = a - b
    allowed = np.maximum(rounding(a), rounding(b))
    zero = same_value(a, b, allowed)
    size = np.where(zero, 0.0, np.abs(change))
    shift = one_sample_shift(np.where(zero, 0.0, change), confidence)
    lost, pairs = int(np.count_nonzero(zero)), (len(a), len(b))
    if lost == len(a):
        return RankComparison(pairs, lost, *(math.nan,) * 5, shift, "V is undefined: every difference is zero")
    kept = np.ones_like(zero) if zeros == "pratt" else ~zero
    if _is_doubtful(size[kept], allowed[kept]):
        exact = written(a) & written(b)
        size = np.where(zero, 0.0, np.abs(_decimal_differences(a, b, exact)))
    else:
        exact = np.ones_like(zero)
    ranks: Ints = doubled_ranks(size[None, kept], allowed[None, kept], ~exact[None, kept])[0, ~zero[kept]]
    positive, total = int(ranks[change[~zero] > 0].sum()), int(ranks.sum())
    z, p_normal = _normal(positive, ranks)
    p_exact = math.nan
    notes = []
    if len(ranks) <= MOST_SIGNED:
        p_exact = max(two_sided(signed_rank_chances(ranks), positive, total), SMALLEST)
    else:
        notes.append(NO_EXACT_MANY)
    biserial = (2 * positive - total) / total
    notes += [shift.note, p_note([p_normal, p_exact])]
    note = "; ".join(filter(None, notes))
    return RankComparison(pairs, lost, positive / 2, z, p_normal, p_exact, biserial, shift, note)


def _is_doubtful(size: Floats, allowed: Floats) -> bool:
    """Return whether any two sizes differ by no more than rounding may have moved them."""
    order = np.argsort(size)
    gaps, room = np.diff(size[order]), allowed[order]
    return bool(((gaps > 0) & (gaps <= np.maximum(room[1:], room[:-1]))).any())


def _decimal_differences(a: Floats, b: Floats, exact: Truths) -> Floats:
    """a - b, of short decimals without the rounding that subtracting doubles has: 0.3 - 0.2 is 0.2 - 0.1."""
    found = a - b
    for place in np.flatnonzero(exact):
        found[place] = float(Decimal(repr(float(a[place]))) - Decimal(repr(float(b[place]))))
    return found


def _normal(positive: int, ranks: Ints) -> tuple[float, float]:
    """z with continuity correction and its two-sided p; the variance is that of the ranks found, so right with ties."""
    apart = positive - int(ranks.sum()) / 2
    sd = math.sqrt(float(np.dot(ranks, ranks)) / 4)
    return corrected_z(apart, sd)


def corrected_z(apart: float, sd: float) -> tuple[float, float]:
    """(apart -+ 1/2 rank) / sd on doubled ranks and its two-sided p, never 0; p = 1 where nothing is left."""
    z = (apart - math.copysign(min(1.0, abs(apart)), apart)) / sd
    return z, min(1.0, max(2 * float(ndtr(-abs(z))), SMALLEST))
