"""On ordinary data the statistics agree with pingouin and statsmodels, also in columns that no plan's answer shows."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import anova, pairwise_tests, rm_anova
from palpate.analysis.crosschecking import packages
from tests.analysis.statistics.anova_for_tests import long_table

SHAPES = [(12, 4), (9, 2), (20, 7), (10, 2, 3), (8, 3, 4)]


def ordinary(shape: tuple[int, ...]) -> pd.DataFrame:
    rng = np.random.default_rng(sum(shape))
    cells = rng.normal(50, 8, (shape[0],) + (1,) * (len(shape) - 1)) + rng.normal(0, 5, shape)
    return long_table(cells + np.linspace(0, 5, shape[1]).reshape(-1, *(1,) * (len(shape) - 2)))


def same(ours: pd.DataFrame, theirs: packages.Numbers) -> int:
    """How many numbers were compared."""
    rows = ours.set_index("Source")
    for (source, column), value in theirs.items():
        assert rows.loc[source, column] == pytest.approx(value, rel=1e-9), (source, column)
    return len(theirs)


@pytest.mark.parametrize("shape", SHAPES)
def test_repeated_measures(shape: tuple[int, ...]) -> None:
    within = ["A", "B"][: len(shape) - 1]
    table = ordinary(shape)
    ours = rm_anova(table, dv="y", within=within, subject="subject")
    theirs = packages.read_pingouin_anova(packages.pingouin_within(table, "y", within, "subject"))
    # pingouin corrects nothing where two levels leave nothing to correct
    assert same(ours, theirs) == len(ours) * (4 if shape[1:] == (2,) else 5)
    theirs = packages.read_statsmodels_within(packages.statsmodels_within(table, "y", within, "subject"))
    assert same(ours, theirs) == 2 * len(ours)


@pytest.mark.parametrize("sizes", [(10, 10, 10), (5, 12, 30)])
def test_between_groups(sizes: tuple[int, ...]) -> None:
    rng = np.random.default_rng(sum(sizes))
    table = pd.DataFrame({"g": np.repeat(["a", "b", "c"], sizes), "y": rng.normal(50, 5, sum(sizes))})
    table["y"] += 4.0 * (table["g"] == "b")
    theirs = packages.read_pingouin_anova(packages.pingouin_between(table, "y", ["g"]))
    assert same(anova(table, dv="y", between="g"), theirs) == 3
    values = {level: own["y"].to_numpy() for level, own in table.groupby("g")}
    ours = pairwise_tests(table, dv="y", between="g", padjust="holm")
    compare_pairs(ours, values, False, "holm")


@pytest.mark.parametrize("padjust", ["none", "bonferroni", "holm"])
def test_pairs_within_participants(padjust: str) -> None:
    table = ordinary((12, 5))
    values = {level: own.sort_values("subject")["y"].to_numpy() for level, own in table.groupby("A")}
    ours = pairwise_tests(table, "y", within="A", subject="subject", padjust=padjust.replace("eroni", ""))
    compare_pairs(ours, values, True, padjust)


def compare_pairs(ours: pd.DataFrame, values: dict[str, np.ndarray], paired: bool, correction: str) -> None:
    theirs = [packages.statsmodels_t(values[a], values[b], paired) for a, b in zip(ours["A"], ours["B"], strict=True)]
    for column in ("T", "dof", "p_unc"):
        np.testing.assert_allclose(ours[column], [pair[column] for pair in theirs], rtol=1e-9)
    if correction != "none":
        adjusted = packages.statsmodels_adjusted([pair["p_unc"] for pair in theirs], correction)
        np.testing.assert_allclose(ours["p_corr"], adjusted, rtol=1e-9)
