"""Friedman's test with Kendall's W, and Cochran's Q: the same participants under several conditions.

Both have an exact p, from the distribution given each participant's ties, computed participant by participant.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from itertools import permutations

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from palpate.analysis.ordinal.ranks import Ints, doubled_ranks, refuse_huge, row_rounding
from palpate.analysis.ordinal.resampling import Interval, check_interval, w_interval
from palpate.analysis.statistics.anova import refuse_too_few
from palpate.analysis.statistics.cells import Aggregate, Cells, Missing, gather, name_list
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.f_and_t import SMALLEST, f_tail, p_note
from palpate.analysis.statistics.refusals import BadOption, BadValue

NO_RANKS = "undefined: every participant gave one and the same value to all conditions"
NO_EXACT = "exact p not computed: too many arrangements of the ranks"
MOST_ARRANGEMENTS = 5040  # 7!: distinct orders of one participant's ranks
MOST_SUMS = 1_500_000  # column sums times orders, over all participants
MOST_KEY = 2**62
NO_DIFFERENCE = "every participant answered alike in all conditions: Q is undefined"


@dataclass(frozen=True)
class RankTest:
    """Friedman's numbers for a matrix of ranks (participants, conditions); NaN if `note` says why."""

    chi2: float
    df: int
    p: float
    w: float
    f: float
    p_f: float
    note: str


def friedman(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable | Iterable[Hashable],
    subject: Hashable,
    *,
    exact: bool = True,
    draws: int = 2000,
    seed: int = 0,
    confidence: float = 0.95,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return Friedman's test of a long table, corrected for ties: one row.

    `chi2`, `ddof1`, `p_unc`: the chi-squared form; `F`, `F_ddof1`, `F_ddof2`, `p_F`: Iman & Davenport's; `p_exact`:
    exact given the ties, NaN where `exact` is off or there are too many arrangements; `W`: Kendall's, `W_low` and
    `W_high` bound it by a bootstrap of participants (`draws` samples from `seed`; percentiles). `tied` counts
    participants with tied values. `missing` and `aggregate` as for `rm_anova`.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    Sources: Friedman 1937; Conover 1999, 5.8; Iman & Davenport 1980; Kendall & Babington Smith 1939.
    """
    check_interval(draws, confidence)
    factor, cells = one_factor(data, dv, within, subject, missing, aggregate)
    ranks = rank_rows(cells)
    test = rank_test(ranks)
    p_exact = exact_tail(ranks) if exact and not math.isnan(test.chi2) else math.nan
    low, high, note = w_interval(ranks, Interval(draws, seed, confidence))
    notes = [test.note, NO_EXACT if exact and math.isnan(p_exact) and not math.isnan(test.chi2) else "", note]
    n, k = ranks.shape
    row = {
        **{"Source": str(factor), "n": n, "k": k, "tied": tied_rows(ranks), "chi2": test.chi2, "ddof1": test.df},
        **{"p_unc": test.p, "p_exact": p_exact, "W": test.w, "W_low": low, "W_high": high},
        **{"F": test.f, "F_ddof1": k - 1, "F_ddof2": (k - 1) * (n - 1), "p_F": test.p_f},
        "note": "; ".join(filter(None, notes)),
    }
    table = pd.DataFrame([row])
    table.attrs.update(cells.attrs())
    return table


def cochran_q(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable,
    subject: Hashable,
    *,
    yes: float | None = None,
    exact: bool = True,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return Cochran's Q of a long table whose values are 0 (no) or 1 (yes): one row.

    The table has one value for each participant and condition.
    With `yes`, values of at least that much are 1, after averaging where `aggregate` is "mean".

    `Q`, `ddof1`, `p_unc`: the chi-squared form; `p_exact`: over all orders of each participant's own answers, NaN where
    `exact` is off or there are too many; `decides`: the participants whose answers differ, on whom Q depends. The
    attribute `yes` of the table maps each condition to its number of yes. Raises a StatisticsError (a ValueError) that
    names what is wrong with the table. Q is Friedman's chi-squared of these answers, corrected for ties. Sources:
    Cochran 1950; Patil 1975 (exact test).
    """
    factor, cells = one_factor(data, dv, within, subject, missing, aggregate)
    values = cells.values if yes is None else (cells.values >= yes).astype(np.float64)
    if odd := sorted({float(value) for value in np.unique(values)} - {0.0, 1.0}):
        raise BadValue(f"{dv!s}: {odd[0]:g} found; Cochran's Q compares answers that are 0 (no) or 1 (yes)")
    ranks = doubled_ranks(values, np.zeros_like(values))
    test = rank_test(ranks)
    alike = math.isnan(test.chi2)
    p_exact = exact_tail(ranks) if exact and not alike else math.nan
    notes = [NO_DIFFERENCE] if alike else [NO_EXACT] if exact and math.isnan(p_exact) else []
    (n, k), answered_yes = values.shape, values.sum(axis=1)
    row = {
        **{"Source": str(factor), "n": n, "k": k, "decides": int(((answered_yes > 0) & (answered_yes < k)).sum())},
        **{"Q": test.chi2, "ddof1": test.df, "p_unc": test.p, "p_exact": p_exact, "note": "; ".join(notes)},
    }
    table = pd.DataFrame([row])
    counts = values.sum(axis=0).astype(int).tolist()
    table.attrs.update(cells.attrs(), yes=dict(zip(cells.levels[0], counts, strict=True)))
    return table


def one_factor(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable | Iterable[Hashable],
    subject: Hashable,
    missing: Missing,
    aggregate: Aggregate,
) -> tuple[Hashable, Cells]:
    """Return the cells of one within factor, with at least two participants and two levels."""
    factors = name_list(within)
    if len(factors) != 1:
        raise BadOption(
            f"within={factors!r} names {len(factors)} factors; ranks compare the levels of one factor: pass "
            "aggregate='mean' to average over the others, or use aligned_ranks for several factors"
        )
    cells = gather(data, dv, factors, subject, missing, aggregate)
    refuse_too_few(cells)
    refuse_huge(cells.values)
    return factors[0], cells


def rank_rows(cells: Cells) -> Ints:
    """Return twice the midranks of each participant's values, with ties up to that participant's own rounding."""
    return doubled_ranks(cells.values, row_rounding(cells.values))


def tied_rows(ranks: Ints) -> int:
    """Return how many participants gave the same value to several conditions."""
    ordered = np.sort(ranks, axis=1)
    return int(np.count_nonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1)))


def spread(ranks: Ints) -> tuple[int, int]:
    """Return 4 times the sums of squares of doubled ranks about their mean: of the column sums, and of all ranks."""
    n, k = ranks.shape
    columns = [int(value) - n * (k + 1) for value in ranks.sum(axis=0).tolist()]
    values = (ranks - (k + 1)).ravel()
    return sum(value * value for value in columns), int(np.dot(values, values))


def rank_test(ranks: Ints) -> RankTest:
    """Return Friedman's statistics from doubled ranks, in integers up to the last division.

    chi2 = (k - 1) sum_j (R_j - n (k + 1) / 2)^2 / sum_ij (r_ij - (k + 1) / 2)^2 (Conover 1999, 5.8, equation 3).
    """
    n, k = ranks.shape
    between, total = spread(ranks)
    if total == 0:
        return RankTest(*(math.nan, k - 1, math.nan), *(math.nan,) * 3, f"chi2 and W are {NO_RANKS}")
    chi2 = Fraction((k - 1) * between, total)
    most = n * (k - 1)
    p = max(float(chdtrc(k - 1, float(chi2))), SMALLEST)
    if chi2 == most:
        note = "F is undefined: all participants rank the conditions alike"
        return RankTest(float(chi2), k - 1, p, 1.0, math.nan, math.nan, note)
    f = float((n - 1) * chi2 / (most - chi2))
    p_f = f_tail(f, k - 1, (k - 1) * (n - 1))
    return RankTest(float(chi2), k - 1, p, float(chi2 / most), f, p_f, p_note([p, p_f]))


def exact_tail(ranks: Ints) -> float:
    """Return P(statistic >= observed) with each participant's ranks in any order; NaN if that costs too much.

    Under the hypothesis every order of a participant's own (mid)ranks is equally likely. The columns are
    interchangeable, so sets of column sums are kept sorted. Probabilities only ever add, so none loses digits.
    """
    n, k = ranks.shape
    centred = ranks - (k + 1)
    # A turned scale costs as much.
    rows = min(_in_order(centred), _in_order(-centred), key=lambda ordered: ordered.tolist())
    ties = [np.unique(row, return_counts=True)[1].tolist() for row in np.unique(rows, axis=0)]
    arrangements = max(math.factorial(k) // math.prod(map(math.factorial, counts)) for counts in ties)
    if arrangements > MOST_ARRANGEMENTS or (4 * n * (k + 1)) ** k >= MOST_KEY:
        return math.nan
    observed = int((centred.sum(axis=0) ** 2).sum())
    sums, weights, done = rows[:1], np.ones(1), 0
    for row in rows[1:]:
        if len(row) <= 7:
            orders = np.array(sorted(set(permutations(row.tolist()))), dtype=np.int64)
        else:
            orders = np.array(list(_distinct(tuple(row.tolist()))), dtype=np.int64)
        done += len(sums) * len(orders)
        if done > MOST_SUMS:
            return math.nan
        # Each set of sums with each order of this participant; equal outcomes (in any column order) are joined.
        added = np.sort((sums[:, None, :] + orders[None, :, :]).reshape(-1, k), axis=1)
        base = int(added.max() - added.min()) + 1
        key = np.zeros(len(added), dtype=np.int64)
        for column in range(k):
            key = key * base + (added[:, column] - added.min())
        _, first, place = np.unique(key, return_index=True, return_inverse=True)
        shares = np.repeat(weights / len(orders), len(orders))
        summed: Floats = np.bincount(place, weights=shares).astype(np.float64)
        sums, weights = added[first].astype(np.int64), summed
    reached = (sums * sums).sum(axis=1) >= observed
    return min(1.0, max(float(weights[reached].sum()), SMALLEST))


def _in_order(rows: Ints) -> Ints:
    """Return each row's ranks in ascending order, and sorted rows, which determine the distribution."""
    rising = np.sort(rows, axis=1)
    ordered: Ints = rising[np.lexsort(rising.T)]
    return ordered


def _distinct(row: tuple[int, ...]) -> set[tuple[int, ...]]:
    """Return the distinct orders of many values, most of which are tied."""
    if len(row) == 1:
        return {row}
    return {
        (value, *rest)
        for value in set(row)
        for rest in _distinct(row[: row.index(value)] + row[row.index(value) + 1 :])
    }
