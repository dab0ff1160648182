"""Which tests a study gets, on which averages, and what happens to one that cannot be made."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from palpate.analysis.first_look.analysis import analyse_ratings, correction, reported_p
from palpate.analysis.first_look.study_statistics import Question, questions_of, study_statistics
from palpate.analysis.statistics.anova import rm_anova
from palpate.analysis.statistics.pairwise import pairwise_tests
from tests.analysis.synthetic_ratings import door_ratings, reasoning


def test_the_door_study_is_tested_within_groups_over_all_between_them_and_in_pairs() -> None:
    assert questions_of(door_ratings(people=2)) == (
        Question("crossed", ("car", "variant"), ("group", "1")),
        Question("crossed", ("car", "variant"), ("group", "2")),
        Question("pooled", ("variant",), None, ("car",)),
        Question("between", ("group",), None, ("car", "variant")),
        Question("pairs", ("augmentation",), None, ("car", "variant")),
    )


def test_groups_that_felt_the_same_are_tested_together() -> None:
    assert questions_of(reasoning()) == (
        Question("crossed", ("inference", "plausibility")),
        Question("between", ("instruction",), None, ("inference", "plausibility")),
        Question("pairs", ("inference",), None, ("plausibility",)),
        Question("pairs", ("plausibility",), None, ("inference",)),
    )


def test_a_study_without_groups_has_no_test_between_them() -> None:
    ratings = replace(reasoning(), between=(), within=("inference",), pooled="inference")
    assert [question.kind for question in questions_of(ratings)] == ["crossed", "pairs"]


def test_the_pooled_test_is_that_of_participants_means() -> None:
    ratings = door_ratings(people=3, attributes=2)
    statistics = study_statistics(ratings)
    of_attribute = ratings.table[ratings.table["attribute"] == "Damped"]
    means = of_attribute.groupby(["participant", "variant"], as_index=False)["value"].mean()
    expected = rm_anova(means, dv="value", within="variant", subject="participant").iloc[0]
    test = statistics.of(statistics.questions[2])[1]
    assert (test.attribute, test.participants, test.ratings_per_cell) == ("Damped", 6, (3, 3))
    assert test.rows[0]["F"] == pytest.approx(expected["F"], rel=1e-12)
    assert test.rows[0]["p_GG_corr"] == pytest.approx(expected["p_GG_corr"], rel=1e-9)


def test_a_group_is_tested_on_its_own_participants() -> None:
    ratings = door_ratings(people=3, attributes=1)
    own = ratings.table[ratings.table["group"] == "2"]
    expected = rm_anova(own, dv="value", within=["car", "variant"], subject="participant")
    test = study_statistics(ratings).tests[1]
    assert [row["F"] for row in test.rows] == expected["F"].tolist()
    assert test.participants == 3


def test_both_adjustments_stand_beside_the_plain_p() -> None:
    ratings = door_ratings(people=3, attributes=1)
    holm = pairwise_tests(
        ratings.table, "value", within="augmentation", subject="participant", padjust="holm", aggregate="mean"
    )
    rows = study_statistics(ratings).tests[-1].rows
    assert len(rows) == 15
    by_pair = {frozenset((row["A"], row["B"])): row["p_corr"] for row in holm.to_dict("records")}
    assert [row["p_holm"] for row in rows] == [by_pair[frozenset((row["A"], row["B"]))] for row in rows]
    assert [row["p_bonferroni"] for row in rows] == [min(1.0, 15 * row["p_unc"]) for row in rows]
    assert all(row["p_unc"] <= row["p_holm"] <= row["p_bonferroni"] for row in rows)


def test_the_corrected_p_is_reported_wherever_an_effect_has_more_than_one_df() -> None:
    rows = study_statistics(reasoning(people=8)).tests[0].rows
    assert [correction(row) for row in rows] == ["Greenhouse-Geisser", "", "Greenhouse-Geisser"]
    assert [reported_p(row) for row in rows] == [rows[0]["p_GG_corr"], rows[1]["p_unc"], rows[2]["p_GG_corr"]]


def test_a_test_that_cannot_be_made_keeps_its_place_and_says_why() -> None:
    ratings = door_ratings(people=2, attributes=2)
    dropped = (ratings.table["participant"] == "P100") & (ratings.table["car"] == "FORD")
    incomplete = replace(ratings, table=ratings.table[~dropped].reset_index(drop=True))
    analysis = analyse_ratings(incomplete)
    answered = {(test.question.kind, test.question.scope): bool(test.rows) for test in analysis.statistics.tests}
    assert answered == {
        ("crossed", "group 1"): False,
        ("crossed", "group 2"): True,  # the other group is complete
        ("pooled", "all participants"): False,
        ("between", "all participants"): False,
        ("pairs", "all participants"): False,
    }
    assert all(test.rows or "P100" in test.refused for test in analysis.statistics.tests)
    assert not analysis.design.ok


def test_repeated_ratings_are_averaged_only_where_the_study_repeats() -> None:
    ratings = reasoning(people=4)
    twice = replace(ratings, table=pd.concat([ratings.table, ratings.table], ignore_index=True))
    once = study_statistics(twice).tests
    assert all("8 of 8 cells filled more often than planned" in test.refused for test in once)
    assert study_statistics(replace(twice, repeats=2)).tests[0].rows[0]["F"] == pytest.approx(
        study_statistics(ratings).tests[0].rows[0]["F"], rel=1e-9
    )


def test_progress_is_reported_every_step_and_the_end() -> None:
    steps: list[tuple[int, int, str]] = []
    study_statistics(reasoning(), lambda *step: steps.append(step))
    assert [done for done, _, _ in steps] == [0, 1, 2, 3, 4]
    assert steps[0] == (0, 4, "rating: inference x plausibility, all participants")
