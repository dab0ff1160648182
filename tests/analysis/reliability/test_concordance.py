"""Kendall's W against R, its exact p against enumeration, and orders that say nothing."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.ordinal.friedman import friedman
from palpate.analysis.reliability.concordance import concordance, kendall_w
from palpate.analysis.statistics.references import reference_table
from palpate.analysis.statistics.refusals import BadOption, IncompleteCells, TooFew
from tests.analysis.reliability.tables import R, long, relative, wide
from tests.examples import examples


@pytest.mark.parametrize("name", R["sets"])
def test_w_chi2_and_p_are_those_of_r_with_ties(name: str) -> None:
    expected, result = R["sets"][name]["kendall"], concordance(wide(name))
    assert relative(result["W"], expected["W"]) < 1e-14  # vegan::kendall.global
    assert relative(result["chi2"], expected["chi2"]) < 1e-14  # stats::friedman.test
    assert relative(result["p_chi2"], expected["p"]) < 1e-12


def test_hollander_and_wolfe() -> None:
    result = kendall_w(reference_table("csv/RoundingTimes.csv"), "y", "method", "subject", p="chi2").iloc[0]
    assert round(result["chi2"], 3) == 11.143
    assert round(result["p"], 6) == 0.003805


@pytest.mark.parametrize(
    "values",
    [
        [[1, 2, 1], [2, 1, 2], [3, 3, 3]],
        [[1, 2, 1, 4], [2, 1, 3, 3], [3, 3, 2, 1], [4, 4, 4, 2]],
        [[1, 1, 2], [1, 2, 2], [3, 3, 1], [3, 4, 1]],
    ],
)
def test_the_exact_p_counts_every_order(values: list[list[float]]) -> None:
    from scipy.stats import rankdata

    ranks = [rankdata(column) for column in zip(*values, strict=True)]

    def spread(rows: list[np.ndarray]) -> float:
        total = np.sum(rows, axis=0)
        return float(((total - total.mean()) ** 2).sum())

    observed = spread(ranks)
    orders = [[np.array(order) for order in permutations(row)] for row in ranks[1:]]
    hits = [spread([ranks[0], *rest]) >= observed - 1e-9 for rest in product(*orders)]
    result = concordance(np.array(values, dtype=float), "exact")
    assert result["p_kind"] == "exact"
    assert result["p"] == pytest.approx(np.mean(hits), rel=1e-12)


def test_shuffled_and_exact_p_agree_and_the_seed_decides() -> None:
    x = np.random.default_rng(3).random((4, 5)) + np.arange(4)[:, None] * 0.25
    exact, shuffled, again, other = (
        concordance(x, kind, 20_000, seed)
        for kind, seed in (("exact", 0), ("permutation", 1), ("permutation", 1), ("permutation", 2))
    )
    assert shuffled["p"] == again["p"] != other["p"]
    assert abs(shuffled["p"] - exact["p"]) < 4 * np.sqrt(exact["p"] * (1 - exact["p"]) / 20_000)


def test_too_many_orders_are_reported_and_p_is_never_zero() -> None:
    result = concordance(wide("many"), "exact", 200)
    assert result["p_kind"] == "permutation"
    assert result["note"] == "too many orders for an exact p"
    assert result["p"] == 1 / 201
    assert concordance(np.add.outer(np.arange(300.0), np.zeros(400)), "chi2")["p_chi2"] > 0


def test_rounding_does_not_break_a_tie_and_whole_numbers_stay_apart() -> None:
    rounded, written = ([[0.1 + 0.2, 1], [0.3, 2], [0.5, 3]], [[0.3, 1], [0.3, 2], [0.5, 3]])
    assert concordance(np.array(rounded))["W"] == concordance(np.array(written))["W"]
    large = np.array([[2.0**53 - 2, 1], [2.0**53 - 1, 2], [5, 0]])
    assert concordance(large)["raters_with_ties"] == 0
    assert concordance(large)["W"] == 1


def test_w_and_its_exact_p_are_those_of_friedmans_test() -> None:
    small = 0.1 + 0.2 - 0.3  # rounding of a sum of tenths, beside 0
    x = np.array([[small, small, 0.0], [0, 0, small], [1, -1, 2]])
    ours = kendall_w(long(x), "y", "target", "rater", p="exact").iloc[0]
    theirs = friedman(long(x), "y", "target", "rater").iloc[0]
    assert ours["raters_with_ties"] == theirs["tied"] == 3
    assert (ours["W"], ours["p"]) == (theirs["W"], theirs["p_exact"])


def test_raters_who_put_all_level_are_reported() -> None:
    result = concordance(np.column_stack(([1.0, 2, 3], [1.0, 2, 3], [5.0, 5, 5])), "exact")
    assert result["note"].startswith("1 of 3 raters put all targets level")
    nothing = concordance(np.full((4, 3), 0.3), "auto")
    assert np.isnan(nothing["W"])
    assert np.isnan(nothing["p"])
    assert "W is undefined" in nothing["note"]


def test_refusals() -> None:
    table = long(wide("tied"))
    with pytest.raises(TooFew, match="too few raters"):
        kendall_w(table[table["rater"] == "0"], "y", "target", "rater")
    with pytest.raises(IncompleteCells, match="target='9', rater='6'"):
        kendall_w(table.drop(index=table.index[69]), "y", "target", "rater")
    with pytest.raises(BadOption, match="p='bootstrap'"):
        kendall_w(table, "y", "target", "rater", p="bootstrap")  # type: ignore[arg-type]


@settings(max_examples=examples(25), deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.integers(2, 5))
def test_rows_labels_and_any_rising_scale_change_nothing(seed: int, n: int, m: int) -> None:
    x = np.random.default_rng(seed).integers(0, 5, (n, m)).astype(float)
    plain = kendall_w(long(x), "y", "target", "rater", draws=200)
    mixed = kendall_w(long(np.exp(x) * 1e9, int).sample(frac=1, random_state=seed), "y", "target", "rater", draws=200)
    pd.testing.assert_frame_equal(plain, mixed, check_exact=True)
