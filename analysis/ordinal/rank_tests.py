"""Wilcoxon tests of every pair of levels, within participants or between groups, with their family of p values."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator
from itertools import combinations
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.ordinal.friedman import one_factor
from palpate.analysis.ordinal.rank_sums import rank_sums
from palpate.analysis.ordinal.ranks import refuse_huge
from palpate.analysis.ordinal.resampling import check_interval
from palpate.analysis.ordinal.signed_ranks import RankComparison, Zeros, signed_ranks
from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.groups import gather_groups
from palpate.analysis.statistics.pairwise import ADJUSTMENTS
from palpate.analysis.statistics.pvalues import adjusted
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown

Found: TypeAlias = tuple[Hashable, Hashable, RankComparison]


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
    """Wilcoxon tests of every pair of levels of one factor, A minus B, one row per pair.

    `within` and `subject`: signed ranks (`W` is R's V, the sum of positive ranks; `zeros` "wilcoxon" or "pratt");
    `between`: rank sums (`W` is R's W, Mann & Whitney's U of A). `p_unc` is `p_exact`, exact given all ties, or
    `p_normal` with continuity correction where the exact one would cost too much (a note says so). `shift` is the
    Hodges-Lehmann estimate with `ci_low`, `ci_high` (not adjusted), `rank_biserial` the effect size, from -1 to 1.
    `padjust` "none", "bonferroni" or "holm" over `family` tests, a size fixed beforehand (None: the pairs here).
    Raises a StatisticsError (a ValueError) that names what is wrong with the table or the request.
    """
    check_interval(100, confidence)
    method = _method(padjust, zeros)
    if method == "none":
        refuse_idle("family", family, None, "with padjust='none': no p is adjusted")
    if within is None:
        refuse_idle("zeros", zeros, "wilcoxon", "between groups: rank sums have no differences of zero")
    if (within is None) == (between is None):
        raise BadOption("give one factor: either `within` (with `subject`) or `between`")
    if within is not None and subject is None:
        raise BadOption("within needs `subject`, the column that says who gave each value")
    if within is not None:
        factor, cells = one_factor(data, dv, within, subject, missing, aggregate)
        found = _pairs(cells.levels[0], list(cells.values.T))
        pairs, attrs = [(a, b, signed_ranks(x, y, zeros, confidence)) for a, b, x, y in found], cells.attrs()
    else:
        groups = gather_groups(data, dv, between, subject, missing, aggregate)
        refuse_huge(np.concatenate(groups.values))
        factor, attrs = groups.factor, groups.attrs()
        pairs = [(a, b, rank_sums(x, y, confidence)) for a, b, x, y in _pairs(groups.labels, groups.values)]
    table = _table(factor, within is not None, pairs, method, family)
    table.attrs.update(attrs)
    return table


def _method(padjust: object, zeros: object) -> str:
    if not isinstance(padjust, str) or padjust not in ADJUSTMENTS:
        raise BadOption(f"padjust={shown(padjust)} is unknown: one of {', '.join(map(repr, ADJUSTMENTS))}")
    if not isinstance(zeros, str) or zeros not in ("wilcoxon", "pratt"):
        raise BadOption(f"zeros={shown(zeros)} is unknown: 'wilcoxon' (left out) or 'pratt' (ranked, then left out)")
    return ADJUSTMENTS[padjust]


def _pairs(labels: list[Any], values: list[Any]) -> Iterator[tuple[Any, Any, Any, Any]]:
    for i, j in combinations(range(len(labels)), 2):
        yield labels[i], labels[j], values[i], values[j]


def in_family(p: list[float], method: str, family: int | None) -> list[float]:
    """The p values adjusted as members of a family of this size; refuses a family smaller than its tests."""
    size = len(p) if family is None else family
    if isinstance(size, bool) or not isinstance(size, int) or size < len(p):
        raise BadOption(f"family={shown(family)}: a whole number is expected, at least the {len(p)} tests made here")
    return adjusted([*p, *[math.nan] * (size - len(p))], method)[: len(p)]


def _table(factor: Hashable, paired: bool, pairs: list[Found], method: str, family: int | None) -> pd.DataFrame:
    adjusted_p = in_family([found.p for _, _, found in pairs], method, family)
    size = len(pairs) if family is None else family
    rows = [
        {"Contrast": str(factor), "A": a, "B": b, "Paired": paired}
        | _numbers(found)
        | {"p_corr": p, "p_adjust": method, "family": size, "note": found.note}
        for (a, b, found), p in zip(pairs, adjusted_p, strict=True)
    ]
    return pd.DataFrame(rows)


def _numbers(found: RankComparison) -> dict[str, float | int]:
    sizes = {"n_A": found.n[0], "n_B": found.n[1], "zeros": found.zeros}
    tests = {"W": found.statistic, "z": found.z, "rank_biserial": found.size}
    shift = {"shift": found.shift.estimate, "ci_low": found.shift.low, "ci_high": found.shift.high}
    return {**sizes, **tests, **shift, "p_normal": found.p_normal, "p_exact": found.p_exact, "p_unc": found.p}
