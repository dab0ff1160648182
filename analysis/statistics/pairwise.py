"""Pairwise t tests within participants or between groups, with their family of p values."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from numbers import Integral
from typing import Any, TypeAlias

import pandas as pd

from palpate.analysis.statistics.cells import Aggregate, Cells, Missing, gather, name_list
from palpate.analysis.statistics.comparisons import Comparison, paired, unpaired
from palpate.analysis.statistics.eta_intervals import checked_confidence
from palpate.analysis.statistics.groups import gather_groups
from palpate.analysis.statistics.pvalues import adjusted, p_note, t_critical, t_two_sided
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown
from palpate.analysis.statistics.standardised import dz_interval, hedges_interval
from palpate.analysis.statistics.within import refuse_too_few

Names: TypeAlias = Hashable | Iterable[Hashable] | None
ADJUSTMENTS = {"none": "none", "bonf": "bonf", "bonferroni": "bonf", "holm": "holm"}


def pairwise_tests(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Hashable | Iterable[Hashable] | None = None,
    subject: Hashable | None = None,
    between: Hashable | Iterable[Hashable] | None = None,
    padjust: str = "none",
    family: int | None = None,
    effect_interval: float | None = None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """t tests of every pair of levels of one factor, A minus B: pingouin's column names, one row per pair.

    Give `within` and `subject` (paired tests; effect size `dz`) or `between` (effect size `hedges`; pooled variance
    where both groups have the same size, Welch's test otherwise, as in pingouin). `ci_low` and `ci_high` bound the
    mean difference with 95 % confidence, not adjusted. `padjust` is "none", "bonf" ("bonferroni") or "holm"; `p_corr`
    is the adjusted p. The family is every pair here, or `family`, a number fixed beforehand (at least as many).
    `effect_interval`, such as 0.95, adds the interval of the effect size: `dz_low`, `dz_high` or `hedges_low`,
    `hedges_high`. A pair whose values do not vary has NaN and a `note`, and still counts in the family.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table or the request.
    """
    if not isinstance(padjust, str) or padjust not in ADJUSTMENTS:
        raise BadOption(f"padjust={shown(padjust)} is unknown: one of {', '.join(map(repr, ADJUSTMENTS))}")
    if ADJUSTMENTS[padjust] == "none":
        refuse_idle("family", family, None, "with padjust='none': no p is adjusted")
    level = None if effect_interval is None else checked_confidence(effect_interval)
    found = compared(data, dv, within, subject, between, missing, aggregate)
    size = _family(family, len(found.pairs))
    table = _table(found, ADJUSTMENTS[padjust], size)
    if level is not None:
        _insert_intervals(table, found, level)
    table.attrs.update(found.attrs | ({} if family is None else {"family": size}))
    return table


@dataclass(frozen=True)
class Compared:
    """Every pair of levels of one factor, compared, and what to say of the table they come from."""

    factor: Hashable
    pairs: list[Comparison]
    within: bool
    attrs: dict[str, Any]


def compared(
    data: pd.DataFrame,
    dv: Hashable,
    within: Names,
    subject: Hashable | None,
    between: Names,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Compared:
    """Compare every pair of levels of the one factor given: `within` participants or `between` groups of them."""
    if (within is None) == (between is None):
        raise BadOption("give one factor: either `within` (with `subject`) or `between`")
    if between is not None:
        groups = gather_groups(data, dv, between, subject, missing, aggregate)
        return Compared(groups.factor, list(unpaired(groups.labels, groups.values)), False, groups.attrs())
    factor, cells = _within(data, dv, within, subject, missing, aggregate)
    return Compared(factor, list(paired(cells.levels[0], cells.values)), True, cells.attrs())


def _family(family: object, pairs: int) -> int:
    """How many p values there are to adjust for."""
    if family is None:
        return pairs
    if isinstance(family, bool) or not isinstance(family, Integral):
        raise BadOption(f"family={shown(family)} is unknown: a whole number, how many tests the family has")
    if family < pairs:
        raise BadOption(f"family={family} is smaller than the {pairs} pairs tested here; a family holds all its tests")
    return int(family)


def _insert_intervals(table: pd.DataFrame, found: Compared, confidence: float) -> None:
    """Put the limits of the effect size beside it."""
    sizes = found.attrs.get("group_sizes", {})
    limits = [
        dz_interval(pair.size, int(pair.df) + 1, confidence=confidence)
        if found.within
        else hedges_interval(pair.size, sizes[pair.a], sizes[pair.b], confidence=confidence)
        for pair in found.pairs
    ]
    name = "dz" if found.within else "hedges"
    for place, end in enumerate(("low", "high")):
        table.insert(len(table.columns) - 1, f"{name}_{end}", [limit[place] for limit in limits])


def _within(
    data: pd.DataFrame, dv: Hashable, within: Names, subject: Hashable | None, missing: Missing, aggregate: Aggregate
) -> tuple[Hashable, Cells]:
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
    return factors[0], cells


def _table(found: Compared, method: str, family: int) -> pd.DataFrame:
    pairs, within = found.pairs, found.within
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
        "p_corr": adjusted(p, method, family),
        "p_adjust": [method] * len(pairs),
        "mean_diff": [pair.mean for pair in pairs],
        "ci_low": [pair.mean - width for pair, width in zip(pairs, half, strict=True)],
        "ci_high": [pair.mean + width for pair, width in zip(pairs, half, strict=True)],
        "dz" if within else "hedges": [pair.size for pair in pairs],
        "note": [pair.note or p_note([value]) for pair, value in zip(pairs, p, strict=True)],
    }
    table = pd.DataFrame(columns)
    table.insert(0, "Contrast", str(found.factor))
    return table
