"""Where another package is known to be wrong is decided from the data: each condition, and the package still wrong.

A package that mends its error makes the second half of a test fail: then its condition is to be taken out.
"""

import math

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.crosschecking import conditions, packages
from palpate.analysis.crosschecking.checks import cross_check
from tests.analysis.crosschecking.answers_for_tests import answered, long, rated

RNG = np.random.Generator(np.random.PCG64(7))
CELLS = np.round(RNG.normal(50, 5, (8, 1)) + RNG.normal(0, 3, (8, 4)), 1)


def reason(result):
    (check,) = cross_check([result])
    assert check.difference is None
    return check.reason


def pingouin_f(table):
    cells = table.rename(columns={"value": "y"})
    return packages.read_pingouin_anova(packages.pingouin_within(cells, "y", ["a"], "participant")).get(("a", "F"), 0.0)


@pytest.mark.parametrize(
    "cells",
    [np.full((12, 4), 0.3), np.arange(12)[:, None] * 0.1 + np.arange(4) * 0.3, CELLS + 1e9 * np.arange(8)[:, None]],
    ids=["constant", "additive", "participants 1e9 apart"],
)
def test_a_residual_that_drowns(cells):
    result = answered(long(cells), "anova", within=("a",))
    assert "sums of squares are rounding there" in reason(result)
    right = result.answer.rows[0]["F"]
    assert right is None or not math.isclose(pingouin_f(long(cells)), right, rel_tol=1e-6)


def test_one_effect_of_two_may_drown_alone():
    cells = RNG.normal(0, 3, (8, 3, 1)) + np.zeros((8, 3, 4)) + np.arange(4) * 0.1
    assert "sums of squares are rounding there" in conditions.drowned(cells)
    assert conditions.drowned(cells + RNG.normal(0, 1, cells.shape)) == ""


def test_squares_beyond_the_range_of_doubles():
    table = rated().assign(value=lambda t: t["value"] * 1e160)
    result = answered(table, "anova", within=("a",))
    assert reason(result) == "squares of the values leave the range of doubles"
    assert not math.isclose(pingouin_f(table), result.answer.rows[0]["F"], rel_tol=1e-6)


def test_differences_that_differ_by_rounding():
    """0.3 - 0.2 and 0.2 - 0.1 are one difference, which SciPy ranks as two."""
    cells = np.array([[0.3, 0.2], [0.2, 0.1], [0.1, 0.2], [0.7, 0.2], [0.2, 0.9], [0.1, 0.9]])
    result = answered(long(cells), "wilcoxon", factor="a")
    assert "a0 and a1 that differ only by rounding are ties" in reason(result)
    theirs = packages.pingouin_signed_ranks(cells[:, 0], cells[:, 1], "wilcoxon")
    assert theirs["W"] != result.answer.rows[0]["W"]


def test_means_of_large_values_make_other_ties():
    cells = np.array([[1, 2, 4], [2, 2, 3], [3, 5, 4], [1, 1, 2], [4, 2, 2.0]]) / 10 + 1e6
    assert "times as large as they differ" in reason(answered(long(cells), "aligned_ranks", within=("a",)))


def test_a_gap():
    table = long(CELLS).drop(index=[1, 2])
    assert "a cell is missing" in conditions.incomplete(table.pivot(index="participant", columns="a", values="value"))
    assert pingouin_f(table) == pytest.approx(pingouin_f(long(CELLS[1:])))  # one participant fewer without a word


def test_more_conditions_than_participants_need_no_condition():
    """Its automatic p calls such a matrix spherical (FACTS of statistics.md); we ask for the corrected p always."""
    result = answered(rated((6, 20)), "anova", within=("a",))
    (check,) = cross_check([result])
    assert check.difference < 1e-6


def test_unequal_groups_of_type_three():
    table = rated((11, 4), groups=3)
    result = answered(table, "anova", within=("a",), between=("group",))
    assert "type II" in reason(result)
    theirs = packages.read_pingouin_anova(packages.pingouin_mixed(table, "value", "a", "group", "participant"))
    assert not math.isclose(theirs["a", "F"], next(r["F"] for r in result.answer.rows if r["effect"] == "a"))


def test_a_pair_that_does_not_differ_in_its_differences():
    cells = CELLS.copy()
    cells[:, 1] = cells[:, 0] + 1
    result = answered(long(cells), "pairs", factor="a")
    assert "does not vary" in reason(result)
    assert abs(packages.statsmodels_t(cells[:, 1], cells[:, 0], True)["T"]) > 1e12
    assert result.answer.rows[0]["t"] is None


def test_groups_that_hardly_vary():
    table = rated((12, 1), groups=2).assign(value=lambda t: 1e9 + (t["group"] == "g1") + 1e-5 * t["trial"])
    assert "hardly vary" in reason(answered(table, "pairs", factor="group"))


def test_ties_that_rounding_hides():
    cells = np.array([[0.3, 0.3, 0.5], [0.1 + 0.2, 0.3, 0.2], [0.1 + 0.2, 0.3, 0.7], [0.4, 0.1, 0.6]])
    result = answered(long(cells), "friedman", factor="a")
    assert "differ only by rounding" in reason(result)
    theirs = packages.read_pingouin_friedman(packages.pingouin_friedman(long(cells), "value", "a", "participant"))
    assert theirs["chi2"] != pytest.approx(result.answer.rows[0]["chi2"])


def test_nothing_to_rank():
    result = answered(long(np.full((5, 3), 2.0)), "friedman", factor="a")
    assert "there are no ranks" in reason(result)


def test_an_estimated_variance_that_is_not_positive():
    table = long(np.array([[1, 2, 1.4], [2, 1, 1.7]]))  # participants rate three stimuli
    result = answered(table, "icc", targets="stimulus", raters="participant")
    assert "not above 0" in reason(result)
    theirs = packages.read_pingouin_icc(packages.pingouin_icc(table, "value", "stimulus", "participant"))
    assert theirs["ICC2k", "ICC"] > 1


def test_participants_a_million_residuals_apart():
    table = rated(apart=1e7)
    result = answered(table, "mixed_model", fixed=("a",))
    assert "says converged and is not" in reason(result)
    frame = pd.get_dummies(table["a"], dtype=float).assign(a0=1.0, y=table["value"], g0=table["participant"])
    fitted = packages.statsmodels_mixed_model(frame, ["a0", "a1", "a2", "a3"], ["g0"])
    right = result.answer.more["variances"][-1]["variance"]
    assert not math.isclose(fitted.scale, right, rel_tol=1e-6)


def test_a_variance_of_zero():
    table = rated((12, 4), apart=0.0)
    cells = table["value"] - table.groupby("participant")["value"].transform("mean")
    assert "estimated as zero" in reason(answered(table.assign(value=cells), "mixed_model", fixed=("a",)))
