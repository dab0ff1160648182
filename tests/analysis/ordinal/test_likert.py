"""Likert items: counts, shares and the middle of the answers; the published means of the usability study."""

from __future__ import annotations

import math
from decimal import ROUND_HALF_UP, Decimal

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.ordinal.likert import likert
from palpate.analysis.statistics.refusals import BadOption, BadValue, StatisticsError

POINTS = range(1, 8)
THESIS = {"Differentiability": 5.94, "Ease of Use": 5.63, "Correctness": 5.44, "Realism": 5.13, "Learnability": 4.81}


def answers_with_sum(total, n=16):
    """n answers from 1 to 7 with this sum."""
    whole, rest = divmod(total, n)
    return [whole + 1] * rest + [whole] * (n - rest)


def two_decimals(value):
    return float(Decimal(value).quantize(Decimal("0.01"), ROUND_HALF_UP))


def test_the_published_means_are_sixteenths_and_come_out_of_80_answers():
    """Thesis 5.7.2.2: 16 participants, five items, 7 points; each mean has one sum that rounds to it."""
    rows = []
    for item, mean in THESIS.items():
        sums = [total for total in range(16, 113) if two_decimals(total / 16) == mean]
        assert len(sums) == 1, item
        rows += [{"item": item, "value": value} for value in answers_with_sum(sums[0])]
    assert len(rows) == 80
    result = likert(pd.DataFrame(rows), "value", "item", POINTS).set_index("item")
    assert {item: two_decimals(result.loc[item, "mean"]) for item in THESIS} == THESIS
    assert result["mean"].tolist() == [total / 16 for total in (87, 95, 90, 77, 82)]  # in natural order of the names
    assert result["n"].tolist() == [16] * 5
    assert result["disagree"].max() == 0  # with answers this close together nobody is below the middle


def test_every_number_of_one_item():
    table = pd.DataFrame({"q": "clear", "a": [1, 2, 2, 5, 5, 7, None, 6]})
    row = likert(table, "a", "q", POINTS).iloc[0]
    counts = [row[f"n_{point}"] for point in POINTS]
    assert (counts, row["n"], row["missing"]) == ([1, 2, 0, 0, 2, 1, 1], 7, 1)
    assert sum(row[f"share_{point}"] for point in POINTS) == pytest.approx(1)
    # R 4.2.2: quantile(c(1, 2, 2, 5, 5, 7, 6), c(.25, .5, .75)) -> 2.0 5.0 5.5; sd -> 2.309401076758503
    assert (row["q1"], row["median"], row["q3"]) == (2.0, 5.0, 5.5)
    assert row["mean"] == 4.0
    assert row["sd"] == pytest.approx(2.309401076758503, rel=1e-15)
    assert (row["mode"], row["agree"], row["disagree"]) == ("2, 5", 4 / 7, 3 / 7)


def test_constant_answers_and_one_participant_have_what_can_be_had():
    table = pd.DataFrame({"q": ["a"] * 4 + ["b", "c"], "y": [4, 4, 4, 4, 7, np.nan]})
    result = likert(table, "y", "q", POINTS).set_index("q" if "q" in table.index.names else "item")
    assert (result.loc["a", "sd"], result.loc["a", "agree"], result.loc["a", "mode"]) == (0.0, 0.0, "4")
    assert math.isnan(result.loc["b", "sd"])
    assert result.loc["b", "note"] == "sd is undefined: one answer"
    assert (result.loc["c", "n"], result.loc["c", "missing"], result.loc["c", "note"]) == (0, 1, "no answer was given")
    assert math.isnan(result.loc["c", "median"])
    assert math.isnan(result.loc["c", "share_1"])


def test_order_of_rows_and_type_of_labels_change_nothing():
    rng = np.random.Generator(np.random.PCG64(6))
    table = pd.DataFrame({"item": rng.integers(1, 12, 200), "y": rng.integers(1, 8, 200)})
    plain = likert(table, "y", "item", POINTS)
    pd.testing.assert_frame_equal(likert(table.sample(frac=1, random_state=1), "y", "item", POINTS), plain)
    text = likert(table.astype({"item": str}), "y", "item", POINTS)
    pd.testing.assert_frame_equal(text.drop(columns="item"), plain.drop(columns="item"))


@pytest.mark.parametrize(
    ("values", "points", "error"),
    [
        ([1, 8], POINTS, BadValue),
        ([1, 2.5], POINTS, BadValue),
        ([1, np.inf], POINTS, BadValue),
        ([1, "often"], POINTS, BadValue),
        ([1, 2], [1], BadOption),
        ([1, 2], [2, 1], BadOption),
        ([1, 2], "17", BadOption),
        ([1, 2], [1, np.nan], BadOption),
    ],
)
def test_answers_off_the_scale_are_refused(values, points, error):
    with pytest.raises(error) as caught:
        likert(pd.DataFrame({"item": "a", "y": values}), "y", "item", points)
    assert isinstance(caught.value, StatisticsError)
