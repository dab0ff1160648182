"""On ordinary data the statistics agree with pingouin and statsmodels."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
import pytest

from analysis import anova, pairwise_tests, rm_anova
from tests.analysis.anova_for_tests import long_table

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import pingouin
    from statsmodels.stats.anova import AnovaRM

pytestmark = pytest.mark.filterwarnings("ignore")
SHAPES = [(12, 4), (9, 2), (20, 7), (10, 2, 3), (8, 3, 4)]


def ordinary(shape: tuple[int, ...]) -> pd.DataFrame:
    rng = np.random.default_rng(sum(shape))
    cells = rng.normal(50, 8, (shape[0],) + (1,) * (len(shape) - 1)) + rng.normal(0, 5, shape)
    return long_table(cells + np.linspace(0, 5, shape[1]).reshape(-1, *(1,) * (len(shape) - 2)))


@pytest.mark.parametrize("shape", SHAPES)
def test_repeated_measures_against_pingouin(shape: tuple[int, ...]) -> None:
    within = ["A", "B"][: len(shape) - 1]
    table = ordinary(shape)
    asked = within if len(within) > 1 else "A"
    theirs = pingouin.rm_anova(table, dv="y", within=asked, subject="subject", detailed=True, correction=True)
    theirs = theirs[theirs["Source"] != "Error"]
    ours = rm_anova(table, dv="y", within=within, subject="subject")
    assert [name.replace(" * ", ":") for name in theirs["Source"]] == ours["Source"].tolist()
    columns = [name for name in ("SS", "F", "p_unc", "p_GG_corr", "eps", "ng2") if name in theirs]
    assert len(columns) == 6 or shape[1:] == (2,)  # pingouin corrects nothing where two levels leave nothing to correct
    for column in columns:
        found = theirs[column].to_numpy(dtype=float)
        np.testing.assert_allclose(ours[column], found, rtol=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_repeated_measures_against_statsmodels(shape: tuple[int, ...]) -> None:
    within = ["A", "B"][: len(shape) - 1]
    table = ordinary(shape)
    theirs = AnovaRM(table, "y", "subject", within=within).fit().anova_table
    ours = rm_anova(table, dv="y", within=within, subject="subject")
    assert theirs.index.tolist() == ours["Source"].tolist()
    np.testing.assert_allclose(ours["F"], theirs["F Value"], rtol=1e-9)
    np.testing.assert_allclose(ours["p_unc"], theirs["Pr > F"], rtol=1e-9)


@pytest.mark.parametrize("sizes", [(10, 10, 10), (5, 12, 30)])
def test_between_groups_against_pingouin(sizes: tuple[int, ...]) -> None:
    rng = np.random.default_rng(sum(sizes))
    table = pd.DataFrame({"g": np.repeat(["a", "b", "c"], sizes), "y": rng.normal(50, 5, sum(sizes))})
    table["y"] += 4.0 * (table["g"] == "b")
    theirs = pingouin.anova(table, dv="y", between="g", detailed=True)
    ours = anova(table, dv="y", between="g")
    for column in ("SS", "MS", "F", "p_unc", "np2"):
        np.testing.assert_allclose(ours[column][0], theirs[column][0], rtol=1e-9)
    ours, theirs = (
        call(data=table, dv="y", between="g", padjust="holm") for call in (pairwise_tests, pingouin.pairwise_tests)
    )
    for column in ("T", "dof", "p_unc", "p_corr", "hedges"):
        np.testing.assert_allclose(ours[column], theirs[column], rtol=1e-9)


@pytest.mark.parametrize("padjust", ["none", "bonf", "holm"])
def test_paired_tests_against_pingouin(padjust: str) -> None:
    table = ordinary((12, 5))
    asked = {"data": table, "dv": "y", "within": "A", "subject": "subject", "padjust": padjust}
    ours, theirs = pairwise_tests(**asked), pingouin.pairwise_tests(**asked)
    assert ours[["Contrast", "A", "B"]].to_numpy().tolist() == theirs[["Contrast", "A", "B"]].to_numpy().tolist()
    for column in ("T", "dof", "p_unc", *(["p_corr"] if padjust != "none" else [])):
        np.testing.assert_allclose(ours[column], theirs[column], rtol=1e-9)
