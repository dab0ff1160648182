"""Labels that a reader takes for one and the program for two are noted, and counted things have their plural."""

from __future__ import annotations

from pathlib import Path

import pytest

from palpate.analysis.ratings.design import check_ratings
from palpate.analysis.ratings.design_report import Place, Problem
from tests.analysis.ratings_for_tests import small_ratings
from tests.analysis.tables_for_tests import imported


@pytest.mark.parametrize(
    ("one", "other"),
    [("01", "1"), ("1", "1.0"), ("1.0", "1.00"), ("e\u0301", "\xe9"), ("P1", "P01"), ("p1", "P1"), ("1,5", "1.50"),
     ("K 3", "K  3"), ("\uff11", "1"), ("+2", "2")],
)  # fmt: skip
def test_labels_that_look_alike_are_noted(one: str, other: str) -> None:
    for rows, column in (
        ([(person, "Soft", "x", 1.0) for person in (one, other)], "participant"),
        ([("P", "Soft", level, 1.0) for level in (one, other)], "level"),
        ([("P", attribute, "x", 1.0) for attribute in (one, other)], "attribute"),
    ):
        note = check_ratings(small_ratings(rows)).of("lookalike")
        assert note is not None and note.count == 1
        assert note.listed[0].text() == f"{column}: " + " and ".join(ascii(label) for label in sorted((one, other)))
        assert check_ratings(small_ratings(rows)).ok or column == "participant"


@pytest.mark.parametrize(
    ("one", "other"), [("1", "10"), ("g2", "g20"), ("0", "00a"), ("1.01", "1.1"), ("a", "\xe1"), ("-1", "1"), ("", "0")]
)
def test_labels_that_differ_are_not(one: str, other: str) -> None:
    rows = [(person, "Soft", level, 1.0) for person in (one, other) for level in (one, other)]
    assert check_ratings(small_ratings(rows)).of("lookalike") is None


def test_an_import_with_two_spellings_of_a_participant_has_the_note(tmp_path: Path) -> None:
    text = "who,item,car,score\n01,soft,K3,1\n01,soft,K8,2\n1,soft,K3,3\n1,soft,K8,4\n"
    report = check_ratings(imported(tmp_path, text))
    assert [note.text() for note in report.notes] == [
        "1 set of labels that look alike and count as different:\n  participant: '01' and '1'"
    ]
    assert report.ok


@pytest.mark.parametrize(
    ("kind", "one", "two"),
    [
        ("missing", "1 missing cell", "2 missing cells"),
        ("duplicate", "1 cell filled more often than planned", "2 cells filled more often than planned"),
        ("non_finite", "1 value that is not a finite number", "2 values that are not finite numbers"),
        ("constant_rater", "1 participant who gave one value", "2 participants who gave one value"),
    ],
)
def test_one_is_not_written_as_many(kind: str, one: str, two: str) -> None:
    place = Place("P1")
    assert Problem(kind, 1, (place,)).text().startswith(one)  # type: ignore[arg-type]
    assert Problem(kind, 2, (place,)).text().startswith(two)  # type: ignore[arg-type]
