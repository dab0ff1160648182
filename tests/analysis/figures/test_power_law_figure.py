"""The figure of magnitude estimates and their power law."""

from __future__ import annotations

import pytest

from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.figures.specimens import answer, data_of, draw_svg, inputs_of, selected
from tests.analysis.magnitudes.test_power_law import INTENSITIES, numbers

FIGURE, TEST = FIGURES["power_law"], TESTS["power_law"]


def law() -> Answer:
    """Two people with exponents of 0.4 and 0.8, and moduli of 2 and 50."""
    people = {
        who: {name: [modulus * x**exponent] for name, x in INTENSITIES.items()}
        for who, modulus, exponent in (("P1", 2.0, 0.4), ("P2", 50.0, 0.8))
    }
    settings = TEST.settings(name="law", test="power_law", table="magnitudes", intensity="intensity")
    return TEST.answer(selected(numbers(people)), settings)


def test_each_stimulus_is_a_dot_and_laws_go_through_the_same_centre() -> None:
    data = data_of(FIGURE, inputs_of(answers={"l": law()}), tests=("l",))
    assert [row["name"] for row in data.rows if row["shows"] == "stimulus"] == ["a", "b", "c"]
    ends = {(row["name"], row["intensity"]): row["magnitude"] for row in data.rows if row["shows"] != "stimulus"}
    for name, exponent in (("all", 0.6), ("P1", 0.4), ("P2", 0.8)):
        assert ends[name, 100.0] / ends[name, 1.0] == pytest.approx(100**exponent)
        assert ends[name, 100.0] * ends[name, 1.0] == pytest.approx(ends["all", 100.0] * ends["all", 1.0])
    marks = [dict(mark.details) for mark in draw_svg(FIGURE, data)[1].marks]
    assert {mark["exponent"] for mark in marks if "exponent" in mark} == {"0.60", "0.40", "0.80"}
    alone = data_of(FIGURE, inputs_of(answers={"l": law()}), tests=("l",), people=False)
    assert {row["shows"] for row in alone.rows} == {"stimulus", "law"} and "(thin)" not in alone.caption


def test_another_test_is_refused() -> None:
    with pytest.raises(DataRefused, match="`tests` must name a test of kind power_law"):
        data_of(FIGURE, inputs_of(answers={"l": answer([{"item": "a", "value": 1.0}])}), tests=("l",))


def test_answers_to_several_questions_have_no_common_exponent() -> None:
    table = numbers({"P1": {"a": [1.0], "b": [2.0]}}).assign(question=["rough", "soft"])
    settings = TEST.settings(name="law", test="power_law", intensity="intensity")
    with pytest.raises(DataRefused, match="answers to rough and soft; name one: where: {question: rough}"):
        TEST.answer(selected(table), settings)
