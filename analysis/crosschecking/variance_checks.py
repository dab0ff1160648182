"""Analyses of variance, pairs of levels and their equivalence held against another package."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pandas as pd

from palpate.analysis.crosschecking import conditions, packages
from palpate.analysis.crosschecking.comparing import (
    MOST_VALUES_SQUARED,
    NEAR_ZERO,
    PINGOUIN,
    STATSMODELS,
    Checked,
    NotChecked,
    Pair,
    cells_of,
    demand_size,
    refuse,
    wide_table,
)
from palpate.analysis.plans.answers import Answer
from palpate.analysis.regenerating.running import Answered

ETAS = {"ng2": "generalized_eta_squared", "np2": "partial_eta_squared"}


def check_anova(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    """Check an analysis of variance of complete data."""
    asked: Any = each.asked
    cells, named, own, groups = crossed(asked, rows)
    package, run = anova_of(cells, own, groups, asked.sum_of_squares)
    return package, _anova_pairs(answer, named, run)


def crossed(asked: Any, rows: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, str], list[str], list[str]]:
    """The means of a design's cells, the plain names of its factors, and those within and between participants."""
    within, between = list(asked.within), list(asked.between)
    cells = cells_of(rows, ["participant", *within, *between])
    named = dict(zip((*within, *between), cells.columns[1:], strict=False))
    return cells, named, [named[name] for name in within], [named[name] for name in between]


def anova_of(
    cells: pd.DataFrame, own: list[str], groups: list[str], sum_of_squares: str
) -> tuple[str, Callable[[], packages.Numbers]]:
    """The package that has this analysis of variance of complete `cells` (f0: participants), and how to run it there.

    Raises NotChecked where neither has it, or is known to be wrong on these data.
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


def by_effect(found: packages.Numbers) -> dict[tuple[frozenset[str], str], float]:
    """The numbers by an effect's factors, in whatever order they are named, and the column."""
    return {(frozenset(source.split(":")), column): value for (source, column), value in found.items()}


def _anova_pairs(answer: Answer, named: Mapping[str, str], run: Callable[[], packages.Numbers]) -> Iterator[Pair]:
    """F, p (as it is corrected in the row), epsilon and eta squared of every effect; `named`: its factors' names."""
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
    """The plain names of an effect's factors, whose own names may hold a colon."""
    names = sorted(named, key=len, reverse=True)
    found = []
    for name in names:
        if name == effect or effect.startswith(f"{name}:") or effect.endswith(f":{name}") or f":{name}:" in effect:
            found.append(named[name])
            effect = f":{effect}:".replace(f":{name}:", ":", 1).strip(":")
    return found


def check_pairs(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    values, paired = _levels(rows, asked.factor)
    return STATSMODELS, _pairs_of(answer, values, paired, asked.correction, asked.family)


def _levels(rows: pd.DataFrame, factor: str) -> tuple[dict[str, Any], bool]:
    """The values of each level, and whether they are paired: then in the order of the participants."""
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
    found = [packages.statsmodels_t(values[str(row["a"])], values[str(row["b"])], paired) for row in answer.rows]
    adjusted = packages.statsmodels_adjusted([theirs["p_unc"] for theirs in found], correction)
    for row, theirs, p in zip(answer.rows, found, adjusted, strict=True):
        pair = f"{row['a']} and {row['b']}"
        yield Pair(f"t of {pair}", row["t"], theirs["T"], NEAR_ZERO)
        yield Pair(f"df of {pair}", row["df"], theirs["dof"])
        yield Pair(f"p_uncorrected of {pair}", row["p_uncorrected"], theirs["p_unc"])
        if family is None:  # statsmodels' family is always the pairs that it is given
            yield Pair(f"p of {pair}", row["p"], p)


def check_equivalence(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    values, paired = _levels(rows, asked.factor)
    return STATSMODELS, _equivalence_pairs(answer, values, paired)


def _equivalence_pairs(answer: Answer, values: Mapping[str, Any], paired: bool) -> Iterator[Pair]:
    for row in answer.rows:
        a, b = str(row["a"]), str(row["b"])
        low, high = (float(row[name] or 0.0) for name in ("bound_low", "bound_high"))
        found = packages.statsmodels_equivalence(values[a], values[b], low, high, paired)
        for name, value in zip(("p_low", "p_high"), found, strict=True):
            yield Pair(f"{name} of {a} and {b}", row[name], value)
