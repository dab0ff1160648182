"""Values as a reader sees them: the digits that mean something, a dash that says why, columns under known names."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.analysis.reports.tables import (
    NO_NUMBER,
    Footnotes,
    column_texts,
    grouped_table,
    in_seconds,
    is_p,
    table_letters,
    text_table,
    value_table,
    written,
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
    table = value_table(rows)
    assert table.rows[1] == ("b", "– ¹", "0.500")
    assert table.rows[2] == ("c", "1.00", "– ²")
    assert table.rows[3] == ("d ³", "1.00", "1.000")
    assert table.notes == ("¹ no variation", f"² {NO_NUMBER}", "³ few people")


def test_a_figures_row_leaves_empty_what_it_does_not_have():
    rows = [{"shows": "mean", "value": 2.0, "sd": None}, {"shows": "sd", "value": None, "sd": 1.5, "note": "why"}]
    table = value_table(rows, without="")
    assert table.rows == (("mean", "2.00", ""), ("sd", "– ¹", "1.50")) and table.notes == ("¹ why",)


def test_rows_belong_to_every_mark_that_they_name():
    table = value_table([{"a": "g2", "b": "g10", "n": 3}, {"a": "x", "b": "g2", "n": 1}], known={"g2", "g10", "3"})
    assert table.keys == (("g2", "g10"), ("g2",))


def test_a_kind_of_test_may_name_columns_of_its_own():
    table = value_table([{"decides": 3, "F": 2.0}], headings={"decides": "people who decide"})
    assert [head.name for head in table.heads] == ["people who decide", "F"]


def test_footnotes_are_numbered_and_never_share_a_number() -> None:
    notes = Footnotes()
    marks = [notes.marked("x", f"note {number}") for number in range(40)]
    assert len(set(marks)) == 40
    assert (marks[0], marks[22], marks[39]) == ("x ¹", "x ²³", "x ⁴⁰")
    assert notes.marked("y", "note 22") == "y ²³" and notes.marked("z", "") == "z"
    assert notes.lines()[39] == "⁴⁰ note 39"


def test_cells_as_a_reader_sees_them():
    assert written(None, "2") == written(float("nan"), "2") == "–"
    assert written(-0.5, "1") == "−0.5"
    assert written(0.9, "share") == "90.0%"
    assert (in_seconds(600), in_seconds(12), in_seconds(0.02)) == ("10 min", "12 s", "20.0 ms")
    assert (written(5149, "bytes"), written(2.3e8, "bytes")) == ("5 kB", "230.0 MB")


def test_a_table_in_groups_leaves_a_repeated_first_cell_empty_and_rules_off_the_next():
    table = grouped_table(("attribute", "effect"), [("Soft", "a"), ("Soft", "b"), ("Hard", "a")], ["note"])
    assert table.rows == (("Soft", "a"), ("", "b"), ("Hard", "a")) and table.ruled == {2} and table.notes == ("note",)
    assert grouped_table(("attribute",), [("Soft",), ("Hard",)]).ruled == set()


def test_a_cell_of_many_letters_counts_as_one_that_wraps():
    assert table_letters(text_table(("a", "two words"), [("x" * 80, "y")])) == 30 + 2 + len("words") + 2
