"""Rank tests against R 4.2.2 (17 digits) and thesis-independent published values."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.analysis.ordinal.aligned import aligned_ranks
from palpate.analysis.ordinal.friedman import friedman
from palpate.analysis.ordinal.nemenyi import nemenyi, range_quantile, range_tail
from palpate.analysis.ordinal.wilcoxon import rank_sums, signed_ranks, wilcoxon_tests
from tests.analysis.ordinal.r_values import r_values, shipped

SETS = {
    "RoundingTimes": ("RoundingTimes", "method"),
    "md_15.1": ("md_15.1", "time"),
    "ergoStool": ("ergoStool", "type"),
    "shrout_fleiss": ("shrout_fleiss_1979", "rater"),
}


@pytest.mark.parametrize("name", SETS)
def test_friedman_is_friedman_test_of_r(name):
    file, factor = SETS[name]
    row = friedman(shipped(file), "y", factor, "subject", aggregate="mean").iloc[0]
    expected = r_values("friedman")[name]
    assert row["chi2"] == pytest.approx(expected["chi2"], rel=1e-14)
    assert row["p_unc"] == pytest.approx(expected["p"], rel=1e-13)
    assert row["ddof1"] == expected["df"]


def test_rounding_times_are_those_of_hollander_and_wolfe():
    row = friedman(shipped("RoundingTimes"), "y", "method", "subject").iloc[0]
    assert row["chi2"] == 78 / 7  # 11.142857...; Hollander & Wolfe 1973: 11.143
    assert round(row["p_unc"], 6) == 0.003805
    assert row["W"] == 39 / 154
    assert row["F"] == pytest.approx(21 * 78 / 7 / (44 - 78 / 7), rel=1e-15)  # Iman & Davenport 1980, equation 3.2


@pytest.mark.parametrize("name", SETS)
def test_nemenyi_is_its_formula_with_the_ptukey_of_r(name):
    file, factor = SETS[name]
    result = nemenyi(shipped(file), "y", factor, "subject", aggregate="mean").set_index(["A", "B"])
    for pair in r_values("nemenyi")[name]:
        row = result.loc[(pair["A"], pair["B"])]
        assert row["diff"] == pytest.approx(pair["diff"], abs=1e-14)
        assert row["q"] == pytest.approx(pair["q"], rel=1e-13, abs=1e-14)
        assert row["p"] == pytest.approx(pair["p"], rel=2e-9)  # ptukey's own error; mpmath decides below


def test_the_range_of_normal_values_against_r_and_to_the_last_digits():
    for row in r_values("range"):
        assert range_tail(row["q"], row["k"]) == pytest.approx(row["tail"], rel=5e-9)  # R: 1.6e-9 off at (4, 10)
    for row in r_values("range_quantile"):
        assert range_quantile(0.05, row["k"]) == pytest.approx(row["q"], rel=1e-6)  # qtukey stops at 1e-4 or better
    # 40-digit quadrature with mpmath 1.4.1
    exact = {(3.5, 4): 0.06387633385690318526, (4, 10): 0.1268521321505963745, (5, 5): 0.003730273805194439749}
    exact |= {(12, 10): 9.683825946252485722e-16}
    for (q, k), tail in exact.items():
        assert range_tail(q, k) == pytest.approx(tail, rel=5e-15)
    assert range_tail(0, 3) == 1.0
    assert 0 < range_tail(1e3, 3) < 1e-300


@pytest.mark.parametrize("name", ["depression", "long", "likert"])
def test_signed_ranks_are_wilcox_test_of_r(name):
    values = r_values("signed")[name]
    a, b = (np.array(values[key], dtype=float) for key in "xy")
    result = signed_ranks(a, b)
    assert result.statistic == values["normal"]["statistic"]
    assert result.p_normal == pytest.approx(values["normal"]["p"], rel=1e-13)
    if "exact" in values:
        assert result.p_exact == pytest.approx(values["exact"]["p"], rel=1e-13)
        assert result.shift.estimate == pytest.approx(values["exact"]["estimate"], rel=1e-12)
        assert [result.shift.low, result.shift.high] == pytest.approx(values["exact"]["ci"], rel=1e-12)
    else:  # enumerated in R: all patterns of signs of the ranks found
        assert (result.p_exact, signed_ranks(a, b, "pratt").p_exact) == (values["wilcoxon"]["p"], values["pratt"]["p"])
        assert signed_ranks(a, b, "pratt").statistic == values["pratt"]["W"]


def test_pairs_of_decimals_have_the_ties_that_were_written():
    result = wilcoxon_tests(shipped("RoundingTimes"), "y", within="method", subject="subject").set_index(["A", "B"])
    for pair in r_values("signed")["rounding"]:  # R was given hundredths as whole numbers
        row = result.loc[(pair["A"], pair["B"])]
        assert row["W"] == pair["statistic"]
        assert row["p_normal"] == pytest.approx(pair["p"], rel=1e-13)


@pytest.mark.parametrize("name", ["untied", "tied"])
def test_rank_sums_are_wilcox_test_of_r(name):
    values = r_values("sums")[name]
    a, b = (np.array(values[key], dtype=float) for key in "ab")
    result, turned = rank_sums(a, b), rank_sums(b, a)
    assert result.statistic == values["normal"]["statistic"]
    assert result.p_normal == pytest.approx(values["normal"]["p"], rel=1e-13)
    exact = values["exact"]["p"] if name == "untied" else values["enumerated"]["p"]
    assert result.p_exact == pytest.approx(exact, rel=1e-13)
    assert (turned.size, turned.z, turned.p_exact) == (-result.size, -result.z, result.p_exact)
    if name == "untied":
        assert result.shift.estimate == pytest.approx(values["exact"]["estimate"], rel=1e-12)
        assert [result.shift.low, result.shift.high] == pytest.approx(values["exact"]["ci"], rel=1e-12)


ALIGNED = {
    "md_15.1": ("md_15.1", ["time"], None),
    "obk_within": ("obk_long", ["phase", "hour"], None),
    "sk_within": ("sk2011.1", ["inference", "plausibility"], None),
    "sk_mixed": ("sk2011.1", ["inference", "plausibility"], ["instruction"]),
    "obk_mixed": ("obk_long", ["phase", "hour"], ["treatment", "gender"]),
}


@pytest.mark.parametrize("name", ALIGNED)
def test_aligned_ranks_are_those_written_out_in_r(name):
    file, within, between = ALIGNED[name]
    result = aligned_ranks(shipped(file), "y", within=within, between=between, subject="subject", aggregate="mean")
    expected = r_values("aligned")[name]
    assert set(result["Source"]) == set(expected)
    for _, row in result.iterrows():
        values = expected[row["Source"]]
        assert (row["ddof1"], row["ddof2"]) == (values["df1"], values["df2"])
        assert row["F"] == pytest.approx(values["F"], rel=1e-12)
        assert row["p_unc"] == pytest.approx(values["p"], rel=1e-12)
        assert row["aligned_sum"] < 1e-14
        assert row["other_F"] < 1e-9 or "unequal" in row["note"]
    assert (result["other_F"] < 1e-9).all() == (name != "obk_mixed")  # the one set with groups of unequal size
