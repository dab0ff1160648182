"""Answers as tables: the digits that mean something, a dash that says why, columns under names that people know."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.analysis.plans.answers import Answer, StatisticSettings
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.missing import MissingSummary
from palpate.analysis.regenerating import descriptions as shown
from palpate.analysis.regenerating.plan_tests import QuestionResult
from palpate.analysis.reports.headings import HEADINGS, heading, is_p
from palpate.analysis.reports.tables import NO_NUMBER, column_texts, value_table


def answered(outcome, rows, name="levels", test="anova", refused="", **more):
    answer = None if refused else Answer(tuple(rows), "A method", {"F": "F of the effect"}, 8, 32, **more)
    return QuestionResult(
        StatisticSettings(name=name, test=test), outcome, answer, refused, "", MissingSummary("refuse"), 0.0
    )


@pytest.mark.parametrize(
    ("name", "values", "texts"),
    [
        ("mean", [6.28, -4.2e-18, -0.5], ["6.28", "0.00", "−0.50"]),
        ("F", [311.482, 0.2], ["311.48", "0.20"]),
        ("r", [0.5, -0.25], ["0.500", "−0.250"]),
        ("variance", [0.00034, 0.00001], ["0.00034", "0.00001"]),
        ("F", [1.5e9, 1.0], ["1.50 × 10^9", "1.00"]),
        ("df1", [14.0, 3.0], ["14", "3"]),
        ("df2", [14.0, 3.25], ["14.00", "3.25"]),
        ("p", [0.0, 5e-324, 0.0431, 1.0, 0.99999], ["< .001", "< .001", ".043", "> .999", "> .999"]),
        ("p_holm", [None, math.nan], ["–", "–"]),
        ("ci_high", [math.inf, -math.inf, 1.5], ["∞", "−∞", "1.50"]),
        ("word", ["None", None, ""], ["None", "", ""]),
        ("kept", [True, False], ["yes", "no"]),
        ("n", [1800, -3], ["1800", "−3"]),
    ],
)
def test_a_column_shows_the_digits_that_mean_something(name, values, texts):
    assert column_texts(name, values) == texts


@given(st.lists(st.floats() | st.none(), min_size=1, max_size=6), st.sampled_from(["p", "mean", "df1", "p_unc", "n"]))
def test_no_number_is_ever_shown_as_nan_or_none(values, name):
    for text in column_texts(name, values):
        assert not {"nan", "none", "inf"} & {text.lower()}
        assert text and text != "−0.00"


@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_p_is_never_zero(values):
    assert is_p("p_greenhouse_geisser") and not is_p("participants")
    assert all(float(text.lstrip("<> ")) > 0 for text in column_texts("p", values))


def test_what_is_undefined_has_the_number_of_its_reason():
    rows = [
        {"effect": "a", "F": 2.0, "eps": 0.5},
        {"effect": "b", "F": None, "eps": 0.5, "note": "no variation"},
        {"effect": "c", "F": 1.0, "eps": None},
        {"effect": "d", "F": 1.0, "eps": 1.0, "note": "few people"},
    ]
    found = value_table(rows)
    assert found.rows[1] == ("b", "– ¹", "0.500")
    assert found.rows[2] == ("c", "1.00", "– ²")
    assert found.rows[3] == ("d ³", "1.00", "1.000")
    assert found.notes == ("¹ no variation", f"² {NO_NUMBER}", "³ few people")


def test_a_figures_row_leaves_empty_what_it_does_not_have():
    rows = [{"shows": "mean", "value": 2.0, "sd": None}, {"shows": "sd", "value": None, "sd": 1.5, "note": "why"}]
    found = value_table(rows, without="")
    assert found.rows == (("mean", "2.00", ""), ("sd", "– ¹", "1.50")) and found.notes == ("¹ why",)


def test_outcomes_of_several_rows_have_headings_and_those_of_one_a_column():
    one = [answered(name, [{"effect": "x", "F": 2.0}]) for name in ("Soft", "Hard")]
    assert [row[0] for row in shown.test_table(one).rows] == ["Soft", "Hard"]
    two = [answered(name, [{"effect": "x", "F": 2.0}, {"effect": "y", "F": 1.0}]) for name in ("Soft", "Hard")]
    found = shown.test_table(two)
    assert dict(found.groups) == {0: "Soft", 2: "Hard"} and len(found.rows) == 4
    assert [head.name for head in found.heads] == ["effect", "F"]


def test_a_refused_outcome_keeps_its_place_with_the_reason():
    found = shown.test_table(
        [answered("Soft", [{"effect": "x", "F": 2.0}]), answered("Hard", [], refused="too few people")]
    )
    assert found.rows == (("Soft", "x", "2.00"), ("Hard", "", "– ¹"))
    assert found.notes == ("¹ Not answered: too few people",)
    alone = shown.test_table([answered("", [], refused="too few people")])
    assert alone.rows and any("too few people" in note for note in alone.notes)


def test_rows_belong_to_every_mark_that_they_name():
    found = value_table([{"a": "g2", "b": "g10", "n": 3}, {"a": "x", "b": "g2", "n": 1}], known={"g2", "g10", "3"})
    assert found.keys == (("g2", "g10"), ("g2",))


def test_columns_say_what_they_are():
    found = shown.test_table([answered("", [{"effect": "x", "F": 2.0, "partial_eta_squared": 0.5}])])
    assert [(head.name, head.column, head.meaning) for head in found.legend] == [("F", "F", "F of the effect")]
    assert heading("partial_eta_squared") == "η²p" and heading("pc12") == "component 12"
    assert heading("some_other_name") == "some other name"
    assert all("_" not in shown for shown in HEADINGS.values())


def test_a_kind_of_test_may_name_columns_of_its_own():
    found = value_table([{"decides": 3, "F": 2.0}], headings={"decides": "people who decide"})
    assert [head.name for head in found.heads] == ["people who decide", "F"]


def test_every_kind_of_test_has_a_name_in_words():
    assert len({kind.title for kind in TESTS.values()}) == len(TESTS)
    assert (
        shown.test_title([answered("", [], name="variant_pairs", test="pairs")])
        == "Variant pairs: pairwise comparisons"
    )


def test_a_note_of_some_outcomes_names_them():
    both = [answered("Soft", [{"F": 1.0}], notes=("all", "own")), answered("Hard", [{"F": 1.0}], notes=("all",))]
    assert shown.notes_of(both) == ("all", "Soft: own")
