"""The design check names what is missing, double or not finite; property: it finds exactly what was spoilt."""

from __future__ import annotations

from itertools import product
from math import inf, nan

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.ratings.dataset import Crossing, DataRefused, Scale
from palpate.analysis.ratings.design import check_design, check_ratings
from tests.analysis.ratings_for_tests import small_ratings
from tests.examples import examples


def full(people: int = 3, a: int = 2, b: int = 3) -> pd.DataFrame:
    rows = [(f"P{p}", f"a{i}", f"b{j}", float(p + i + j)) for p in range(people) for i in range(a) for j in range(b)]
    return pd.DataFrame(rows, columns=["participant", "a", "b", "value"])


def test_a_full_crossing_is_complete() -> None:
    report = check_design(full(), cells=["a", "b"])
    assert report.ok
    assert (report.rows, report.participants, report.cells_expected) == (18, 3, 18)
    assert report.text() == "3 participants, 18 ratings, 18 cells owed: complete"


@given(
    people=st.integers(2, 5),
    a=st.integers(2, 3),
    b=st.integers(2, 4),
    data=st.data(),
)
@settings(max_examples=examples(60), deadline=None)
def test_it_finds_exactly_the_cells_that_were_removed_doubled_and_made_not_finite(
    people: int, a: int, b: int, data: st.DataObject
) -> None:
    table = full(people, a, b)
    rows = st.sets(st.integers(0, len(table) - 1), max_size=4)
    removed, doubled = data.draw(rows), data.draw(rows)
    doubled -= removed
    spoilt = data.draw(rows) - removed - doubled
    table["value"] = [nan if i in spoilt else v for i, v in enumerate(table["value"])]
    order = data.draw(st.permutations([*(set(range(len(table))) - removed), *doubled]))
    left = table.iloc[list(order)]
    crossing = Crossing({}, {"a": tuple(f"a{i}" for i in range(a)), "b": tuple(f"b{i}" for i in range(b))})
    before = left.copy()
    report = check_design(left, cells=["a", "b"], crossings=[crossing], limit=100)
    remaining = len(set(table["participant"].iloc[list(set(range(len(table))) - removed)]))
    expected = {row for row in removed if f"P{row // (a * b)}" in set(left["participant"])}
    places = {kind: _places(report, kind) for kind in ("missing", "duplicate", "non_finite")}
    assert places["missing"] == {_key(table, row) for row in expected}
    assert places["duplicate"] == {_key(table, row) for row in doubled}
    assert places["non_finite"] == {_key(table, row) for row in spoilt}
    assert report.participants == remaining
    assert report.ok == (not expected and not doubled and not spoilt)
    pd.testing.assert_frame_equal(left, before)


def _key(table: pd.DataFrame, row: int) -> tuple[str, str, str]:
    values = table.iloc[row]
    return values["participant"], values["a"], values["b"]


def _places(report: object, kind: str) -> set[tuple[str, str, str]]:
    problem = report.of(kind)  # type: ignore[attr-defined]
    places = problem.listed if problem else ()
    return {(place.participant, place.cell["a"], place.cell["b"]) for place in places}


def test_a_level_that_nobody_rated_is_missing_if_it_was_declared() -> None:
    crossing = Crossing({}, {"a": ("a0", "a1", "a2"), "b": ("b0", "b1", "b2")})
    missing = check_design(full(), cells=["a", "b"], crossings=[crossing]).of("missing")
    assert missing is not None
    assert {place.cell["a"] for place in missing.listed} == {"a2"}
    assert missing.count == 3 * 3


def test_a_level_that_was_not_declared_is_named() -> None:
    crossing = Crossing({}, {"a": ("a0",), "b": ("b0", "b1", "b2")})
    problem = check_design(full(), cells=["a", "b"], crossings=[crossing]).of("undeclared")
    assert problem is not None and problem.count == 9


def test_groups_owe_only_their_own_levels() -> None:
    table = full(4)
    table["group"] = ["1" if person in ("P0", "P1") else "2" for person in table["participant"]]
    table["a"] = [
        level if group == "1" else level.upper() for level, group in zip(table["a"], table["group"], strict=True)
    ]
    assert check_design(table, cells=["a", "b"], between=["group"]).ok
    crossed = check_design(table, cells=["a", "b"]).of("missing")
    assert crossed is not None and crossed.count == 4 * 6


def test_a_participant_in_two_groups_is_named() -> None:
    table = full(2)
    table["group"] = ["1"] * 6 + ["1", "2"] * 3
    problem = check_design(table, cells=["a", "b"], between=["group"]).of("two_groups")
    assert problem is not None
    assert problem.listed[0].text() == "P1: group 1 and group 2"


def test_all_are_counted_and_the_first_are_listed() -> None:
    missing = check_design(full(30).drop(index=range(0, 180, 2)), cells=["a", "b"], limit=5).of("missing")
    assert missing is not None
    assert (missing.count, len(missing.listed)) == (90, 5)
    assert missing.text().splitlines()[0] == "90 missing cells:"
    assert missing.text().endswith("... and 85 more")


def test_a_duplicate_shows_its_values() -> None:
    table = pd.concat([full(), full().iloc[[4]].assign(value=9.0)], ignore_index=True)
    problem = check_design(table, cells=["a", "b"]).of("duplicate")
    assert problem is not None
    assert problem.listed[0].text() == "P0, a a1, b b1: 2 ratings (2, 9), 1 planned"


def test_values_off_the_scale_and_between_its_steps_are_distinguished() -> None:
    table = full().assign(value=[0.0, 0.5, 11.0, -1.0, inf, nan, *range(1, 11), 3.0, 4.0])
    report = check_design(table, cells=["a", "b"], scale=Scale(0, 10, 1))
    counts = {problem.kind: problem.count for problem in report.problems}
    assert counts == {"non_finite": 2, "out_of_scale": 2, "off_step": 1}
    assert "value" in report.text() and "nan" in report.text() and "inf" in report.text()


def test_a_constant_rater_is_a_note_not_a_problem() -> None:
    constant = {("P1", "Soft"), ("P1", "Warm"), ("P2", "Soft")}
    rows = [
        (person, attribute, level, 3.0 if (person, attribute) in constant else float(place))
        for person, attribute in product(("P1", "P2", "P3"), ("Soft", "Warm"))
        for place, level in enumerate(("x", "y", "z"))
    ]
    report = check_ratings(small_ratings(rows))
    assert report.ok
    assert {note.kind: note.listed[0].text() for note in report.notes} == {
        "constant_rater": "P1: all 6 ratings are 3",
        "constant_attribute": "P2, attribute Soft: all 3 ratings are 3",
    }


def test_a_row_without_a_label_is_counted_not_dropped() -> None:
    table = full()
    table.loc[3, "a"] = None
    report = check_design(table, cells=["a", "b"])
    assert {problem.kind: problem.count for problem in report.problems} == {"unlabelled": 1, "missing": 1}
    assert report.problems[0].listed[0].text() == "row 4: no a"


def test_nested_items_tell_rows_apart_but_are_not_crossed() -> None:
    items = {"a0": ("i1", "i2"), "a1": ("i3", "i4")}
    rows = [(p, a, i, 1.0 + n) for p in ("P1", "P2") for a, names in items.items() for n, i in enumerate(names)]
    table = pd.DataFrame(rows, columns=["participant", "a", "item", "value"])
    assert check_design(table, cells=["a"], nested=["item"]).ok
    assert not check_design(table, cells=["a"]).ok
    twice = pd.concat([table, table.iloc[[0]]])
    problem = check_design(twice, cells=["a"], nested=["item"]).of("duplicate")
    assert problem is not None and problem.listed[0].cell == {"a": "a0", "item": "i1"}


def test_a_table_without_rows_is_not_complete() -> None:
    report = check_design(full().iloc[:0], cells=["a", "b"])
    assert not report.ok
    assert report.problems[0].kind == "no_rows"


def test_levels_need_not_be_text() -> None:
    table = full()
    table["b"] = [int(level[1:]) for level in table["b"]]
    missing = check_design(table.drop(index=[7]), cells=["a", "b"]).of("missing")
    assert missing is not None and missing.listed[0].text() == "P1, a a0, b 1"


def test_columns_that_are_no_factors_are_refused_before_memory_is_gone() -> None:
    table = pd.DataFrame({"participant": ["P1"] * 3000, "a": range(3000), "b": range(3000), "value": 1.0})
    with pytest.raises(DataRefused, match=r"cross to 9,000,000 cells.* 'a' has 3,000 levels: is it a factor"):
        check_design(table, cells=["a", "b"])


def test_values_need_not_be_numbers_to_be_named() -> None:
    table = full().astype({"value": object})
    table.loc[2, "value"] = "soft"
    table.loc[3, "value"] = np.float64("inf")
    problem = check_design(table, cells=["a", "b"], scale=Scale(0, 10)).of("non_finite")
    assert problem is not None and problem.count == 2


@pytest.mark.parametrize("column", ["a", "value", "participant"])
def test_a_missing_column_is_refused_by_name(column: str) -> None:
    with pytest.raises(DataRefused, match=f"no column '{column}'"):
        check_design(full().drop(columns=[column]), cells=["a", "b"])
