"""The dot plot of a test's estimates."""

from __future__ import annotations

import pytest

from palpate.analysis.plans.kinds import FIGURES
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.figures.specimens import answer, data_of, draw_svg, inputs_of

ESTIMATES = FIGURES["estimates"]
ROWS = [
    {"item": "wool", "value": -0.5, "ci_low": -1.0, "ci_high": 0.0},
    {"item": "silk", "value": 1.25, "ci_low": None, "ci_high": None},
    {"item": "felt", "value": 0.5, "ci_low": 0.25, "ci_high": 0.75},
    {"item": "hemp", "value": None, "ci_low": None, "ci_high": None},
]


def test_lines_come_by_value_or_as_listed_and_without_a_value_not_at_all() -> None:
    inputs = inputs_of(answers={"s": answer(ROWS)})
    data = data_of(ESTIMATES, inputs, tests=("s",))
    assert [(row["name"], row["value"], row["low"]) for row in data.rows] == [
        ("silk", 1.25, None), ("felt", 0.5, 0.25), ("wool", -0.5, -1.0),
    ]  # fmt: skip
    assert "1 row without a value left out" in data.caption
    listed = data_of(ESTIMATES, inputs, tests=("s",), sort="as_listed")
    assert [row["name"] for row in listed.rows] == ["wool", "silk", "felt"]
    marks = [dict(mark.details) for mark in draw_svg(ESTIMATES, listed)[1].marks]
    assert [(mark["name"], mark["interval"]) for mark in marks] == [
        ("wool", "−1.00 to 0.00"), ("silk", "none"), ("felt", "0.25 to 0.75"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "`tests` must name the one test to show, found 0"),
        ({"tests": ("s", "s")}, "found 2"),
        ({"tests": ("s",), "low": "ci_lo"}, "no column 'ci_lo'; did you mean 'ci_low'"),
        ({"tests": ("t",)}, "no row of the test 't' has a value in 'value'"),
    ],
)
def test_what_cannot_be_shown_is_refused(settings: dict, message: str) -> None:
    inputs = inputs_of(answers={"s": answer(ROWS), "t": answer(ROWS[-1:])})
    with pytest.raises(DataRefused, match=message.replace("(", r"\(")):
        data_of(ESTIMATES, inputs, **settings)
