"""Tables that a form brings of its own are asked about by their names: rankings and fields, as choices are."""

from pathlib import Path

import pandas as pd
import pytest

from palpate.analysis.plans.idle import idle_settings
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import AnalysisPlan, Plan, Rule
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.plans.study_tables import study_tables
from palpate.analysis.power.simulated_studies import people, simulated_material
from palpate.analysis.regenerating.plan_check import answers_of_study
from palpate.analysis.regenerating.regeneration import run_tests
from palpate.protocols.study import Study
from palpate.protocols.yaml_text import load

PAPERS = {"P1": ("coarse", 60), "P2": ("coarse", 120), "F1": ("fine", 240), "F2": ("fine", 400)}
RANKED = Study.model_validate({
    "study": "ranked", "task": "ranking", "attributes": [{"low": "smooth", "high": "rough"}],
    "stimuli": [{"id": name, "columns": {"paper": kind, "grit": str(grit)}} for name, (kind, grit) in PAPERS.items()],
    "order": {"design": "random", "repeats": 2}, "practice": {"stimuli": ["P1", "F2"]},
    "navigation": "back_and_forward", "questionnaire": {"items": [{"name": "ease", "text": "Easy."}], "points": 5},
    "closing": ["questionnaire"],
    "simulation": {"latents": {"smooth": {"grit": -4.0}}, "noise_sd": 1.0, "revise_rate": 0.3},
})  # fmt: skip
ASKED = Study.model_validate({
    "study": "asked", "task": "intervals", "stimuli": [{"id": "a", "columns": {"level_db": "0"}}],
    "order": {"design": "random"}, "intervals": {"seconds": 0.5},
    "procedure": {"kind": "constant", "level": {"column": "level_db", "values": [-6, 0]}, "repeats": 4},
    "ask": [{"name": "which", "kind": "choice", "of": "intervals"},
            {"name": "rough", "kind": "scale", "from": 0, "to": 100}],
    "simulation": {"observer": {"threshold": -3, "slope": 2, "scale": "db"}},
})  # fmt: skip


@pytest.fixture(scope="module")
def material():
    return simulated_material(RANKED, Path("no lab"), people(4), 1)


def request(**settings):
    return TESTS[settings["test"]].settings.model_validate({"name": "t", **settings})


def answers(material, *requests, tables=None):
    declared = AnalysisPlan.model_validate({"study": material.name, "tables": dict.fromkeys(tables or (), "t.csv")})
    file = Plan(Path("analysis.yaml"), "", declared, requests, (), load(b"a: 1", "analysis.yaml"))
    return run_tests(Selector(material, file, tables or {}))


def test_rows_are_those_that_count_without_practice_typed_and_with_their_stimulus(material):
    table = material.own["rankings"]
    assert len(table) == 4 * 2 * 4  # people, repeats, stimuli: no practice, and of a revised order the last
    assert (table["rank"].dtype, table["grit"].tolist()) == ("int64", [str(PAPERS[s][1]) for s in table["stimulus"]])
    assert set(table["group"]) == {""} and set(table["session_number"]) == {1}
    assert [line.rows for line in material.exclusions if line.what == "practice"] == [2] * 4


@pytest.mark.parametrize("study", [RANKED, ASKED], ids=lambda study: study.study)
def test_the_check_knows_the_columns_and_their_types_before_there_are_data(study):
    own = simulated_material(study, Path("no lab"), people(2), 1).own
    known = study_tables(study, ())
    assert own and set(own) <= set(known)
    for name, table in own.items():
        assert set(table.columns) == {column for column, of in known[name].items() if not of.about_people}
        assert all(table[column].dtype.kind in "if" for column, of in known[name].items() if of.plain)


@pytest.mark.parametrize(
    "settings",
    [
        {"test": "kendall_w", "value": "rank"},
        {"test": "friedman", "factor": "stimulus", "value": "rank"},
        {"test": "icc", "value": "rank", "targets": "grit"},
        {"test": "means", "by": ["paper"], "value": "position", "where": {"rank": {"from": 2}}},
    ],
)
def test_a_test_takes_it_as_it_takes_a_table_of_the_plan_s_own(material, settings):
    plain = material.own["rankings"].drop(columns=["session", "seq"])
    tables = {"mine": plain.assign(value=plain[settings["value"]])}
    own, other = answers(
        material, request(source="rankings", **settings), request(table="mine", **settings), tables=tables
    )
    assert own.answer is not None, own.refused
    assert own.answer.rows == other.answer.rows and own.answer.headline == other.answer.headline


def test_a_table_beside_the_choices_has_the_stimulus_of_its_trial():
    material = simulated_material(ASKED, Path("no lab"), people(2), 1)
    assert list(material.own) == ["choices", "fields"]
    assert set(material.own["fields"]["stimulus"]) == {"a"} and len(material.own["fields"]) == 2 * 2 * 4
    [means] = answers(material, request(test="means", source="fields", value="number", by=["question"]))
    assert means.answer.values == 16


def test_rules_leave_out_people_trials_and_trials_by_their_seconds(material):
    [first, *_] = people(4)
    rules = [{"participants": [first]}, {"where": {"trial": {"from": 3}}}]
    declared = AnalysisPlan(study="ranked", exclusions=[{"because": "so", **rule} for rule in rules])
    table = apply_exclusions(material, declared).material.own["rankings"]
    assert first not in set(table["participant"]) and set(table["trial"]) == {2}
    asked = simulated_material(ASKED, Path("no lab"), people(2), 1)
    limit = float(asked.choices["rt_s"].median())
    slow = AnalysisPlan(study="asked", exclusions=[{"because": "so", "slower_than_s": limit}])
    left = apply_exclusions(asked, slow).material.own
    assert left["choices"]["rt_s"].max() <= limit and len(left["fields"]) == len(left["choices"]) < 16


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"test": "kendall_w", "source": "ranking"}, "about ranking, of which the study has none; it has forms, rank"),
        ({"test": "friedman", "factor": "stimulus"}, "the table 'rankings' has no column 'value'"),
        ({"test": "friedman", "factor": "stimulus", "value": "paper"}, "'paper' holds words, not numbers"),
        ({"test": "friedman", "factor": "grid", "value": "rank"}, "the table 'rankings' has no column 'grid'"),
        ({"test": "friedman", "factor": "rank", "value": "rank"}, "'rank' has a place in this test already"),
        ({"test": "relevance", "threshold": 0.5, "normalisation": "share_of_trials"}, "it takes words, and no ran"),
        ({"test": "kendall_w", "value": "rank", "where": {"paper": "silk"}}, "no paper 'silk'"),
    ],
)  # fmt: skip
def test_the_check_names_what_is_wrong(settings, message):
    [problem, *_] = answers_of_study(RANKED, ()).problems(request(**{"source": "rankings", **settings}))
    assert message in problem.message


def test_a_rule_about_times_needs_a_column_of_times():
    rule = Rule(because="so", faster_than_s=0.2)
    assert [*answers_of_study(ASKED, ()).problems_of_rule(rule)] == []
    assert [p.path for p in answers_of_study(RANKED, ()).problems_of_rule(rule)] == [("faster_than_s",)]


def test_settings_without_effect_on_such_a_table_are_named():
    of_table = request(test="friedman", source="rankings", factor="stimulus", outcomes=["smooth"], normalise="to_0_100")
    assert {setting.name for setting in idle_settings(of_table, TESTS["friedman"])} == {"outcomes", "normalise"}
    of_ratings = request(test="friedman", factor="stimulus", value="rank")
    assert [setting.name for setting in idle_settings(of_ratings, TESTS["friedman"])] == ["value"]


def test_the_digest_of_its_rows_covers_every_column(material):
    [result] = answers(material, request(test="kendall_w", source="rankings", value="rank"))
    changed = pd.concat([material.own["rankings"].iloc[1:], material.own["rankings"].iloc[:1].assign(position=9)])
    [other] = answers(
        type(material)(**{**vars(material), "own": {"rankings": changed}}),
        request(test="kendall_w", source="rankings", value="rank"),
    )
    assert other.answer.rows == result.answer.rows and other.inputs != result.inputs
