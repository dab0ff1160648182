"""Wilcoxon tests of every pair of levels, within participants or between groups, with their family of p values.

Signed ranks and rank sums are exact even with ties and zeros: their distributions given the ties are counted in integer
(doubled) ranks, and probabilities and counts are only added, so that the smallest tail keeps its digits. Shifts are
Hodges-Lehmann estimates: medians of the pairwise means of differences (one sample) or of all differences between two
samples. The interval lies between two of these values, counted off by the exact distribution of the test without ties
(Hollander, Wolfe & Chicken 2014, 3.2, 3.3, 4.2, 4.3); with ties or zeros its confidence is at least that.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass
from decimal import Decimal
from itertools import combinations
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri

from palpate.analysis.ordinal.friedman import one_factor
from palpate.analysis.ordinal.ranks import Ints, doubled_ranks, refuse_huge, rounding, same_value, written
from palpate.analysis.ordinal.resampling import check_interval
from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.f_and_t import SMALLEST, adjusted, p_note
from palpate.analysis.statistics.groups import gather_groups
from palpate.analysis.statistics.pairwise import ADJUSTMENTS
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown

Zeros: TypeAlias = Literal["wilcoxon", "pratt"]
NO_EXACT_MANY = "exact p not computed: too many values; the normal approximation stands in"
MOST_MEANS = 5_000_000  # pairwise means or differences held at once
MOST_SIGNED = 300  # pairs up to which the distribution of signed ranks is computed
MOST_STEPS = 200_000_000  # additions up to which the distribution of a rank sum is computed
MOST_VALUES = 500  # values in both groups: binomial coefficients stay within doubles


@dataclass(frozen=True)
class RankComparison:
    """Two samples compared by ranks, the first minus the second; NaN if `note` says why.

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
        """The p to report: exact if it was computed."""
        return self.p_normal if math.isnan(self.p_exact) else self.p_exact


def wilcoxon_tests(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Hashable | Iterable[Hashable] | None = None,
    subject: Hashable | None = None,
    between: Hashable | Iterable[Hashable] | None = None,
    padjust: str = "none",
    family: int | None = None,
    zeros: Zeros = "wilcoxon",
    confidence: float = 0.95,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return Wilcoxon tests of every pair of levels of one factor, A minus B, one row per pair.

    `within` and `subject`: signed ranks (`W` is R's V, the sum of positive ranks; `zeros` "wilcoxon" or "pratt");
    `between`: rank sums (`W` is R's W, Mann & Whitney's U of A). `p_unc` is `p_exact`, exact given all ties, or
    `p_normal` with continuity correction if the exact one would cost too much (a note says so). `shift` is the
    Hodges-Lehmann estimate with `ci_low`, `ci_high` (not adjusted), `rank_biserial` the effect size, from -1 to 1.
    `padjust` "none", "bonferroni" or "holm" over `family` tests, a size fixed beforehand (None: the pairs here). Raises
    a StatisticsError (a ValueError) that names what is wrong with the table or the request.
    """
    check_interval(100, confidence)
    if not isinstance(padjust, str) or padjust not in ADJUSTMENTS:
        raise BadOption(f"padjust={shown(padjust)} is unknown: one of {', '.join(map(repr, ADJUSTMENTS))}")
    if not isinstance(zeros, str) or zeros not in ("wilcoxon", "pratt"):
        raise BadOption(f"zeros={shown(zeros)} is unknown: 'wilcoxon' (left out) or 'pratt' (ranked, then left out)")
    method = ADJUSTMENTS[padjust]
    if method == "none":
        refuse_idle("family", family, None, "with padjust='none': no p is adjusted")
    if within is None:
        refuse_idle("zeros", zeros, "wilcoxon", "between groups: rank sums have no differences of zero")
    if (within is None) == (between is None):
        raise BadOption("give one factor: either `within` (with `subject`) or `between`")
    if within is not None and subject is None:
        raise BadOption("within needs `subject`, the column of participants")
    if within is not None:
        factor, cells = one_factor(data, dv, within, subject, missing, aggregate)
        compared_pairs = _pairs(cells.levels[0], list(cells.values.T))
        pairs, attrs = [(a, b, signed_ranks(x, y, zeros, confidence)) for a, b, x, y in compared_pairs], cells.attrs()
    else:
        groups = gather_groups(data, dv, between, subject, missing, aggregate)
        refuse_huge(np.concatenate(groups.values))
        factor, attrs = groups.factor, groups.attrs()
        pairs = [(a, b, rank_sums(x, y, confidence)) for a, b, x, y in _pairs(groups.labels, groups.values)]
    table = _table(factor, within is not None, pairs, method, family)
    table.attrs.update(attrs)
    return table


def rank_sums(a: Floats, b: Floats, confidence: float = 0.95) -> RankComparison:
    """Return the test of two samples: statistic W (Mann-Whitney's U of the first), as in R's wilcox.test.

    The exact p is P(|W - mean| >= the observed distance) over all ways to split the values; the effect size
    2 W / (n_a n_b) - 1 is the rank-biserial correlation (Cliff's delta). Mann & Whitney 1947; Hollander, Wolfe &
    Chicken 2014, 4.1.
    """
    both = np.concatenate((a, b))
    ranks = doubled_ranks(both[None], rounding(both)[None])[0]
    shift = two_sample_shift(a, b, confidence)
    sizes = (len(a), len(b))
    if np.ptp(ranks) == 0:
        return RankComparison(sizes, 0, *(math.nan,) * 5, shift, "W is undefined: all values are the same")
    total = int(ranks[: len(a)].sum())
    u = (total - len(a) * (len(a) + 1)) / 2
    # The standard deviation of a doubled rank sum, drawn without replacement from these ranks.
    n, centred = len(both), ranks - (len(both) + 1)
    sd = math.sqrt(len(a) * len(b) * float(np.dot(centred, centred)) / (n * (n - 1)))
    z, p_normal = corrected_z(total - len(a) * (len(both) + 1), sd)
    # From the smaller group: its distance from the mean is the same.
    small = min(len(a), len(b))
    own = ranks[len(a) :] if len(b) < len(a) else ranks[: len(a)]
    chances, p_exact = rank_sum_chances(ranks, small), math.nan
    if chances is not None:
        p_exact = max(two_sided(chances, int(own.sum()), 2 * small * (n + 1)), SMALLEST)
    notes = [NO_EXACT_MANY if math.isnan(p_exact) else "", shift.note, p_note([p_normal, p_exact])]
    size = (total - len(a) * (len(both) + 1)) / (len(a) * len(b))  # 2 U / (n_a n_b) - 1, in whole numbers
    return RankComparison(sizes, 0, u, z, p_normal, p_exact, size, shift, "; ".join(filter(None, notes)))


def signed_ranks(a: Floats, b: Floats, zeros: Zeros = "wilcoxon", confidence: float = 0.95) -> RankComparison:
    """Return the test of paired values a, b (same length): statistic V, the sum of the ranks of positive differences.

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
    ranked = np.ones_like(zero) if zeros == "pratt" else ~zero
    order = np.argsort(size[ranked])
    gaps, room = np.diff(size[ranked][order]), allowed[ranked][order]
    # Where two sizes differ by no more than rounding may have moved them.
    if ((gaps > 0) & (gaps <= np.maximum(room[1:], room[:-1]))).any():
        exact = written(a) & written(b)
        # a - b, of short decimals without the rounding that subtracting doubles has: 0.3 - 0.2 is 0.2 - 0.1.
        differences = a - b
        for place in np.flatnonzero(exact):
            differences[place] = float(Decimal(repr(float(a[place]))) - Decimal(repr(float(b[place]))))
        size = np.where(zero, 0.0, np.abs(differences))
    else:
        exact = np.ones_like(zero)
    ranks: Ints = doubled_ranks(size[None, ranked], allowed[None, ranked], ~exact[None, ranked])[0, ~zero[ranked]]
    positive, total = int(ranks[change[~zero] > 0].sum()), int(ranks.sum())
    # z with continuity correction and its two-sided p; the variance is that of the ranks, ties included.
    apart = positive - int(ranks.sum()) / 2
    sd = math.sqrt(float(np.dot(ranks, ranks)) / 4)
    z, p_normal = corrected_z(apart, sd)
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


def corrected_z(apart: float, sd: float) -> tuple[float, float]:
    """Return (apart -+ 1/2 rank) / sd on doubled ranks and its two-sided p, never 0; p = 1 if nothing remains."""
    z = (apart - math.copysign(min(1.0, abs(apart)), apart)) / sd
    return z, min(1.0, max(2 * float(ndtr(-abs(z))), SMALLEST))


LevelPair: TypeAlias = tuple[Hashable, Hashable, RankComparison]


def _pairs(labels: list[Any], values: list[Any]) -> Iterator[tuple[Any, Any, Any, Any]]:
    for i, j in combinations(range(len(labels)), 2):
        yield labels[i], labels[j], values[i], values[j]


def adjust_in_family(p: list[float], method: str, family: int | None) -> list[float]:
    """Adjust p values within a family of this size; refuse a family smaller than its tests."""
    size = len(p) if family is None else family
    if isinstance(size, bool) or not isinstance(size, int) or size < len(p):
        raise BadOption(f"family={shown(family)}: a whole number is expected, at least the {len(p)} tests made here")
    return adjusted([*p, *[math.nan] * (size - len(p))], method)[: len(p)]


def _table(factor: Hashable, paired: bool, pairs: list[LevelPair], method: str, family: int | None) -> pd.DataFrame:
    adjusted_p = adjust_in_family([comparison.p for _, _, comparison in pairs], method, family)
    size = len(pairs) if family is None else family
    rows = []
    for (a, b, comparison), p in zip(pairs, adjusted_p, strict=True):
        shift = comparison.shift
        rows.append(
            {
                **{"Contrast": str(factor), "A": a, "B": b, "Paired": paired},
                **{"n_A": comparison.n[0], "n_B": comparison.n[1], "zeros": comparison.zeros},
                **{"W": comparison.statistic, "z": comparison.z, "rank_biserial": comparison.size},
                **{"shift": shift.estimate, "ci_low": shift.low, "ci_high": shift.high},
                **{"p_normal": comparison.p_normal, "p_exact": comparison.p_exact, "p_unc": comparison.p},
                **{"p_corr": p, "p_adjust": method, "family": size, "note": comparison.note},
            }
        )
    return pd.DataFrame(rows)


@dataclass(frozen=True)
class Shift:
    """An estimate in the data's unit and its interval; NaN if `note` says why."""

    estimate: float
    low: float
    high: float
    note: str = ""


def one_sample_shift(values: Floats, confidence: float) -> Shift:
    """Return the median of the means of all pairs of values (each also with itself), and its interval."""
    n = len(values)
    if n * (n + 1) // 2 > MOST_MEANS:
        return _too_many(n * (n + 1) // 2)
    first, second = np.triu_indices(n)
    return _between(values[first] / 2 + values[second] / 2, _signed_count(n, (1 - confidence) / 2), confidence)


def two_sample_shift(a: Floats, b: Floats, confidence: float) -> Shift:
    """Return the median of all differences of a value of the first and one of the second sample, and its interval."""
    if len(a) * len(b) > MOST_MEANS:
        return _too_many(len(a) * len(b))
    return _between(np.subtract.outer(a, b).ravel(), _sum_count(len(a), len(b), (1 - confidence) / 2), confidence)


def _too_many(count: int) -> Shift:
    return Shift(*(math.nan,) * 3, f"shift not estimated: {count:,} differences are too many")


def _between(values: Floats, count: int, confidence: float) -> Shift:
    """Return the median, and the count-th value from either end; no interval if the ends are not wide enough."""
    last = len(values) - 1
    ends = [count - 1, last - count + 1] if count > 0 else []
    values.partition([last // 2, (last + 1) // 2, *ends])
    estimate = float(values[last // 2] / 2 + values[(last + 1) // 2] / 2)
    if not ends:
        note = f"too few values for an interval with confidence {confidence:.3g}"
        return Shift(estimate, math.nan, math.nan, note)
    return Shift(estimate, *values[ends].tolist())


def _signed_count(n: int, tail: float) -> int:
    """Return how many pairwise means to count off: R's qsignrank(tail, n); 0 if no interval is wide enough."""
    if n > MOST_SIGNED:
        return round(n * (n + 1) / 4 + float(ndtri(tail)) * math.sqrt(n * (n + 1) * (2 * n + 1) / 24))
    return lower_quantile(signed_rank_chances(np.arange(1, n + 1, dtype=np.int64)), tail)


def _sum_count(n_a: int, n_b: int, tail: float) -> int:
    """Return how many differences of two samples to count off: R's qwilcox(tail, n_a, n_b)."""
    small, n = min(n_a, n_b), n_a + n_b
    chances = rank_sum_chances(np.arange(1, n + 1, dtype=np.int64), small)
    if chances is None:
        return round(n_a * n_b / 2 + float(ndtri(tail)) * math.sqrt(n_a * n_b * (n + 1) / 12))
    return lower_quantile(chances[small * (small + 1) // 2 :], tail)


def signed_rank_chances(ranks: Ints) -> Floats:
    """Return P(sum of the positive ranks = 0, 1, ...) if every rank is positive or negative with probability 1/2."""
    chances = np.zeros(int(ranks.sum()) + 1)
    chances[0], end = 1.0, 0
    for rank in np.sort(ranks).tolist():
        end += rank
        grown = chances[: end + 1] / 2
        grown[rank:] += chances[: end + 1 - rank] / 2
        chances[: end + 1] = grown
    return chances


def rank_sum_chances(ranks: Ints, size: int) -> Floats | None:
    """Return P(sum of a group's ranks = 0, 1, ...) if any `size` of the values form the group.

    None if that costs too much.
    """
    total = int(np.sort(ranks)[len(ranks) - size :].sum())
    if len(ranks) > MOST_VALUES or len(ranks) * size * total > MOST_STEPS:
        return None
    counts = np.zeros((size + 1, total + 1))
    counts[0, 0] = 1.0
    for done, rank in enumerate(np.sort(ranks).tolist()):
        most = min(done + 1, size)
        counts[1 : most + 1, rank:] += counts[:most, : total + 1 - rank].copy()
    chances: Floats = counts[size]
    chances /= chances.sum()
    return chances


def two_sided(chances: Floats, observed: int, doubled_mean: int) -> float:
    """Return P(|statistic - mean| >= |observed - mean|); `doubled_mean` is twice the mean."""
    apart = np.abs(2 * np.arange(len(chances)) - doubled_mean)
    return min(1.0, float(chances[apart >= abs(2 * observed - doubled_mean)].sum()))


def lower_quantile(chances: Floats, share: float) -> int:
    """Return the smallest value whose cumulative probability reaches `share`."""
    return int(np.searchsorted(np.cumsum(chances), share * (1 - 1e-12)))
