"""Kendall's W: how much raters agree on the order of targets, and how probable such a W is by chance."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd
from scipy.special import gammaincc

from palpate.analysis.ordinal.friedman import exact_tail
from palpate.analysis.ordinal.ranks import Ints, doubled_ranks, refuse_huge, row_rounding
from palpate.analysis.reliability.crossed import cross_table, refuse_few
from palpate.analysis.reliability.intraclass import GAPS, Missing
from palpate.analysis.statistics.cells import Aggregate
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import generator
from palpate.analysis.statistics.f_and_t import SMALLEST
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown

PKind: TypeAlias = Literal["auto", "exact", "permutation", "chi2"]
DRAWS = 10_000
NO_DRAWS = "with p='chi2': nothing is drawn"
AFFORDABLE = 50_000_000  # ranks to shuffle for a p from draws, where the kind of p is left to us


def kendall_w(
    data: pd.DataFrame,
    dv: Hashable,
    targets: Hashable,
    raters: Hashable,
    *,
    p: PKind = "auto",
    draws: int = DRAWS,
    seed: int = 0,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return Kendall's coefficient of concordance of a long table, corrected for ties: one row.

    Columns: W, mean_rank_r (the mean Spearman correlation of two raters where nobody ties), chi2, df, p_chi2, p, p_kind
    ("exact", "permutation" or "chi2"), raters, targets, raters_with_ties, note. `p="auto"` enumerates all orders
    where they are few enough, shuffles each rater's ranks `draws` times otherwise, and falls back on chi squared for
    very large tables. Source: Kendall & Babington Smith 1939; ties: Kendall 1970, ch. 6.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    """
    if p not in ("auto", "exact", "permutation", "chi2"):
        raise BadOption(f"p={shown(p)} is unknown: 'auto', 'exact', 'permutation' or 'chi2'")
    if p == "chi2":
        refuse_idle("draws", draws, DRAWS, NO_DRAWS)
        refuse_idle("seed", seed, 0, NO_DRAWS)
    if isinstance(draws, bool) or not isinstance(draws, int) or draws < 100:
        raise BadOption(f"draws={shown(draws)}: a whole number from 100 is expected")
    if not isinstance(missing, str) or missing not in GAPS:
        raise BadOption(f"missing={shown(missing)} is unknown: one of {', '.join(map(repr, GAPS))}")
    table = cross_table(data, dv, targets, raters, gaps=GAPS[missing], aggregate=aggregate)  # type: ignore[arg-type]
    refuse_few(table, f"targets ({targets})", f"raters ({raters})")
    table_of_w = pd.DataFrame([concordance(table.values, p, draws, seed)])
    table_of_w.attrs.update(table.attrs("targets", "raters") | {"draws": draws, "seed": seed})
    return table_of_w


def concordance(values: Floats, p: PKind = "chi2", draws: int = 10_000, seed: int = 0) -> dict[str, object]:
    """Return Kendall's W of an array (targets, raters) without gaps, under the names of the table's columns."""
    n, m = values.shape
    refuse_huge(values)
    ranks = doubled_ranks(values.T, row_rounding(values.T))
    # The sum of t^3 - t over all ties of all raters, and how many raters put all targets level.
    runs = [np.unique(row, return_counts=True)[1] for row in ranks]
    tied, still = int(sum((run**3 - run).sum() for run in runs)), sum(len(run) == 1 for run in runs)
    # Doubled ranks are whole numbers, and so are these: 4 S, and 4 times the largest S that the ties allow.
    deviation = ranks.sum(axis=0) - m * (n + 1)
    spread = int((deviation**2).sum())
    largest = (m * m * (n**3 - n) - m * tied) // 3
    w = spread / largest if largest else math.nan
    chi2 = m * (n - 1) * w
    asymptotic = chi2_tail(chi2, n - 1)
    p_value, kind, why = _p(ranks, spread, asymptotic, p, draws, seed) if largest else (math.nan, "none", "")
    still_note = f"{still} of {m} raters put all targets level and say nothing of their order" if still else ""
    if still == m:
        still_note = "W is undefined: every rater puts all targets level"
    return {
        **{"W": w, "mean_rank_r": (m * w - 1) / (m - 1), "chi2": chi2, "df": n - 1, "p_chi2": asymptotic},
        **{
            "p": p_value,
            "p_kind": kind,
            "raters": m,
            "targets": n,
            "raters_with_ties": sum(len(np.unique(row)) < len(row) for row in ranks),
        },
        "note": "; ".join(filter(None, (still_note, why))),
    }


def _p(ranks: Ints, spread: int, asymptotic: float, kind: PKind, draws: int, seed: int) -> tuple[float, str, str]:
    """Return p, its kind, and the reason if it is not of the requested kind."""
    why = ""
    if kind in ("auto", "exact"):
        exact = exact_tail(ranks)
        if not math.isnan(exact):
            return exact, "exact", ""
        why = "too many orders for an exact p" if kind == "exact" else ""
    if kind == "chi2" or (kind == "auto" and draws * ranks.size > AFFORDABLE):
        return asymptotic, "chi2", why
    return permutation_p(ranks, spread, draws, seed), "permutation", why


def chi2_tail(statistic: float, df: int) -> float:
    """Return P(chi squared > statistic): NaN for NaN, never 0."""
    return math.nan if math.isnan(statistic) else max(float(gammaincc(df / 2, statistic / 2)), SMALLEST)


def permutation_p(ranks: Ints, spread: int, draws: int, seed: int) -> float:
    """Return the share of shuffled tables with at least as much spread: (1 + hits) / (1 + draws).

    Counted in this way, p is valid and never 0 (Phipson & Smyth 2010).
    """
    rng = generator(seed, "kendall_w")
    m, n = ranks.shape
    centred = ranks - (n + 1)
    block, hits = max(1, 2_000_000 // ranks.size), 0
    for start in range(0, draws, block):
        size = min(block, draws - start)
        shuffled = rng.permuted(np.broadcast_to(centred, (size, m, n)), axis=2)
        hits += int(((shuffled.sum(axis=1) ** 2).sum(axis=1) >= spread).sum())
    return (1 + hits) / (1 + draws)
