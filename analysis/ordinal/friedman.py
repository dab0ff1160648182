"""Friedman's test of ratings by the same participants under several conditions, with Kendall's W."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from palpate.analysis.ordinal.friedman_exact import exact_tail
from palpate.analysis.ordinal.ranks import Ints, doubled_ranks, refuse_huge, row_rounding
from palpate.analysis.ordinal.resampling import Interval, check_interval, w_interval
from palpate.analysis.statistics.cells import Aggregate, Cells, Missing, gather, name_list
from palpate.analysis.statistics.pvalues import SMALLEST, f_tail, p_note
from palpate.analysis.statistics.refusals import BadOption
from palpate.analysis.statistics.within import refuse_too_few

NO_RANKS = "undefined: every participant gave one and the same value to all conditions"
NO_EXACT = "exact p not computed: too many arrangements of the ranks"


@dataclass(frozen=True)
class RankTest:
    """Friedman's numbers for a matrix of ranks (participants, conditions); NaN where `note` says why."""

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
    """Friedman's test of a long table, corrected for ties: one row.

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


def one_factor(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable | Iterable[Hashable],
    subject: Hashable,
    missing: Missing,
    aggregate: Aggregate,
) -> tuple[Hashable, Cells]:
    """The cells of one within factor, two participants and two levels at least."""
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
    """Twice the midranks of each participant's values, ties within that participant's own rounding."""
    return doubled_ranks(cells.values, row_rounding(cells.values))


def tied_rows(ranks: Ints) -> int:
    """How many participants gave one value to several conditions."""
    ordered = np.sort(ranks, axis=1)
    return int(np.count_nonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1)))


def spread(ranks: Ints) -> tuple[int, int]:
    """Sums of squares of doubled ranks about their mean: of the column sums, and of all ranks (times 4 both)."""
    n, k = ranks.shape
    columns = [int(value) - n * (k + 1) for value in ranks.sum(axis=0).tolist()]
    values = (ranks - (k + 1)).ravel()
    return sum(value * value for value in columns), int(np.dot(values, values))


def rank_test(ranks: Ints) -> RankTest:
    """Friedman's statistics from doubled ranks, in whole numbers up to the last division.

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
