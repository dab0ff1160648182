"""Pairwise t tests within participants or between groups, with their family of p values."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from typing import Any

import pandas as pd

from analysis.statistics.cells import Aggregate, Missing, gather, name_list
from analysis.statistics.comparisons import Comparison, paired, unpaired
from analysis.statistics.groups import gather_groups
from analysis.statistics.pvalues import adjusted, p_note, t_critical, t_two_sided
from analysis.statistics.refusals import BadOption, shown
from analysis.statistics.within import refuse_too_few

ADJUSTMENTS = {"none": "none", "bonf": "bonf", "bonferroni": "bonf", "holm": "holm"}


def pairwise_tests(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Hashable | Iterable[Hashable] | None = None,
    subject: Hashable | None = None,
    between: Hashable | Iterable[Hashable] | None = None,
    padjust: str = "none",
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """t tests of every pair of levels of one factor, A minus B: pingouin's column names, one row per pair.

    Give `within` and `subject` (paired tests; effect size `dz`) or `between` (effect size `hedges`; pooled variance
    where both groups have the same size, Welch's test otherwise, as in pingouin). `ci_low` and `ci_high` bound the
    mean difference with 95 % confidence, not adjusted. `padjust` is "none", "bonf" ("bonferroni") or "holm"; `p_corr`
    is the adjusted p. A pair whose values do not vary has NaN and a `note`, and still counts in the family.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table or the request.
    """
    if not isinstance(padjust, str) or padjust not in ADJUSTMENTS:
        raise BadOption(f"padjust={shown(padjust)} is unknown: one of {', '.join(map(repr, ADJUSTMENTS))}")
    if (within is None) == (between is None):
        raise BadOption("give one factor: either `within` (with `subject`) or `between`")
    if within is not None:
        factor, pairs, attrs = _within(data, dv, within, subject, missing, aggregate)
    else:
        groups = gather_groups(data, dv, between, subject, missing, aggregate)
        factor, pairs, attrs = groups.factor, unpaired(groups.labels, groups.values), groups.attrs()
    table = _table(list(pairs), str(factor), within is not None, ADJUSTMENTS[padjust])
    table.attrs.update(attrs)
    return table


def _within(
    data: pd.DataFrame, dv: Hashable, within: Any, subject: Hashable | None, missing: Missing, aggregate: Aggregate
) -> tuple[Hashable, Iterator[Comparison], dict[str, Any]]:
    factors = name_list(within)
    if len(factors) != 1:
        raise BadOption(
            f"within={factors!r} names {len(factors)} factors; compare the levels of one factor at a time, and pass "
            "aggregate='mean' to average over the others"
        )
    if subject is None:
        raise BadOption("within needs `subject`, the column that says who gave each value")
    cells = gather(data, dv, factors, subject, missing, aggregate)
    refuse_too_few(cells)
    return factors[0], paired(cells.levels[0], cells.values), cells.attrs()


def _table(pairs: list[Comparison], factor: str, within: bool, method: str) -> pd.DataFrame:
    p = [t_two_sided(pair.t, pair.df) for pair in pairs]
    half = [t_critical(pair.df) * pair.error for pair in pairs]
    columns: dict[str, list[Any]] = {
        "A": [pair.a for pair in pairs],
        "B": [pair.b for pair in pairs],
        "Paired": [within] * len(pairs),
        "T": [pair.t for pair in pairs],
        "dof": [float(pair.df) for pair in pairs],
        "alternative": ["two-sided"] * len(pairs),
        "p_unc": p,
        "p_corr": adjusted(p, method),
        "p_adjust": [method] * len(pairs),
        "mean_diff": [pair.mean for pair in pairs],
        "ci_low": [pair.mean - width for pair, width in zip(pairs, half, strict=True)],
        "ci_high": [pair.mean + width for pair, width in zip(pairs, half, strict=True)],
        "dz" if within else "hedges": [pair.size for pair in pairs],
        "note": [pair.note or p_note([value]) for pair, value in zip(pairs, p, strict=True)],
    }
    table = pd.DataFrame(columns)
    table.insert(0, "Contrast", factor)
    return table
