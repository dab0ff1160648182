"""Intervals of eta squared, dz and g against R 4.2.2's pf and pt with uniroot, and what must hold of any interval."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis import anova, pairwise_tests, rm_anova
from palpate.analysis.statistics.f_and_t import (
    dz_interval,
    eta_squared_interval,
    eta_squared_intervals,
    f_chance,
    f_noncentrality,
    hedges_interval,
    t_chance,
    t_noncentrality,
)
from palpate.analysis.statistics.mixed_anova import mixed_anova
from palpate.analysis.statistics.references import reference_table
from palpate.analysis.statistics.refusals import BadOption, UnknownColumn
from tests.analysis.statistics.anova_for_tests import long_table
from tests.analysis.statistics.variance_for_tests import UNEQUAL, R, design
from tests.examples import examples

PF = 1e-6  # R's pf with ncp stops at an error of 1e-9 in the probability


@pytest.mark.parametrize("case", R["eta"], ids=lambda case: f"F={case['F']}")
def test_eta_squared_against_r(case: dict) -> None:
    f, df1, df2, level = (case[key] for key in ("F", "df1", "df2", "confidence"))
    np.testing.assert_allclose(f_noncentrality(f, df1, df2, level), case["nc"], rtol=PF, atol=PF)
    result = eta_squared_interval(f, df1, df2, confidence=level)
    np.testing.assert_allclose(result, case["effectsize"], rtol=PF, atol=PF)
    mbess = eta_squared_interval(f, df1, df2, confidence=level, added=df1 + 1)
    np.testing.assert_allclose(mbess, case["mbess"], rtol=PF, atol=PF)


def test_dz_and_g_against_r() -> None:
    for case in R["dz"]:
        result = dz_interval(case["dz"], case["n"], confidence=case["confidence"])
        np.testing.assert_allclose(result, case["limits"], rtol=1e-8)
    for case in R["g"]:
        result = hedges_interval(case["g"], case["n1"], case["n2"], confidence=case["confidence"])
        np.testing.assert_allclose(result, case["limits"], rtol=1e-8)


@settings(max_examples=examples(40), deadline=None)
@given(st.floats(0, 1e4), st.floats(1, 90), st.floats(1, 5e4), st.sampled_from([0.5, 0.9, 0.99]))
def test_the_limits_are_where_the_distribution_says(f: float, df1: float, df2: float, level: float) -> None:
    low, high = f_noncentrality(f, df1, df2, level)
    assert 0 <= low <= high
    if low > 0:
        assert f_chance(f, df1, df2, low) == pytest.approx((1 + level) / 2, abs=1e-9)
    if high > 0:
        assert f_chance(f, df1, df2, high) == pytest.approx((1 - level) / 2, abs=1e-9)


@pytest.mark.parametrize("t", [0.0, -3.0, 1e3, -1e6, 1e12])
@pytest.mark.parametrize("df", [1, 11, 4999])
def test_t_at_any_size(t: float, df: int) -> None:
    low, high = t_noncentrality(t, df, 0.95)
    assert low < t < high
    assert t_chance(t, df, low) == pytest.approx(0.975, abs=1e-9)
    assert t_chance(t, df, high) == pytest.approx(0.025, abs=1e-9)
    mirrored = t_noncentrality(-t, df, 0.95)
    np.testing.assert_allclose(mirrored, (-high, -low), rtol=1e-9, atol=1e-9)


def test_t_against_r() -> None:
    # R 4.2.2: pt(1.3, 1, 2), pt(-3, 2, -4.5), pt(7, 11, 9), pt(20, 400, 19)
    result = [t_chance(1.3, 1, 2), t_chance(-3, 2, -4.5), t_chance(7, 11, 9), t_chance(20, 400, 19)]
    expected = [0.21776225440245228, 0.85647474002390045, 0.11503322703572329, 0.78987170267891094]
    np.testing.assert_allclose(result, expected, rtol=1e-11)


def test_a_90_percent_interval_leaves_out_zero_where_p_is_below_5_percent() -> None:
    for f, p_below in ((2.893, True), (2.890, False)):  # the 5 % point of F(3, 33) is 2.8916
        low, _ = eta_squared_interval(f, 3, 33)
        assert (low > 0) is p_below


def test_every_kind_of_table() -> None:
    table = design(UNEQUAL)
    result = mixed_anova(table, "y", within=["A", "B"], between=["g", "h"], subject="subject")
    for correction in ("none", "GG"):
        limits = eta_squared_intervals(result, correction=correction)
        assert limits["Source"].tolist() == result["Source"].tolist()
        for name in ("np2", "ng2"):
            assert ((limits[f"{name}_low"] <= limits[name]) & (limits[name] <= limits[f"{name}_high"])).sum() >= 10
            assert limits[[f"{name}_low", f"{name}_high"]].stack().between(0, 1).all()
    row = eta_squared_intervals(anova(table, "y", "g", subject="subject", aggregate="mean")).iloc[0]
    assert (row["eta2_low"], row["eta2_high"]) == (row["np2_low"], row["np2_high"])


def test_generalized_limits_keep_the_ratio_of_errors() -> None:
    row = rm_anova(reference_table("csv/md_15.1.csv"), "y", "time", "subject")
    result = eta_squared_intervals(row).iloc[0]
    odds = {name: value / (1 - value) for name, value in result.items() if name not in ("Source", "note")}
    for end in ("_low", "_high"):
        assert odds[f"np2{end}"] / odds[f"ng2{end}"] == pytest.approx(odds["np2"] / odds["ng2"], rel=1e-12)
    assert result["ng2_low"] < result["ng2"] < result["ng2_high"]


def test_undefined_and_extreme() -> None:
    same = eta_squared_intervals(rm_anova(long_table(np.full((5, 3), 0.3)), "y", "A", "subject")).iloc[0]
    assert math.isnan(same["np2_low"])
    assert same["note"].startswith("F is undefined")
    assert eta_squared_interval(0.0, 3, 33) == (0.0, 0.0)
    sharp = rm_anova(long_table(np.arange(3) * 1e9 + np.eye(3)), "y", "A", "subject")
    assert "no interval" in eta_squared_intervals(sharp)["note"][0]
    with pytest.raises(BadOption, match=r"confidence=95 is unknown"):
        eta_squared_interval(3.0, 3, 33, confidence=95)
    with pytest.raises(BadOption, match="correction='gg' is unknown"):
        eta_squared_intervals(sharp, correction="gg")  # type: ignore[arg-type]
    with pytest.raises(UnknownColumn, match="pass a result of"):
        eta_squared_intervals(pd.DataFrame({"F": [1.0]}))


def test_pairs_have_the_interval_of_their_effect_size() -> None:
    table = reference_table("csv/md_15.1.csv")
    result = pairwise_tests(table, "y", within="time", subject="subject", effect_interval=0.95)
    assert list(result.columns)[-4:] == ["dz", "dz_low", "dz_high", "note"]
    assert ((result["p_unc"] < 0.05) == (result["dz_low"] * result["dz_high"] > 0)).all()
    between = pairwise_tests(table, "y", between="time", effect_interval=0.9)
    assert list(between.columns)[-3:] == ["hedges_low", "hedges_high", "note"]
    flat = pairwise_tests(long_table(np.full((4, 2), 7.0)), "y", within="A", subject="subject", effect_interval=0.95)
    assert flat[["dz", "dz_low", "dz_high"]].isna().all(axis=None)


def test_an_estimate_above_its_own_interval_is_reported() -> None:
    """F(28, 532) = 0.5988 with epsilon 0.4262: eta squared .0306, R's noncentral F: 0 to .0184."""
    row = {"Source": "a", "F": 0.598818760187415, "ddof1": 28, "ddof2": 532, "np2": 0.030553818957897685}
    row |= {"ng2": 0.015021162425791079, "eps": 0.42620488412587, "note": ""}
    result = eta_squared_intervals(pd.DataFrame([row]), correction="GG").iloc[0]
    assert result["np2_low"] == 0 < result["np2_high"] == pytest.approx(0.0184382606670012, rel=1e-6)
    assert result["note"].startswith("eta squared lies above its own interval")
    ordinary = eta_squared_intervals(pd.DataFrame([row | {"F": 2.0, "np2": 56 / 588}]), correction="GG").iloc[0]
    assert ordinary["note"] == ""
