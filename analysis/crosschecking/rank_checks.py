"""Tests of ranks held against another package."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.crosschecking import conditions, packages
from palpate.analysis.crosschecking.comparing import (
    NEAR_ZERO,
    PINGOUIN,
    SCIPY,
    Checked,
    Pair,
    cells_of,
    demand_size,
    refuse,
    wide_table,
)
from palpate.analysis.crosschecking.variance_checks import anova_of, by_effect, crossed, parts_of
from palpate.analysis.plans.answers import Answer
from palpate.analysis.regenerating.running import Answered

LEAST_TAIL = 1e-9
"""SciPy's tail of the studentized range is one less its distribution: a smaller one has no six digits."""
ALIGNED_DECIMALS = 9


def check_friedman(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    cells = cells_of(rows, ["participant", asked.factor])
    _demand_ranks(cells, "f0", "f1")
    columns = {"chi2": "chi2", "ddof1": "ddof1", "p_unc": "p_unc", "W": "W"}
    return PINGOUIN, _friedman_pairs(answer, cells, "f1", "f0", columns)


def check_kendall_w(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    cells = cells_of(rows, [asked.raters, asked.targets], asked.value)
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
    found = packages.read_pingouin_friedman(packages.pingouin_friedman(cells, "y", within, subject))
    for row in answer.rows:
        for ours, theirs in columns.items():
            if ours in row:
                yield Pair(ours, row[ours], found[theirs], 0.0 if ours.startswith("p") else NEAR_ZERO)


def check_nemenyi(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Mean ranks by pandas, and p by SciPy's studentized range, where that has digits."""
    asked: Any = each.asked
    cells = cells_of(rows, ["participant", asked.factor])
    _demand_ranks(cells, "f0", "f1")
    return SCIPY, _nemenyi_pairs(answer, wide_table(cells, "f0", ["f1"]).rank(axis=1), asked.ties)


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


def check_wilcoxon(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Signed ranks or rank sums of every pair of levels."""
    asked: Any = each.asked
    cells = cells_of(rows, ["participant", asked.factor])
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
    return PINGOUIN, _wilcoxon_pairs(answer, levels, asked, paired)


def _wilcoxon_pairs(answer: Answer, levels: Mapping[str, Any], asked: Any, paired: bool) -> Iterator[Pair]:
    """W, rank-biserial correlation and p of each pair, and p adjusted where the packages have every p."""
    known: list[float | None] = []
    for row in answer.rows:
        a, b = levels[str(row["A"])], levels[str(row["B"])]
        found = packages.pingouin_signed_ranks(a, b, asked.zeros) if paired else packages.pingouin_rank_sums(a, b)
        pair = f"{row['A']} and {row['B']}"
        yield Pair(f"W of {pair}", row["W"], found["W"], NEAR_ZERO)
        if "RBC" in found:
            yield Pair(f"rank-biserial correlation of {pair}", row["rank_biserial"], found["RBC"], NEAR_ZERO)
        for name in ("p_normal", "p_exact"):
            if name in found:
                yield Pair(f"{name} of {pair}", row[name], found[name])
        known.append(found.get("p_normal" if row["p_exact"] is None else "p_exact"))
    whole = [p for p in known if p is not None]
    if asked.family is None and len(whole) == len(known):
        for row, p in zip(answer.rows, packages.statsmodels_adjusted(whole, asked.correction), strict=True):
            yield Pair(f"p of {row['A']} and {row['B']}", row["p_corr"], p)


def check_aligned_ranks(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Each effect aligned by means of pandas, ranked, and its analysis of variance by another package."""
    asked: Any = each.asked
    cells, named, own, groups = crossed(asked, rows)
    values = cells["y"].to_numpy()
    refuse(conditions.out_of_range(values), conditions.far_from_zero(values))
    runs = []
    for row in answer.rows:
        effect = parts_of(str(row["Source"]), named)
        ranks = cells.assign(y=_aligned(cells, [*own, *groups], effect))
        runs.append((row, frozenset(effect), *anova_of(ranks, own, groups, asked.sum_of_squares)))
    return runs[0][2], _aligned_pairs([(row, key, run) for row, key, _, run in runs])


def _aligned(cells: pd.DataFrame, factors: Sequence[str], effect: Sequence[str]) -> pd.Series[Any]:
    """Ranks of what is left of the values without their cells' means, with the effect's own part added again.

    Rounded first, so that values which differ by rounding are ties.
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
        found = by_effect(run())
        for name in ("F", "p_unc", "p_GG_corr", "eps", "np2", "ng2"):
            if (key, name) in found and not (name in ("p_GG_corr", "eps") and row["d"] in (None, 0, 1)):
                floor = 0.0 if name.startswith("p_") else NEAR_ZERO
                yield Pair(f"{name} of {row['Source']}", row[name], found[key, name], floor)
