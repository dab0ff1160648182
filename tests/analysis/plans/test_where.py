"""Ranges of numbers in a `where`, and questions that are called as a column of the stimuli."""

import pandas as pd
import pytest

from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import Rule
from palpate.analysis.plans.selecting import apply_exclusions
from palpate.analysis.plans.where import Range, keeps, matching_rows
from palpate.analysis.power.simulated_studies import people, simulated_material
from palpate.analysis.ratings.people import people_of
from palpate.analysis.regenerating.plan_check import answers_of_study
from palpate.protocols.study import Study
from palpate.studies.participants.lab_forms import lab_forms
from tests.analysis.ratings.test_people import LAB, STUDY, answered, plan_of

ANOVA = {"test": "anova", "within": ["cloth"], "outcomes": ["Soft"]}


@pytest.fixture(scope="module")
def material():
    return simulated_material(STUDY, LAB, people(24), 3)


def checked(test, study=STUDY):
    request = TESTS[test["test"]].settings.model_validate({"name": "t", **test})
    known = answers_of_study(study, lab_forms(study, LAB, live=False).questions)
    return [f"{problem.path} {problem.message}" for problem in known.problems(request)]


def in_range(material, low, high):
    return {who for who, age in material.people.answers["age"].items() if low <= float(age) <= high}


def test_a_range_includes_both_ends_and_may_have_one():
    ages = ["17.5", "18", "18.0", "30", "30.5", "nan", "n"]
    assert [age for age in ages if keeps(Range(**{"from": 18, "to": 30}), age)] == ["18", "18.0", "30"]
    assert [age for age in ages if keeps(Range(**{"to": 18}), age)] == ["17.5", "18", "18.0"]
    assert matching_rows(pd.Series([17.0, 18.0, float("nan")]), Range(**{"from": 18})).tolist() == [False, True, False]
    assert str(Range(**{"from": 18, "to": 30.5})) == "from 18 to 30.5"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "from, to or both are expected"),
        ({"from": 30, "to": 18}, r"from \(30\) lies above to \(18\)"),
        ({"form": 18}, "form"),
        ({"from": "18"}, "from"),
        ({"from": float("inf")}, "from"),
    ],
)
def test_a_range_that_says_nothing_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        Rule.model_validate({"because": "x", "where": {"age": given}})


def test_a_test_can_be_restricted_to_people_of_an_age(material):
    ages = sorted(float(age) for age in material.people.answers["age"].values())
    low, high = ages[4], ages[-5]
    [result] = answered(material, {**ANOVA, "where": {"age": {"from": low, "to": high}}})
    assert result.answer.participants == len(in_range(material, low, high)) < 24


def test_a_range_is_one_group_and_still_not_smaller_than_allowed(material):
    ages = sorted(float(age) for age in material.people.answers["age"].values())
    few = {**ANOVA, "where": {"age": {"to": ages[1]}}}
    size = len(in_range(material, 0, ages[1]))
    [refused] = answered(material, few, least_people=size + 1)
    assert f"{size} of the participants have age to {ages[1]:g}" in refused.refused
    assert answered(material, few, least_people=size)[0].answer is not None


def test_a_range_of_a_stimulus_column_keeps_its_stimuli(material):
    [result] = answered(material, {**ANOVA, "within": ["dose"], "where": {"dose": {"from": 1}}})
    [listed] = answered(material, {**ANOVA, "within": ["dose"], "where": {"dose": ["1", "2"]}})
    assert result.answer.rows == listed.answer.rows


def test_people_out_of_a_range_are_left_out(material):
    ages = sorted(float(age) for age in material.people.answers["age"].values())
    rule = {"where": {"age": {"from": ages[3]}}, "because": "too old"}
    left = apply_exclusions(material, plan_of(exclusions=[rule]).declared)
    assert set(left.material.participants) == set(material.participants) - in_range(material, ages[3], 200)
    assert {line.why for line in left.lines} == {"too old"}


def test_a_range_of_words_or_of_nothing_is_refused(material):
    [result] = answered(material, {**ANOVA, "where": {"cloth": {"from": 1}}})
    assert "'cloth' holds words, as 'x'; a range (from 1) asks about numbers" in result.refused
    assert "holds words" in checked({**ANOVA, "where": {"gender": {"from": 1}}})[0]
    assert "holds words" in checked({**ANOVA, "where": {"participant": {"from": 1}}})[0]
    assert checked({**ANOVA, "where": {"dose": {"from": 7}}})[0].endswith("no dose from 7; there are 0, 1, 2")
    assert checked({**ANOVA, "where": {"age": {"from": 18, "to": 30}}}) == []
    [none] = answered(material, {**ANOVA, "where": {"age": {"from": 150}}})
    assert "no rows are left" in none.refused


def test_one_dose_in_a_range_is_no_factor():
    assert "one level here" in checked({**ANOVA, "within": ["dose"], "where": {"dose": {"from": 2}}})[0]


def test_a_question_called_as_a_column_of_the_stimuli_has_a_name_of_its_own(material):
    columns = [{"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "gender": "MF"[n // 3]}} for n in range(6)]
    changed = {**STUDY.model_dump(mode="json", exclude_defaults=True), "stimuli": columns}
    changed |= {"simulation": {"latents": {}}, "scale": {"from": 0, "to": 100}}
    study = Study.model_validate(changed)
    simulated = simulated_material(study, LAB, people(24), 3)
    by = {"test": "anova", "outcomes": ["Soft"]}
    of_stimuli, of_people = answered(
        simulated, {**by, "within": ["gender"]}, {**by, "between": ["answer.gender"]}, least_people=1
    )
    assert [row["df2"] for row in of_stimuli.answer.rows] == [23]
    genders = set(simulated.people.answers["gender"].values())
    assert [(row["df1"], row["df2"]) for row in of_people.answer.rows] == [(len(genders) - 1, 24 - len(genders))]
    assert checked({**by, "within": ["gender"]}, study) == checked({**by, "between": ["answer.gender"]}, study) == []
    assert "the same in all answers" in checked({**by, "within": ["answer.gender"]}, study)[0]


def test_free_text_has_no_column_under_either_name(material):
    row = {"session": "two/P001/1", "participant": "P001", "item": "why", "kind": "text", "value": "x", "number": None}
    with pytest.raises(ValueError, match="own words"):
        people_of([row]).named(material.trials, ["answer.why"])
