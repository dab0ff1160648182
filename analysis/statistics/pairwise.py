"""Pairwise t tests within participants or between groups, with adjustment of p values in a family."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from numbers import Integral
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.statistics.anova import refuse_too_few
from palpate.analysis.statistics.cells import Aggregate, Missing, gather, name_list
from palpate.analysis.statistics.doubles import (
    ROUNDING_ULPS,
    Floats,
    centred,
    deviation_ss,
    difference,
    differences,
    exact_sum,
    rescaled,
    row_sums,
    scaled,
)
from palpate.analysis.statistics.f_and_t import (
    adjusted,
    checked_confidence,
    dz_interval,
    hedges_interval,
    p_note,
    t_critical,
    t_two_sided,
)
from palpate.analysis.statistics.groups import gather_groups
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown

Names: TypeAlias = Hashable | Iterable[Hashable] | None
ADJUSTMENTS = {"none": "none", "bonf": "bonf", "bonferroni": "bonf", "holm": "holm"}
ENDS = (("ci_low", "ci_high"), ("bound_low", "bound_high"), ("T_low", "T_high"))


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
    """Return the t tests of every pair of levels of one factor, A minus B: pingouin's columns, one row per pair.

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
    comparisons = compare_levels(data, dv, within, subject, between, missing, aggregate)
    size = _family(family, len(comparisons.pairs))
    table = _table(comparisons, ADJUSTMENTS[padjust], size)
    if level is not None:
        # Put the limits of the effect size beside it.
        sizes = comparisons.attrs.get("group_sizes", {})
        limits = [
            dz_interval(pair.size, int(pair.df) + 1, confidence=level)
            if comparisons.within
            else hedges_interval(pair.size, sizes[pair.a], sizes[pair.b], confidence=level)
            for pair in comparisons.pairs
        ]
        name = "dz" if comparisons.within else "hedges"
        for place, end in enumerate(("low", "high")):
            table.insert(len(table.columns) - 1, f"{name}_{end}", [limit[place] for limit in limits])
    table.attrs.update(comparisons.attrs | ({} if family is None else {"family": size}))
    return table


@dataclass(frozen=True)
class Comparisons:
    """The comparisons of all pairs of levels of one factor, and notes on the table."""

    factor: Hashable
    pairs: list[Comparison]
    within: bool
    attrs: dict[str, Any]


def compare_levels(
    data: pd.DataFrame,
    dv: Hashable,
    within: Names,
    subject: Hashable | None,
    between: Names,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Comparisons:
    """Compare every pair of levels of the given factor: `within` participants or `between` groups of them."""
    if (within is None) == (between is None):
        raise BadOption("give one factor: either `within` (with `subject`) or `between`")
    if between is not None:
        groups = gather_groups(data, dv, between, subject, missing, aggregate)
        return Comparisons(groups.factor, list(unpaired(groups.labels, groups.values)), False, groups.attrs())
    factors = name_list(within)
    if len(factors) != 1:
        raise BadOption(
            f"within={factors!r} names {len(factors)} factors; compare the levels of one factor at a time, and pass "
            "aggregate='mean' to average over the others"
        )
    if subject is None:
        raise BadOption("within needs `subject`, the column of participants")
    cells = gather(data, dv, factors, subject, missing, aggregate)
    refuse_too_few(cells)
    return Comparisons(factors[0], list(paired(cells.levels[0], cells.values)), True, cells.attrs())


def _family(family: object, pairs: int) -> int:
    """Return the number of p values to adjust for."""
    if family is None:
        return pairs
    if isinstance(family, bool) or not isinstance(family, Integral):
        raise BadOption(f"family={shown(family)} is unknown: a whole number, how many tests the family has")
    if family < pairs:
        raise BadOption(f"family={family} is smaller than the {pairs} pairs tested here; a family holds all its tests")
    return int(family)


def _table(comparisons: Comparisons, method: str, family: int) -> pd.DataFrame:
    pairs, within = comparisons.pairs, comparisons.within
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
    table.insert(0, "Contrast", str(comparisons.factor))
    return table


class Comparison(NamedTuple):
    """Level A minus level B: mean difference and standard error in the data's unit, t, df, standardised size.

    `spread` is the unit of the size: the standard deviation of the differences, or the groups' pooled one. If t is
    undefined, `t` and `size` are NaN and `note` says why.
    """

    a: Hashable
    b: Hashable
    mean: float
    error: float
    t: float
    df: float
    size: float
    note: str
    spread: float


def paired(labels: Sequence[Hashable], values: Floats) -> Iterator[Comparison]:
    """Yield the comparison of every pair of columns of an array (participants, levels); size is dz = mean / SD."""
    x, exponent = scaled(values)
    limits = ROUNDING_ULPS * np.spacing(np.abs(x).max(axis=0))
    for i in range(len(labels) - 1):
        # Mean and standard deviation of column i minus each later column.
        high, low = difference(x[:, i : i + 1], x[:, i + 1 :])
        change, rest = differences((high, low), 0)
        deviations = centred(change if rest is None else change + rest, 0) / len(x)
        spreads = np.sqrt(np.add.reduce(deviations * deviations, axis=0) / (len(x) - 1))
        means = row_sums((high.T, low.T)) / len(x)
        floors = np.maximum(limits[i], limits[i + 1 :])
        later = zip(labels[i + 1 :], means.tolist(), spreads.tolist(), floors.tolist(), strict=True)
        for label, mean, spread, floor in later:
            error = spread / math.sqrt(len(x))
            note = "" if spread > floor else _same(mean, floor, spread, "differences")
            t, size = (math.nan, math.nan) if note else (mean / error, mean / spread)
            plain, own_error, own_spread = (rescaled(value, exponent) for value in (mean, error, spread))
            yield Comparison(labels[i], label, plain, own_error, t, len(x) - 1, size, note, own_spread)


def _same(mean: float, floor: float, spread: float, what: str) -> str:
    level = "do not vary" if spread == 0 else "vary only at the rounding level of the data"
    return f"t is undefined: the {what} {level}" + (" and their mean is zero" if abs(mean) <= floor else "")


class _Sample(NamedTuple):
    """One group in scaled units: size, exact mean deviation from the common pivot, sum of squares, rounding level."""

    label: Hashable
    n: int
    mean: float
    low: float  # what `mean` as a double leaves out
    ss: float
    floor: float


def unpaired(labels: Sequence[Hashable], groups: Sequence[Floats]) -> Iterator[Comparison]:
    """Yield the comparison of every pair of groups: pooled variance for equal sizes, else Welch's; Hedges' g."""
    x, exponent = scaled(np.concatenate(groups))
    parts = np.split(x, np.cumsum([len(group) for group in groups])[:-1])
    samples = []
    for label, part in zip(labels, parts, strict=True):
        exact_mean = exact_sum(part, float(x[0])) / len(part)
        high = float(exact_mean)
        floor = ROUNDING_ULPS * float(np.spacing(np.abs(part).max()))
        samples.append(_Sample(label, len(part), high, float(exact_mean - Fraction(high)), deviation_ss(part), floor))
    for a, b in combinations(samples, 2):
        mean = (a.mean - b.mean) + (a.low - b.low)
        floor, df = max(a.floor, b.floor), float(a.n + b.n - 2)
        if min(a.n, b.n) == 1 and (df == 0 or a.n != b.n):
            note, error = "t is undefined: a group has one value", math.nan
        else:
            spread = math.sqrt((a.ss + b.ss) / (a.n + b.n))
            note = "" if spread > floor else _same(mean, floor, spread, "values of each group")
            if a.n != b.n and not note:
                # Standard error and degrees of freedom of Welch 1947.
                va, vb = a.ss / (a.n - 1) / a.n, b.ss / (b.n - 1) / b.n
                share = va / (va + vb)
                error, df = math.sqrt(va + vb), 1 / (share**2 / (a.n - 1) + (1 - share) ** 2 / (b.n - 1))
            else:
                error = math.sqrt((a.ss + b.ss) / (a.n + b.n - 2) * (1 / a.n + 1 / b.n))
        size = math.nan if note else hedges_g(mean, a.ss + b.ss, a.n + b.n)
        t = math.nan if note else mean / error
        pooled = math.sqrt((a.ss + b.ss) / (a.n + b.n - 2)) if a.n + b.n > 2 else math.nan
        plain, own_error, own_spread = (rescaled(value, exponent) for value in (mean, error, pooled))
        yield Comparison(a.label, b.label, plain, own_error, t, df, size, note, own_spread)


def hedges_g(mean: float, ss: float, n: int) -> float:
    """Return the mean difference in pooled SDs times 1 - 3 / (4 n - 9), the factor for small samples (Hedges 1981)."""
    return mean / math.sqrt(ss / (n - 2)) * (1 - 3 / (4 * n - 9))


def pairs_in_order(
    table: pd.DataFrame, order: Sequence[str], sizes: Sequence[str] = ("dz",), turned: pd.DataFrame | None = None
) -> list[dict[str, Any]]:
    """Return the rows of a table of pairs (columns A and B), with A and B in the order of `order`.

    Levels that `order` does not name come last. `sizes` are the columns of effect sizes, which change sign with the
    differences. `turned` is a table with the rows of B minus A, for tests where more than signs change (asymmetric
    bounds); with None they are computed from `table`.
    """
    place = {level: at for at, level in enumerate(order)}
    places = {level: place.get(str(level), len(place)) for level in {*table["A"], *table["B"]}}
    backwards = (table if turned is None else turned).to_dict("records")
    rows = [
        {str(name): value for name, value in row.items()}
        if places[row["A"]] <= places[row["B"]]
        else _turned(back, sizes)
        for row, back in zip(table.to_dict("records"), backwards, strict=True)
    ]
    return sorted(rows, key=lambda row: (places[row["A"]], places[row["B"]]))


def _turned(row: Mapping[Any, Any], sizes: Sequence[str]) -> dict[str, Any]:
    """Return the row of B minus A instead of A minus B."""
    ends = (*ENDS, *((f"{size}_low", f"{size}_high") for size in sizes))
    signed = {name: -row[name] for name in ("mean_diff", "T", *sizes) if name in row}
    swapped = {a: -row[b] for low, high in ends if low in row for a, b in ((low, high), (high, low))}
    p = {"p_low": row["p_high"], "p_high": row["p_low"]} if "p_low" in row else {}
    return {**{str(name): value for name, value in row.items()}, "A": row["B"], "B": row["A"], **signed, **swapped, **p}
