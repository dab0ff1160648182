"""Families fixed beforehand and equivalence tests against R 4.2.2 (p.adjust, one-sided t.test)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import pairwise_tests
from palpate.analysis.statistics.equivalence import equivalence_tests
from palpate.analysis.statistics.f_and_t import adjusted
from palpate.analysis.statistics.references import reference_table
from palpate.analysis.statistics.refusals import BadOption
from tests.analysis.statistics.anova_for_tests import long_table, relative_error
from tests.analysis.statistics.variance_for_tests import R

KEYS = {"T_low": "T_low", "T_high": "T_high", "dof": "dof", "p_low": "p_low", "p_high": "p_high"}
BOUNDS = {"low": "bound_low", "high": "bound_high"}
MD = reference_table("csv/md_15.1.csv")


def test_families_against_r() -> None:
    given = R["families"]
    for method in ("bonf", "holm"):
        np.testing.assert_allclose(adjusted(given["p"], method, given["family"]), given[method], rtol=1e-14)


def test_a_family_larger_than_its_pairs() -> None:
    design: dict[str, Any] = {"within": "time", "subject": "subject"}
    plain = pairwise_tests(MD, "y", **design)["p_unc"]
    result = pairwise_tests(MD, "y", padjust="bonf", family=20, **design)
    np.testing.assert_allclose(result["p_corr"], np.minimum(1, 20 * plain), rtol=1e-15)
    assert result.attrs["family"] == 20
    same = pairwise_tests(MD, "y", padjust="holm", family=6, **design)
    assert same["p_corr"].tolist() == pairwise_tests(MD, "y", padjust="holm", **design)["p_corr"].tolist()


@pytest.mark.parametrize(
    ("family", "message"),
    [(5, "family=5 is smaller than the 6 pairs"), (6.0, "family=6.0 is unknown"), (True, "family")],
)
def test_a_family_that_is_none(family: Any, message: str) -> None:
    with pytest.raises(BadOption, match=message):
        pairwise_tests(MD, "y", within="time", subject="subject", padjust="holm", family=family)


def check(row: pd.Series, expected: dict[str, Any]) -> None:
    for key, column in (KEYS | BOUNDS).items():
        assert relative_error(row[column], expected[key]) < 1e-12, key
    np.testing.assert_allclose([row["ci_low"], row["ci_high"]], expected["ci"], rtol=1e-12)
    assert row["p"] == max(row["p_low"], row["p_high"])
    inside = expected["low"] < expected["ci"][0] and expected["ci"][1] < expected["high"]
    assert row["equivalent"] is inside
    assert inside == (row["p"] < 0.05)


@pytest.mark.parametrize(("name", "settings"), [("paired", {"bounds": (-10, 8)}), ("paired_dz", {"bounds_dz": 0.5})])
def test_paired_against_r(name: str, settings: dict[str, Any]) -> None:
    result = equivalence_tests(MD, "y", within="time", subject="subject", **settings).set_index(["A", "B"])
    check(result.loc[("m30", "m36")], R["equivalence"][name])


@pytest.mark.parametrize(
    ("name", "settings"),
    [("equal", {"bounds": (-1, 1.5)}), ("welch", {"bounds": (-1, 1.5)}), ("welch_d", {"bounds_dz": 0.8})],
)
def test_two_groups_against_r(name: str, settings: dict[str, Any]) -> None:
    given = R["equivalence"][name]
    table = pd.DataFrame({"g": ["x"] * len(given["x"]) + ["y"] * len(given["y"]), "y": given["x"] + given["y"]})
    check(equivalence_tests(table, "y", between="g", **settings).iloc[0], given)


def test_a_narrow_difference_is_equivalent_and_a_wide_one_is_not() -> None:
    rng = np.random.Generator(np.random.PCG64(2))
    cells = rng.normal(50, 9, (40, 1)) + rng.normal(0, 1, (40, 3)) + [0, 0.1, 6]
    result = equivalence_tests(long_table(cells), "y", within="A", subject="subject", bounds=(-2, 2))
    assert result["equivalent"].tolist() == [True, False, False]
    moved = equivalence_tests(
        long_table(np.round(cells, 1) * 10 + 1e9), "y", within="A", subject="subject", bounds=(-20, 20)
    )
    plain = equivalence_tests(long_table(np.round(cells, 1) * 10), "y", within="A", subject="subject", bounds=(-20, 20))
    np.testing.assert_allclose(moved["p"], plain["p"], rtol=1e-5)  # the decimals of 1e9 + x are rounded on the way in
    whole = [long_table(np.round(cells * 10) + add) for add in (0.0, 1e9)]
    p = [equivalence_tests(t, "y", within="A", subject="subject", bounds=(-20, 20))["p"] for t in whole]
    np.testing.assert_allclose(p[0], p[1], rtol=1e-13)


def test_undefined_and_refused() -> None:
    flat = equivalence_tests(long_table(np.full((4, 2), 7.0)), "y", within="A", subject="subject", bounds=(-1, 1)).iloc[
        0
    ]
    assert flat["equivalent"] is None
    assert np.isnan(flat["p"])
    assert flat["note"].startswith("t is undefined")
    for settings, message in (
        ({}, "give either `bounds`"),
        ({"bounds": (-1, 1), "bounds_dz": 1.0}, "give either `bounds`"),
        ({"bounds": (1, -1)}, "the lower one must be"),
        ({"bounds": (float("nan"), 1)}, "the lower one must be"),
        ({"bounds_dz": -0.5}, "the lower one must be"),
        ({"bounds_dz": True}, "are not two numbers"),
        ({"bounds": (-1, 1), "alpha": 0.5}, "alpha=0.5 is unknown"),
    ):
        with pytest.raises(BadOption, match=message):
            equivalence_tests(MD, "y", within="time", subject="subject", **settings)
