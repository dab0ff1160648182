"""Means and SDs against exact fractions, on offsets and constants that break naive sums."""

from __future__ import annotations

from fractions import Fraction
from math import inf, isqrt, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.ratings.dataset import LARGEST, DataRefused
from palpate.analysis.ratings.describe import ONE_PARTICIPANT, ONE_RATING, describe
from tests.analysis.ratings_for_tests import small_ratings
from tests.examples import examples

finite = st.floats(allow_nan=False, allow_infinity=False, width=64, min_value=-LARGEST, max_value=LARGEST)


@given(values=st.lists(finite, min_size=2, max_size=12), offset=st.sampled_from([0.0, 1e9, -1e15]))
@settings(max_examples=examples(150), deadline=None)
def test_mean_and_sd_are_the_exact_ones_rounded_once(values: list[float], offset: float) -> None:
    values = [value + offset for value in values]
    exact = [Fraction(value) for value in values]
    mean = sum(exact, Fraction(0)) / len(exact)
    variance = sum(((x - mean) ** 2 for x in exact), Fraction(0)) / (len(exact) - 1)
    row = describe(small_ratings([("P1", "Soft", "x", v) for v in values]), ["attribute"]).iloc[0]
    assert row["mean"] == float(mean)
    assert row["sd"] == float(_root(variance))


def _root(square: Fraction) -> Fraction:
    """The square root to far more digits than a double has."""
    shift = max(0, 200 + square.denominator.bit_length() - square.numerator.bit_length())
    shift += shift % 2
    return Fraction(isqrt((square.numerator << (2 * shift)) // square.denominator), 1 << shift)


@pytest.mark.parametrize("constant", [0.1, 0.3, 1e9 + 0.1, 1e-300, LARGEST])
def test_a_constant_has_no_spread_at_all(constant: float) -> None:
    row = describe(small_ratings([(f"P{i}", "Soft", "x", constant) for i in range(10)]), ["attribute"]).iloc[0]
    assert (row["mean"], row["sd"]) == (constant, 0.0)


def test_an_offset_of_1e9_costs_no_digit() -> None:
    rows = [(f"P{i}", "Soft", "x", float(i)) for i in range(5)]
    far = [(p, a, level, v + 1e9) for p, a, level, v in rows]
    near = describe(small_ratings(rows), ["attribute"]).iloc[0]
    moved = describe(small_ratings(far), ["attribute"]).iloc[0]
    assert moved["sd"] == near["sd"]
    assert moved["mean"] == near["mean"] + 1e9


def test_over_participants_first_averages_within_each_participant() -> None:
    rows = [("P1", "Soft", "x", 0.0), ("P1", "Soft", "y", 4.0), ("P2", "Soft", "x", 6.0)]
    ratings = small_ratings(rows)
    over_ratings = describe(ratings, ["attribute"]).iloc[0]
    over_people = describe(ratings, ["attribute"], kind="over participants").iloc[0]
    assert (over_ratings["kind"], over_ratings["n"], over_ratings["mean"]) == ("over ratings", 3, 10 / 3)
    assert (over_people["kind"], over_people["n"], over_people["mean"]) == ("over participants", 2, 4.0)
    assert over_people["sd"] == pytest.approx(8**0.5, rel=1e-15)
    assert (over_people["ratings_min"], over_people["ratings_max"]) == (1, 2)


@pytest.mark.parametrize(("kind", "reason"), [("over ratings", ONE_RATING), ("over participants", ONE_PARTICIPANT)])
def test_one_value_has_no_sd_and_says_why(kind: str, reason: str) -> None:
    row = describe(small_ratings([("P1", "Soft", "x", 2.5)]), ["attribute"], kind=kind).iloc[0]  # type: ignore[arg-type]
    assert row["sd"] is None
    assert (row["n"], row["mean"], row["sd_reason"]) == (1, 2.5, reason)


def test_rows_are_in_the_order_of_the_study() -> None:
    rows = [(p, a, level, 1.0) for p in ("P10", "P2") for a in ("Warm", "Soft") for level in ("g10", "g2")]
    ratings = small_ratings(rows)
    description = describe(ratings, ["attribute", "level"])
    assert list(zip(description["attribute"], description["level"], strict=True)) == [
        ("Warm", "g2"), ("Warm", "g10"), ("Soft", "g2"), ("Soft", "g10"),
    ]  # fmt: skip


def test_attributes_are_averaged_only_when_a_category_is_requested() -> None:
    rows = [(p, a, "x", v) for p in ("P1", "P2") for a, v in (("Soft", 1.0), ("Warm", 3.0), ("New", 8.0))]
    categories = {"Soft": "physical", "Warm": "physical", "New": "emotional"}
    ratings = small_ratings(rows, categories=categories)
    description = describe(ratings, ["category"], kind="over participants")
    assert description[["category", "mean", "n"]].values.tolist() == [["physical", 2.0, 2], ["emotional", 8.0, 2]]
    with pytest.raises(DataRefused, match="3 attributes would be averaged"):
        describe(ratings, ["level"])
    with pytest.raises(DataRefused, match="Warm, New: no category is declared"):
        describe(small_ratings(rows, categories={"Soft": "physical"}), ["category"])


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_a_value_that_is_not_finite_is_refused_not_skipped(bad: float) -> None:
    ratings = small_ratings([("P1", "Soft", "x", 1.0), ("P2", "Soft", "x", bad)])
    with pytest.raises(DataRefused, match=r"1 value is not finite, the first is .* of P2 on Soft"):
        describe(ratings, ["attribute"])


def test_a_column_or_kind_that_does_not_exist_is_refused() -> None:
    ratings = small_ratings([("P1", "Soft", "x", 1.0)])
    with pytest.raises(DataRefused, match="did you mean 'level'"):
        describe(ratings, ["attribute", "levl"])
    with pytest.raises(DataRefused, match="'over participants' is expected"):
        describe(ratings, ["attribute"], kind="over people")  # type: ignore[arg-type]
