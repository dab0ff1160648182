"""The tables of the report, cell by cell: every number is different, so that none can stand for another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from palpate.analysis.first_look import page_data
from palpate.analysis.first_look.analysis import Analysis, analyse_ratings
from palpate.analysis.first_look.page import page_of, stimulus_table
from palpate.analysis.first_look.page_tests import comparisons, question_words, variance_tables
from palpate.analysis.first_look.study_statistics import Question, Row, StudyStatistics, study_statistics
from palpate.analysis.first_look.study_statistics import Test as Answer
from palpate.analysis.ratings.dataset import Exclusion
from palpate.analysis.reports.page import Folded
from palpate.analysis.reports.tables import Table
from palpate.analysis.statistics.anova import anova
from tests.analysis.synthetic_ratings import door_ratings, reasoning

EFFECT: Row = {
    "Source": "car:variant", "SS": 101.5, "SS_error": 77.25, "MS": 33.8, "ddof1": 4, "ddof2": 20, "F": 6.57,
    "p_unc": 0.0015, "p_GG_corr": 0.0123, "p_HF_corr": 0.0044, "eps": 0.5, "eps_HF": 0.75, "np2": 0.568, "ng2": 0.233,
    "note": "",
}  # fmt: skip
PAIR: Row = {
    "Contrast": "family", "A": "bump", "B": "plateau", "Paired": True, "mean_diff": 1.25, "ci_low": 0.5,
    "ci_high": 2.75, "T": 3.5, "dof": 11.0, "p_unc": 0.0049, "p_bonferroni": 0.147, "p_holm": 0.049, "dz": 1.01,
    "note": "",
}  # fmt: skip
GROUPS: Row = {
    "Source": "group", "SS": 12.25, "SS_error": 88.5, "MS": 12.25, "ddof1": 2, "ddof2": 17, "F": 1.18,
    "p_unc": 0.331, "np2": 0.122, "eta2": 0.122, "note": "",
}  # fmt: skip


def page_with(question: Question, *rows: Row, per_cell: tuple[int, int] = (1, 1), people: int = 12) -> Analysis:
    """The analysis of real ratings with hand-made tests in the place of the computed ones."""
    analysis = analyse_ratings(reasoning(people=4))
    test = Answer(question, "rating", people, rows, per_cell)
    return replace(analysis, statistics=StudyStatistics((question,), (test,)))


def cells(shown: Table) -> list[dict[str, str]]:
    """The rows of a table by the names of its columns."""
    names = [column.name for column in shown.heads]
    assert len(set(names)) == len(names)
    return [dict(zip(names, row, strict=True)) for row in shown.rows]


def test_an_effect_within_participants_stands_in_its_columns() -> None:
    (analysis,) = variance_tables(page_with(Question("crossed", ("car", "variant")), EFFECT))
    assert cells(analysis.table) == [
        {
            "attribute": "rating", "effect": "car × variant", "SS": "101.50", "SS error": "77.25", "F": "6.57",
            "df": "2, 10", "p": ".012", "ε (GG)": ".500", "p uncorrected": ".002", "ε (HF)": ".750", "p (HF)": ".004",
            "partial η²": ".568", "generalized η²": ".233",
        }
    ]  # fmt: skip
    assert analysis.sentences == (
        "rating, car × variant: F(2, 10) = 6.57, p = .012, η²p = .57 (Greenhouse–Geisser, ε = .50)",
    )


def test_an_effect_of_one_df_has_nothing_to_correct() -> None:
    one = {**EFFECT, "ddof1": 1, "ddof2": 5, "eps": 1.0, "eps_HF": 1.0}
    (analysis,) = variance_tables(page_with(Question("pooled", ("variant",)), one))
    (row,) = cells(analysis.table)
    corrected = ("ε (GG)", "ε (HF)", "p (HF)")
    assert (row["df"], row["p"], row["p uncorrected"]) == ("1, 5", ".002", ".002")
    assert [row[name] for name in corrected] == ["–", "–", "–"]


def test_an_effect_between_groups_stands_in_its_columns() -> None:
    (analysis,) = variance_tables(page_with(Question("between", ("group",)), GROUPS))
    assert cells(analysis.table) == [
        {
            "attribute": "rating", "effect": "group", "SS": "12.25", "SS error": "88.50", "F": "1.18", "df": "2, 17",
            "p": ".331", "η²": ".122",
        }
    ]  # fmt: skip


def test_a_pair_stands_in_its_columns() -> None:
    (shown,) = comparisons(page_with(Question("pairs", ("family",)), PAIR))
    assert cells(shown.table) == [
        {
            "pair": "bump − plateau", "mean difference": "1.25", "95 % CI": "[0.50, 2.75]", "t": "3.50", "df": "11",
            "p uncorrected": ".005", "p Bonferroni": ".147", "p Holm": ".049", "Cohen's dz": "1.01",
        }
    ]  # fmt: skip
    assert "p = .049 (Holm)" in shown.sentences[0]


def test_pairs_below_the_level_are_counted_by_each_method() -> None:
    rows = [
        {**PAIR, "p_bonferroni": bonferroni, "p_holm": holm}
        for bonferroni, holm in ((0.01, 0.005), (0.0501, 0.049), (0.05, 0.05), (0.9, 0.8), (None, None))
    ]
    (shown,) = comparisons(page_with(Question("pairs", ("family",)), *rows))
    assert shown.summary == "1 of 5 pairs below .05 by Bonferroni, 2 by Holm"


def test_averaged_ratings_are_reported_with_their_number() -> None:
    def participants_text(kind: Any, per_cell: tuple[int, int], over: tuple[str, ...] = ()) -> str:
        question = Question(kind, ("variant",), None, over)
        return question_words(question, [Answer(question, "Soft", 12, (EFFECT,), per_cell)], grouped=False)

    assert participants_text("crossed", (1, 1)) == "12 participants."
    assert (
        participants_text("crossed", (2, 2))
        == "12 participants. Each participant has one value in each cell, the mean of 2 ratings."
    )
    assert participants_text("pooled", (3, 3), ("car",)) == (
        "12 participants. Each participant has one value for each variant, the mean of 3 ratings, over car."
    )
    assert participants_text("between", (30, 45), ("car", "variant")) == (
        "12 participants. Each participant has one value, the mean of 30 to 45 ratings, over car and variant."
    )


def test_the_test_between_groups_is_that_of_participants_means() -> None:
    ratings = door_ratings(people=4, attributes=1)
    means = ratings.table.groupby(["participant", "group"], as_index=False)["value"].mean()
    expected = anova(means, dv="value", between="group").iloc[0]
    test = next(test for test in study_statistics(ratings).tests if test.question.kind == "between")
    (row,) = test.rows
    assert (row["ddof1"], row["ddof2"]) == (1, 6)
    for name in ("SS", "SS_error", "F", "p_unc", "eta2"):
        assert row[name] == pytest.approx(expected[name], rel=1e-9)
    assert test.ratings_per_cell == (45, 45)


def left_out(*lines: Exclusion) -> dict[str, str]:
    return dict(page_data.facts(replace(door_ratings(people=1, attributes=1), exclusions=lines)))


def test_what_was_left_out_is_counted_by_its_kind() -> None:
    lines = (
        Exclusion("session", "P9", "interrupted", 21), Exclusion("session", "P8", "interrupted", 14),
        Exclusion("practice", "P1", "practice", 7), Exclusion("participant", "P7", "incomplete", 300),
        Exclusion("repeated", "P2", "not the first", 2),
    )  # fmt: skip
    facts = left_out(*lines)
    assert facts["Left out"] == (
        "2 sessions (35 ratings), 1 participant (300 ratings), 7 practice ratings, 2 repeated ratings"
    )
    assert "Averaged" not in facts and "Rows without a rating" not in facts
    assert left_out()["Left out"] == "nothing"


def test_averaged_ratings_and_rows_that_are_none_are_not_left_out() -> None:
    facts = left_out(Exclusion("averaged", "3 participants", "", 60, 12), Exclusion("rows", "a.csv", "no loop", 600))
    assert (facts["Left out"], facts["Averaged"], facts["Rows without a rating"]) == ("nothing", "60 into 12", "600")


def test_the_means_of_every_stimulus_are_on_the_page() -> None:
    ratings = door_ratings(people=3, attributes=2)
    shown = cells(stimulus_table(analyse_ratings(ratings)))
    assert len(shown) == 90
    own = ratings.table.query("attribute == 'Damped' and car == 'K8' and variant == 'g7'")["value"]
    row = next(row for row in shown if (row["car"], row["variant"]) == ("K8", "g7"))
    assert row["Damped"] == f"{own.mean():.2f} ({own.std():.2f})".replace("-", "−") and row["n"] == "3"
    figures = page_of(analyse_ratings(ratings)).sections[1]
    assert [block.blocks[0].table for block in figures.blocks if isinstance(block, Folded)] == [
        stimulus_table(analyse_ratings(ratings))
    ]
