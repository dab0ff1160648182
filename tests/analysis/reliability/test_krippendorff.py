"""Krippendorff's alpha against his published examples and a slow exact one; its bootstrap against repeated units."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.reliability.krippendorff import LEVELS, disagreement_of, krippendorff, krippendorff_alpha
from palpate.analysis.statistics.refusals import BadOption, BadValue, DuplicatedCells, TooFew
from tests.analysis.reliability.tables import long
from tests.examples import examples

NO = np.nan
# Krippendorff 2011, part C: four observers, twelve units, gaps.
TWELVE = np.array(
    [
        [1, 2, 3, 3, 2, 1, 4, 1, 2, NO, NO, NO],
        [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, NO, 3],
        [NO, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, NO],
        [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, NO],
    ]
).T


@pytest.mark.parametrize(
    ("level", "published"), [("nominal", 0.743), ("ordinal", 0.815), ("interval", 0.849), ("ratio", 0.797)]
)
def test_the_published_example_with_gaps(level: str, published: float) -> None:
    result = krippendorff(TWELVE, level)  # type: ignore[arg-type]
    assert round(result.alpha, 3) == published
    assert (result.units, result.raters, result.values, result.missing, result.unpaired) == (11, 4, 40, 7, 1)


def test_the_published_examples_of_two_observers() -> None:
    meg, owen = [0, 1, 0, 0, 0, 0, 0, 0, 1, 0], [1, 1, 1, 0, 0, 1, 0, 0, 0, 0]
    assert round(krippendorff(np.array([meg, owen], dtype=float).T, "nominal").alpha, 3) == 0.095  # part A
    ben, gerry = "aabbdcccedda", "babbbccceddd"
    table = pd.DataFrame(
        [
            {"unit": i, "who": who, "y": value}
            for who, values in (("Ben", ben), ("Gerry", gerry))
            for i, value in enumerate(values)
        ]
    )
    assert round(krippendorff_alpha(table, "y", "unit", "who", "nominal").alpha, 3) == 0.692  # part B


def slow_alpha(values: np.ndarray, level: str) -> float | None:
    """The definition in exact fractions: every pair of values of a unit, against every pair of all."""
    units = [[Fraction(float(v)) for v in row if not np.isnan(v)] for row in values]
    units = [unit for unit in units if len(unit) > 1]
    pooled = Counter(v for unit in units for v in unit)

    def delta(a: Fraction, b: Fraction) -> Fraction:
        low, high = min(a, b), max(a, b)
        if level == "nominal":
            return Fraction(a != b)
        if level == "ordinal":
            between = sum(count for v, count in pooled.items() if low <= v <= high)
            return (between - Fraction(pooled[low] + pooled[high], 2)) ** 2
        return (a - b) ** 2 if level == "interval" else (((a - b) / (a + b)) ** 2 if a != b else Fraction(0))

    n = sum(map(len, units))
    observed = sum(
        sum(delta(u[i], u[j]) for i in range(len(u)) for j in range(len(u)) if i != j) / (len(u) - 1) for u in units
    )
    expected = sum(delta(a, b) * ca * cb for a, ca in pooled.items() for b, cb in pooled.items())
    return float(1 - (n - 1) * observed / expected) if expected else None


@settings(max_examples=examples(80), deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(LEVELS))
def test_any_table_gives_what_the_definition_gives(seed: int, level: str) -> None:
    rng = np.random.default_rng(seed)
    x = rng.integers(0, 4, (rng.integers(1, 7), rng.integers(2, 5))).astype(float)
    x[rng.random(x.shape) < 0.3] = NO
    result, expected = krippendorff(x, level), slow_alpha(x, level)  # type: ignore[arg-type]
    if expected is None:
        assert np.isnan(result.alpha)
        assert result.note.startswith("undefined")
    else:
        assert result.alpha == pytest.approx(expected, abs=1e-13)


def test_the_smallest_and_largest_values_have_the_ratios_that_they_have() -> None:
    plain = krippendorff(TWELVE, "ratio").alpha
    assert krippendorff(TWELVE * 5e-324, "ratio").alpha == plain
    assert krippendorff(TWELVE * 2.0**990, "ratio").alpha == plain


def test_an_offset_changes_no_digit_at_level_interval() -> None:
    assert krippendorff(TWELVE + 1e9, "interval").alpha == krippendorff(TWELVE, "interval").alpha


@pytest.mark.parametrize("level", LEVELS)
def test_a_draw_is_the_alpha_of_the_units_it_repeats(level: str) -> None:
    units = TWELVE[:11]
    weights = np.random.default_rng(8).multinomial(11, [1 / 11] * 11, size=20)
    fast = disagreement_of(units, level)(weights.astype(float))
    slow = [krippendorff(np.repeat(units, row, axis=0), level).alpha for row in weights]  # type: ignore[arg-type]
    np.testing.assert_allclose(fast, slow, rtol=1e-12)


def test_the_interval_depends_on_the_seed_and_on_nothing_else() -> None:
    table = long(TWELVE)
    one, same, other = (
        krippendorff_alpha(rows, "y", "target", "rater", "ordinal", seed=seed, draws=500)
        for rows, seed in ((table, 1), (table.sample(frac=1, random_state=1), 1), (table, 2))
    )
    assert one == same
    assert one.ci_low != other.ci_low
    assert one.ci_low < one.alpha < one.ci_high


def test_what_has_no_alpha_says_why() -> None:
    assert "all values are equal" in krippendorff(np.full((4, 3), 0.3), "interval", draws=200).note
    assert "no unit has values of two raters" in krippendorff(np.array([[1, NO], [NO, 2]]), "nominal").note
    assert "negative" in krippendorff(np.array([[1.0, 2], [2, 1]]), "nominal").note
    thin = np.array([[1.0, 1], [1, 1], [1, 1], [1, 2]])
    assert "draws hold one value only" in krippendorff(thin, "nominal", draws=500).note


def test_refusals() -> None:
    with pytest.raises(BadValue, match="-1 is below 0.*level 'interval'"):
        krippendorff(np.array([[-1.0, 2], [1, 1]]), "ratio")
    with pytest.raises(TooFew, match="one rater"):
        krippendorff(np.ones((4, 1)), "nominal")
    with pytest.raises(BadOption, match="level='metric'"):
        krippendorff_alpha(long(TWELVE), "y", "target", "rater", "metric")  # type: ignore[arg-type]
    with pytest.raises(BadOption, match="have no mean"):
        krippendorff_alpha(long(TWELVE), "y", "target", "rater", "ordinal", aggregate="mean")
    twice = pd.concat([long(TWELVE), long(TWELVE).iloc[[0]]])
    with pytest.raises(DuplicatedCells, match="target='0', rater='0'"):
        krippendorff_alpha(twice, "y", "target", "rater", "interval")


def test_nominal_values_may_be_any_labels_and_none_is_missing() -> None:
    table = long(TWELVE)
    names = table.assign(y=table["y"].map({1: "nan", 2: "None", 3: "c", 4: "d", 5: "e"}))
    result = krippendorff_alpha(names, "y", "target", "rater", "nominal", draws=0)
    assert result.alpha == krippendorff(TWELVE, "nominal").alpha
    assert result.missing == 7
