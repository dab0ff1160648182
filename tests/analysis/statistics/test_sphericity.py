"""Mauchly's test where it is defined, and the reason where it is not; R's numbers are in test_mixed_references."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from palpate.analysis.statistics.mixed_anova import mauchly_tests
from palpate.analysis.statistics.references import reference_table
from tests.analysis.statistics.anova_for_tests import long_table, same
from tests.analysis.statistics.variance_for_tests import UNEQUAL, design

DESIGN: dict[str, Any] = {"within": "A", "subject": "subject"}


def test_the_two_second_order_terms() -> None:
    """R writes all conditions (15 here) where Anderson has the contrasts (4); with one factor: conditions, 5 for 4."""
    table = reference_table("csv/obk_long.csv")
    result = mauchly_tests(table, "y", within=["phase", "hour"], subject="subject").set_index("Source")
    assert result["d"].tolist() == [2, 4, 8]
    hour = result.loc["hour"]
    assert hour["p"] != hour["p_anderson"]
    assert hour["p"] == pytest.approx(hour["p_anderson"], rel=0.05)
    assert result.loc["phase", "p"] == result.loc["phase", "p_anderson"]  # the term vanishes for two contrasts


def test_one_row_for_each_effect_with_something_to_test() -> None:
    table = design(UNEQUAL)
    result = mauchly_tests(table, "y", within=["A", "B"], between=["g", "h"], subject="subject")
    assert result["Source"].tolist() == ["A", "A:B"]
    assert mauchly_tests(table, "y", within="B", subject="subject", aggregate="mean").empty


def test_fewer_participants_than_contrasts_have_no_test() -> None:
    result = mauchly_tests(long_table(np.random.default_rng(1).normal(size=(5, 7))), "y", **DESIGN).iloc[0]
    assert math.isnan(result["W"])
    assert math.isnan(result["p"])
    assert "there is no test of sphericity" in result["note"]


@pytest.mark.parametrize("values", [np.full((9, 4), 0.3), np.arange(9.0)[:, None] + np.zeros(4)])
def test_no_residual_has_no_test(values: np.ndarray) -> None:
    result = mauchly_tests(long_table(values), "y", **DESIGN).iloc[0]
    assert "has no variation" in result["note"]
    assert math.isnan(result["W"])


def test_a_doubled_condition_has_no_test() -> None:
    cells = np.round(np.random.default_rng(2).normal(50, 5, (12, 4)))
    cells[:, 3] = cells[:, 2]
    assert "singular" in mauchly_tests(long_table(cells), "y", **DESIGN)["note"][0]


def test_offset_and_order_change_nothing() -> None:
    cells = np.round(np.random.default_rng(3).normal(50, 5, (15, 4)))
    plain = long_table(cells)
    moved = long_table(cells + 1e9 * np.arange(1, 16)[:, None]).sample(frac=1, random_state=1)
    assert same(mauchly_tests(plain, "y", **DESIGN), mauchly_tests(moved, "y", **DESIGN))


def test_p_is_a_probability_also_with_hardly_more_participants_than_contrasts() -> None:
    for n in (12, 13, 20):
        row = mauchly_tests(long_table(np.random.default_rng(n).normal(size=(n, 12))), "y", **DESIGN).iloc[0]
        assert 0 < row["p"] <= 1
        assert 0 < row["W"] < 1
