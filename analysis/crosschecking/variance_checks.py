"""Comparison of analyses of variance, pairs of levels, their equivalence and rank tests with another package's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.crosschecking import conditions, packages
from palpate.analysis.crosschecking.conditions import (
    MOST_VALUES_SQUARED,
    NEAR_ZERO,
    PINGOUIN,
    SCIPY,
    STATSMODELS,
    Checked,
    NotChecked,
    Pair,
    cells_of,
    demand_size,
    refuse,
    wide_table,
)
from palpate.analysis.plans.answers import Answer, QuestionResult

ETAS = {"ng2": "generalized_eta_squared", "np2": "partial_eta_squared"}
LEAST_TAIL = 1e-9
"""The least tail of SciPy's studentized range with six digits, since it is 1 minus the distribution."""
ALIGNED_DECIMALS = 9


def check_anova(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Check an analysis of variance of complete data."""
    settings: Any = answered.settings
    cells, named, own, groups = crossed(settings, rows)
    package, run = anova_of(cells, own, groups, settings.sum_of_squares)
    return package, _anova_pairs(answer, named, run)


def crossed(settings: Any, rows: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, str], list[str], list[str]]:
    """Return the means of a design's cells, the plain names of its factors, and the within and the between factors."""
    within, between = list(settings.within), list(settings.between)
    cells = cells_of(rows, ["participant", *within, *between])
    named = dict(zip((*within, *between), cells.columns[1:], strict=False))
    return cells, named, [named[name] for name in within], [named[name] for name in between]


def anova_of(
    cells: pd.DataFrame, own: list[str], groups: list[str], sum_of_squares: str
) -> tuple[str, Callable[[], packages.Numbers]]:
    """Return the package that supports this analysis of variance of complete `cells` (f0: participants), and its call.

    Raises NotChecked where neither supports it, or it is known to be wrong on these data.
    """
    demand_size(len(cells))
    if not own:
        values, labels = cells["y"].to_numpy(), cells[groups].agg(", ".join, axis=1).tolist()
        refuse(conditions.out_of_range(values), conditions.drowned(values, labels))
        return PINGOUIN, lambda: packages.read_pingouin_anova(
            packages.pingouin_between(cells, "y", groups, sum_of_squares)
        )
    wide = wide_table(cells, "f0", own)
    refuse(conditions.incomplete(wide))
    values = wide.to_numpy(dtype=float).reshape(len(wide), *(cells[name].nunique() for name in own))
    people = cells.drop_duplicates("f0").set_index("f0").loc[wide.index]
    of_groups = people[groups].agg(", ".join, axis=1).tolist() if groups else None
    refuse(conditions.out_of_range(values), conditions.drowned(values, of_groups))
    if not groups and (len(own) == 1 or (len(own) == 2 and len(wide) > 2)):  # of two people pingouin gives no epsilon
        return PINGOUIN, lambda: packages.read_pingouin_anova(packages.pingouin_within(cells, "y", own, "f0"))
    if not groups:
        demand_size(len(cells), MOST_VALUES_SQUARED)
        return STATSMODELS, lambda: packages.read_statsmodels_within(packages.statsmodels_within(cells, "y", own, "f0"))
    if len(own) > 1 or len(groups) > 1:
        raise NotChecked("neither package has a mixed ANOVA of more than one factor within or between")
    refuse(conditions.another_type(people[groups[0]].value_counts().tolist(), sum_of_squares))
    return PINGOUIN, lambda: packages.read_pingouin_anova(packages.pingouin_mixed(cells, "y", own[0], groups[0], "f0"))


def by_effect(numbers: packages.Numbers) -> dict[tuple[frozenset[str], str], float]:
    """Return the numbers by an effect's set of factors, in any order, and the column."""
    return {(frozenset(source.split(":")), column): value for (source, column), value in numbers.items()}


def _anova_pairs(answer: Answer, named: Mapping[str, str], run: Callable[[], packages.Numbers]) -> Iterator[Pair]:
    """Yield F, p (corrected as in the row), epsilon and eta squared of every effect; `named` maps factors' names."""
    by_factors = by_effect(run())
    for row in answer.rows:
        effect = str(row["effect"])
        key = frozenset(parts_of(effect, named))
        if (key, "F") not in by_factors:
            raise NotChecked(f"the other table has no effect {effect}")
        columns = {
            "F": "F",
            "p_uncorrected": "p_unc",
            "p_greenhouse_geisser": "p_GG_corr",
            "epsilon_greenhouse_geisser": "eps",
            "p": {"GG": "p_GG_corr", "none": "p_unc"}.get(str(row["correction"]), ""),
            **{ours: theirs for theirs, ours in ETAS.items()},
            "eta_squared": "np2",
        }
        for ours, theirs in columns.items():
            corrected = theirs in ("p_GG_corr", "eps")
            if ours in row and (key, theirs) in by_factors and not (corrected and row["correction"] == "none"):
                floor = 0.0 if ours.startswith("p") and ours != "partial_eta_squared" else NEAR_ZERO
                yield Pair(f"{ours} of {effect}", row[ours], by_factors[key, theirs], floor)


def parts_of(effect: str, named: Mapping[str, str]) -> list[str]:
    """Return the plain names of an effect's factors, whose own names may contain a colon."""
    names = sorted(named, key=len, reverse=True)
    plain = []
    for name in names:
        if name == effect or effect.startswith(f"{name}:") or effect.endswith(f":{name}") or f":{name}:" in effect:
            plain.append(named[name])
            effect = f":{effect}:".replace(f":{name}:", ":", 1).strip(":")
    return plain


def check_pairs(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    values, paired = _levels(rows, settings.factor)
    return STATSMODELS, _pairs_of(answer, values, paired, settings.correction, settings.family)


def _levels(rows: pd.DataFrame, factor: str) -> tuple[dict[str, Any], bool]:
    """Return the values of each level, and whether they are paired, in the order of the participants."""
    cells = cells_of(rows, ["participant", factor])
    demand_size(len(cells))
    values = cells["y"].to_numpy()
    refuse(conditions.out_of_range(values))
    paired = bool(cells.groupby("f0")["f1"].nunique().max() > 1)
    if paired:
        wide = wide_table(cells, "f0", ["f1"])
        refuse(conditions.incomplete(wide), conditions.undefined_pair(wide))
        return {str(level): wide[level].to_numpy() for level in wide.columns}, True
    refuse(conditions.constant_groups(values, cells["f1"].tolist()))
    return {str(level): own["y"].to_numpy() for level, own in cells.groupby("f1")}, False


def _pairs_of(
    answer: Answer, values: Mapping[str, Any], paired: bool, correction: str, family: int | None
) -> Iterator[Pair]:
    results = [packages.statsmodels_t(values[str(row["a"])], values[str(row["b"])], paired) for row in answer.rows]
    adjusted = packages.statsmodels_adjusted([theirs["p_unc"] for theirs in results], correction)
    for row, theirs, p in zip(answer.rows, results, adjusted, strict=True):
        pair = f"{row['a']} and {row['b']}"
        yield Pair(f"t of {pair}", row["t"], theirs["T"], NEAR_ZERO)
        yield Pair(f"df of {pair}", row["df"], theirs["dof"])
        yield Pair(f"p_uncorrected of {pair}", row["p_uncorrected"], theirs["p_unc"])
        if family is None:  # statsmodels' family is always the pairs that it is given
            yield Pair(f"p of {pair}", row["p"], p)


def check_equivalence(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    values, paired = _levels(rows, settings.factor)
    return STATSMODELS, _equivalence_pairs(answer, values, paired)


def _equivalence_pairs(answer: Answer, values: Mapping[str, Any], paired: bool) -> Iterator[Pair]:
    for row in answer.rows:
        a, b = str(row["a"]), str(row["b"])
        low, high = (float(row[name] or 0.0) for name in ("bound_low", "bound_high"))
        p_values = packages.statsmodels_equivalence(values[a], values[b], low, high, paired)
        for name, value in zip(("p_low", "p_high"), p_values, strict=True):
            yield Pair(f"{name} of {a} and {b}", row[name], value)


def check_friedman(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    cells = cells_of(rows, ["participant", settings.factor])
    _demand_ranks(cells, "f0", "f1")
    columns = {"chi2": "chi2", "ddof1": "ddof1", "p_unc": "p_unc", "W": "W"}
    return PINGOUIN, _friedman_pairs(answer, cells, "f1", "f0", columns)


def check_kendall_w(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    cells = cells_of(rows, [settings.raters, settings.targets], settings.value)
    _demand_ranks(cells, "f0", "f1")
    columns = {"chi2": "chi2", "df": "ddof1", "p_chi2": "p_unc", "W": "W"}
    return PINGOUIN, _friedman_pairs(answer, cells, "f1", "f0", columns)


def _demand_ranks(cells: pd.DataFrame, people: str, factor: str) -> None:
    demand_size(len(cells))
    wide = wide_table(cells, people, [factor])
    refuse(conditions.incomplete(wide), conditions.nearly_tied(wide), conditions.all_tied(wide))


def _friedman_pairs(
    answer: Answer, cells: pd.DataFrame, within: str, subject: str, columns: Mapping[str, str]
) -> Iterator[Pair]:
    numbers = packages.read_pingouin_friedman(packages.pingouin_friedman(cells, "y", within, subject))
    for row in answer.rows:
        for ours, theirs in columns.items():
            if ours in row:
                yield Pair(ours, row[ours], numbers[theirs], 0.0 if ours.startswith("p") else NEAR_ZERO)


def check_nemenyi(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Check mean ranks by pandas, and p by SciPy's studentized range where that is accurate."""
    settings: Any = answered.settings
    cells = cells_of(rows, ["participant", settings.factor])
    _demand_ranks(cells, "f0", "f1")
    return SCIPY, _nemenyi_pairs(answer, wide_table(cells, "f0", ["f1"]).rank(axis=1), settings.ties)


def _nemenyi_pairs(answer: Answer, ranks: pd.DataFrame, ties: bool) -> Iterator[Pair]:
    n, k = ranks.shape
    means = ranks.mean()
    error = (float(ranks.var(axis=1, ddof=1).mean()) / n if ties else k * (k + 1) / (12 * n)) ** 0.5
    for row in answer.rows:
        a, b = str(row["A"]), str(row["B"])
        apart = float(means[a] - means[b])
        yield Pair(f"mean rank of {a}", row["mean_rank_A"], float(means[a]))
        yield Pair(f"mean rank of {b}", row["mean_rank_B"], float(means[b]))
        yield Pair(f"q of {a} and {b}", row["q"], abs(apart) / error, NEAR_ZERO)
        p = packages.scipy_studentized_range(abs(apart) / error, k)
        if p > LEAST_TAIL:
            yield Pair(f"p of {a} and {b}", row["p"], p)


def check_wilcoxon(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Check signed ranks or rank sums of every pair of levels."""
    settings: Any = answered.settings
    cells = cells_of(rows, ["participant", settings.factor])
    demand_size(len(cells))
    refuse(conditions.out_of_range(cells["y"].to_numpy()))
    paired = bool(cells.groupby("f0")["f1"].nunique().max() > 1)
    if paired:
        wide = wide_table(cells, "f0", ["f1"])
        refuse(conditions.incomplete(wide))
        levels = {str(level): wide[level].to_numpy() for level in wide.columns}
        refuse(conditions.nearly_equal_differences(levels))
    else:
        levels = {str(level): own["y"].to_numpy() for level, own in cells.groupby("f1")}
        together = [pd.DataFrame([np.concatenate(pair)]) for pair in combinations(levels.values(), 2)]
        refuse(*map(conditions.nearly_tied, together), *map(conditions.all_tied, together))
    return PINGOUIN, _wilcoxon_pairs(answer, levels, settings, paired)


def _wilcoxon_pairs(answer: Answer, levels: Mapping[str, Any], settings: Any, paired: bool) -> Iterator[Pair]:
    """Yield W, rank-biserial correlation and p of each pair, and adjusted p if the packages give every p."""
    known: list[float | None] = []
    for row in answer.rows:
        a, b = levels[str(row["A"])], levels[str(row["B"])]
        numbers = packages.pingouin_signed_ranks(a, b, settings.zeros) if paired else packages.pingouin_rank_sums(a, b)
        pair = f"{row['A']} and {row['B']}"
        yield Pair(f"W of {pair}", row["W"], numbers["W"], NEAR_ZERO)
        if "RBC" in numbers:
            yield Pair(f"rank-biserial correlation of {pair}", row["rank_biserial"], numbers["RBC"], NEAR_ZERO)
        for name in ("p_normal", "p_exact"):
            if name in numbers:
                yield Pair(f"{name} of {pair}", row[name], numbers[name])
        known.append(numbers.get("p_normal" if row["p_exact"] is None else "p_exact"))
    whole = [p for p in known if p is not None]
    if settings.family is None and len(whole) == len(known):
        for row, p in zip(answer.rows, packages.statsmodels_adjusted(whole, settings.correction), strict=True):
            yield Pair(f"p of {row['A']} and {row['B']}", row["p_corr"], p)


def check_aligned_ranks(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Check each effect: align by means with pandas, rank, and run another package's analysis of variance."""
    settings: Any = answered.settings
    cells, named, own, groups = crossed(settings, rows)
    values = cells["y"].to_numpy()
    refuse(conditions.out_of_range(values), conditions.far_from_zero(values))
    runs = []
    for row in answer.rows:
        effect = parts_of(str(row["Source"]), named)
        ranks = cells.assign(y=_aligned(cells, [*own, *groups], effect))
        runs.append((row, frozenset(effect), *anova_of(ranks, own, groups, settings.sum_of_squares)))
    return runs[0][2], _aligned_pairs([(row, key, run) for row, key, _, run in runs])


def _aligned(cells: pd.DataFrame, factors: Sequence[str], effect: Sequence[str]) -> pd.Series[Any]:
    """Return the ranks of the values minus their cells' means plus the effect's own part.

    The values are rounded first, so that those which differ by rounding are ties.
    """

    def means(names: Sequence[str]) -> Any:
        return cells.groupby(list(names))["y"].transform("mean") if names else cells["y"].mean()

    parts = [names for size in range(len(effect) + 1) for names in combinations(effect, size)]
    own = sum((-1) ** (len(effect) - len(names)) * means(names) for names in parts)
    aligned = cells["y"] - means(factors) + own
    size = float(cells["y"].abs().max()) or 1.0
    ranks: pd.Series[Any] = (aligned / size).round(ALIGNED_DECIMALS).rank()
    return ranks


def _aligned_pairs(
    runs: Sequence[tuple[Mapping[str, Any], frozenset[str], Callable[[], packages.Numbers]]],
) -> Iterator[Pair]:
    for row, key, run in runs:
        numbers = by_effect(run())
        for name in ("F", "p_unc", "p_GG_corr", "eps", "np2", "ng2"):
            if (key, name) in numbers and not (name in ("p_GG_corr", "eps") and row["d"] in (None, 0, 1)):
                floor = 0.0 if name.startswith("p_") else NEAR_ZERO
                yield Pair(f"{name} of {row['Source']}", row[name], numbers[key, name], floor)
