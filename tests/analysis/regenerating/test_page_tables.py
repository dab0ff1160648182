"""Answers as tables: the digits that mean something, a dash that says why, columns under names that people know."""

from palpate.analysis.plans.answers import Answer, MissingSummary, QuestionResult, StatisticSettings
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.regenerating import page as shown
from palpate.analysis.reports.tables import HEADINGS, heading


def answered(outcome, rows, name="levels", test="anova", refused="", **more):
    answer = None if refused else Answer(tuple(rows), "A method", {"F": "F of the effect"}, 8, 32, **more)
    return QuestionResult(
        StatisticSettings(name=name, test=test), outcome, answer, refused, "", MissingSummary("refuse"), 0.0
    )


def test_outcomes_of_several_rows_have_headings_and_those_of_one_a_column():
    one = [answered(name, [{"effect": "x", "F": 2.0}]) for name in ("Soft", "Hard")]
    assert [row[0] for row in shown.test_table(one).rows] == ["Soft", "Hard"]
    two = [answered(name, [{"effect": "x", "F": 2.0}, {"effect": "y", "F": 1.0}]) for name in ("Soft", "Hard")]
    table = shown.test_table(two)
    assert dict(table.groups) == {0: "Soft", 2: "Hard"} and len(table.rows) == 4
    assert [head.name for head in table.heads] == ["effect", "F"]


def test_a_refused_outcome_keeps_its_place_with_the_reason():
    table = shown.test_table(
        [answered("Soft", [{"effect": "x", "F": 2.0}]), answered("Hard", [], refused="too few people")]
    )
    assert table.rows == (("Soft", "x", "2.00"), ("Hard", "", "– ¹"))
    assert table.notes == ("¹ Not answered: too few people",)
    alone = shown.test_table([answered("", [], refused="too few people")])
    assert alone.rows and any("too few people" in note for note in alone.notes)


def test_columns_say_what_they_are():
    table = shown.test_table([answered("", [{"effect": "x", "F": 2.0, "partial_eta_squared": 0.5}])])
    assert [(head.name, head.column, head.meaning) for head in table.legend] == [("F", "F", "F of the effect")]
    assert heading("partial_eta_squared") == "η²p" and heading("pc12") == "component 12"
    assert heading("some_other_name") == "some other name"
    assert all("_" not in shown for shown in HEADINGS.values())


def test_every_kind_of_test_has_a_name_in_words():
    assert len({kind.title for kind in TESTS.values()}) == len(TESTS)
    assert (
        shown.test_title([answered("", [], name="variant_pairs", test="pairs")])
        == "Variant pairs: pairwise comparisons"
    )


def test_a_note_of_some_outcomes_names_them():
    both = [answered("Soft", [{"F": 1.0}], notes=("all", "own")), answered("Hard", [{"F": 1.0}], notes=("all",))]
    assert shown.notes_of(both) == ("all", "Soft: own")
