"""Pairwise t tests against R 4.2.2 (t.test, p.adjust), exact arithmetic, and on families with undefined members."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import apa_t, pairwise_tests
from palpate.analysis.statistics.f_and_t import adjusted
from palpate.analysis.statistics.references import reference_table, reference_values
from palpate.analysis.statistics.refusals import BadOption, DuplicatedCells, IncompleteCells
from tests.analysis.statistics.anova_for_tests import long_table, relative_error

R = reference_values("r_reference")
EXACT = reference_values("exact_reference")
FAMILIES = [(name, factor) for name in R for factor in R[name].get("pairwise", {}).get("families", {})]
KEYS = {"mean_diff": "mean_diff", "t": "T", "df": "dof", "p_unc": "p_unc", "dz": "dz"}
LIMITS = {"ci_low": "ci_low", "ci_high": "ci_high"}


def family(name: str, factor: str, padjust: str) -> pd.DataFrame:
    table = reference_table(f"csv/{R[name]['csv']}")
    result = pairwise_tests(table, "y", within=factor, subject="subject", padjust=padjust, aggregate="mean")
    return result.set_index(["A", "B"])


def test_there_are_families() -> None:
    assert len(FAMILIES) == 12


@pytest.mark.parametrize(("name", "factor"), FAMILIES)
def test_against_r(name: str, factor: str) -> None:
    bonf, holm = (family(name, factor, method) for method in ("bonf", "holm"))
    pairs = R[name]["pairwise"]["families"][factor]
    assert len(pairs) == len(bonf)
    for pair in pairs:
        row = bonf.loc[(pair["A"], pair["B"])]
        for key, column in (KEYS | LIMITS | {"p_bonf": "p_corr"}).items():
            assert relative_error(row[column], pair[key]) < 1e-12, (pair["A"], pair["B"], key)
        assert relative_error(holm.at[(pair["A"], pair["B"]), "p_corr"], pair["p_holm"]) < 1e-12


@pytest.mark.parametrize(("name", "factor"), FAMILIES)
def test_against_exact_arithmetic(name: str, factor: str) -> None:
    result = family(name, factor, "bonferroni")
    for pair in EXACT[name]["pairwise"][factor]:
        row = result.loc[(pair["A"], pair["B"])]
        for key, column in {"mean_diff": "mean_diff", "t": "T", "p_unc": "p_unc", "p_bonf": "p_corr"}.items():
            assert relative_error(row[column], float(pair[key])) < 1e-12


def test_columns() -> None:
    table = reference_table("csv/md_15.1.csv")
    result = pairwise_tests(table, dv="y", within="time", subject="subject", padjust="bonf")
    assert list(result.columns) == [
        *("Contrast", "A", "B", "Paired", "T", "dof", "alternative", "p_unc", "p_corr", "p_adjust"),
        *("mean_diff", "ci_low", "ci_high", "dz", "note"),
    ]
    assert result["p_adjust"].unique().tolist() == ["bonf"]
    between = pairwise_tests(table, dv="y", between="time")
    assert "hedges" in between
    assert "dz" not in between
    assert between["p_corr"].tolist() == between["p_unc"].tolist()


def test_an_undefined_pair_keeps_its_place_in_the_family() -> None:
    cells = np.array([[1.0, 2.0, 4.0], [2.0, 3.0, 1.0], [5.0, 6.0, 3.0], [3.0, 4.0, 9.0]])
    result = pairwise_tests(long_table(cells), "y", within="A", subject="subject", padjust="bonf")
    first = result.iloc[0]
    assert first["note"] == "t is undefined: the differences do not vary"
    assert first["mean_diff"] == -1.0
    assert all(math.isnan(first[column]) for column in ("T", "p_unc", "p_corr", "dz"))
    assert result["p_corr"][1] == pytest.approx(min(1, 3 * result["p_unc"][1]))
    assert "undefined" in apa_t(first)
    equal = pairwise_tests(long_table(cells[:, [0, 0]]), "y", within="A", subject="subject").iloc[0]
    assert equal["note"].endswith("do not vary and their mean is zero")


def test_decimals_that_differ_by_rounding_alone() -> None:
    cells = np.column_stack([np.arange(1, 9) / 10, np.arange(1, 9) / 10 + 0.1])
    row = pairwise_tests(long_table(cells), "y", within="A", subject="subject").iloc[0]
    assert math.isnan(row["T"])
    assert "rounding level" in row["note"]


def test_holm_is_monotone_and_counts_the_undefined() -> None:
    # R: p.adjust(c(.01, .04, .03), "holm") is .03 .06 .06; with a fourth, undefined member: .04 .09 .09
    assert adjusted([0.01, 0.04, 0.03], "holm") == pytest.approx([0.03, 0.06, 0.06])
    four = adjusted([0.01, 0.04, math.nan, 0.03], "holm")
    assert [four[0], four[1], four[3]] == pytest.approx([0.04, 0.09, 0.09])
    assert math.isnan(four[2])


@pytest.mark.parametrize("offset", [1e6, 1e9, 1e12])
def test_offsets_of_participants_change_no_paired_t(offset: float) -> None:
    cells = np.round(np.random.default_rng(1).normal(50, 5, (12, 4)))
    plain = pairwise_tests(long_table(cells), "y", within="A", subject="subject")
    moved = pairwise_tests(long_table(cells + offset * np.arange(12)[:, None]), "y", within="A", subject="subject")
    np.testing.assert_allclose(moved["T"], plain["T"], rtol=1e-14)
    np.testing.assert_allclose(moved["ci_low"], plain["ci_low"], rtol=1e-12)


@pytest.mark.parametrize("sizes", [(8, 8), (5, 11)])
@pytest.mark.parametrize("scale", [2.0**-900, 1.0, 2.0**900])
def test_between_groups_at_any_offset_and_scale(sizes: tuple[int, int], scale: float) -> None:
    values = np.round(np.random.default_rng(7).normal(50, 5, sum(sizes)))
    groups = np.repeat(["a", "b"], sizes)
    plain = pairwise_tests(pd.DataFrame({"g": groups, "y": values}), "y", between="g").iloc[0]
    for offset in (0.0, 1e12):
        table = pd.DataFrame({"g": groups, "y": (values + offset) * scale})
        row = pairwise_tests(table, "y", between="g").iloc[0]
        for column in ("T", "dof", "p_unc", "hedges"):
            assert relative_error(row[column], plain[column]) < 1e-13
        assert relative_error(row["mean_diff"], plain["mean_diff"] * scale) < 1e-13


def test_welch_for_unequal_sizes_pooled_for_equal_ones() -> None:
    """Expected: Welch 1947, written out; `test_anova_crosscheck` holds the same against pingouin."""
    table = pd.DataFrame({"g": list("aaaabbbbb"), "y": [1.0, 2, 3, 4, 2, 4, 6, 9, 11]})
    row = pairwise_tests(table, "y", between="g").iloc[0]
    a, b = np.array([1.0, 2, 3, 4]), np.array([2.0, 4, 6, 9, 11])
    va, vb = a.var(ddof=1) / 4, b.var(ddof=1) / 5
    assert row["T"] == pytest.approx((a.mean() - b.mean()) / math.sqrt(va + vb), rel=1e-13)
    assert row["dof"] == pytest.approx((va + vb) ** 2 / (va**2 / 3 + vb**2 / 4), rel=1e-13)
    assert pairwise_tests(table.iloc[:8], "y", between="g")["dof"].tolist() == [6.0]


def test_groups_without_variation_or_of_one() -> None:
    table = pd.DataFrame({"g": list("aabbc"), "y": [0.1, 0.1, 0.3, 0.3, 5.0]})
    result = pairwise_tests(table, "y", between="g").set_index(["A", "B"])
    assert result["T"].isna().all()
    assert "do not vary" in result.at[("a", "b"), "note"]
    assert "a group has one value" in result.at[("a", "c"), "note"]


def test_the_factor_is_given_by_name() -> None:
    """pingouin has `between` in third place: a position must not choose between two tests."""
    table = long_table(np.arange(12.0).reshape(4, 3) ** 2)
    with pytest.raises(TypeError, match="positional"):
        pairwise_tests(table, "y", "A", "subject")  # type: ignore[misc]


def test_requests_that_are_refused() -> None:
    table = long_table(np.round(np.random.default_rng(1).normal(size=(5, 2, 2)), 2))
    with pytest.raises(BadOption, match=r"names 2 factors; compare .* aggregate='mean'"):
        pairwise_tests(table, "y", within=["A", "B"], subject="subject")
    with pytest.raises(BadOption, match="padjust='fdr' is unknown"):
        pairwise_tests(table, "y", within="A", subject="subject", padjust="fdr")
    with pytest.raises(BadOption, match="give one factor"):
        pairwise_tests(table, "y", within="A", subject="subject", between="B")
    with pytest.raises(BadOption, match="give one factor"):
        pairwise_tests(table, "y")
    with pytest.raises(BadOption, match="needs `subject`"):
        pairwise_tests(table, "y", within="A")
    with pytest.raises(DuplicatedCells):
        pairwise_tests(table, "y", within="A", subject="subject")
    with pytest.raises(IncompleteCells):
        pairwise_tests(table[table["B"] == "0"].iloc[1:], "y", within="A", subject="subject")
