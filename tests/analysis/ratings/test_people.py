"""Answers about oneself and sessions as columns of a plan: what is answered, left out, or refused."""

from pathlib import Path

import pytest

from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import AnalysisPlan, Plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.power.simulated_studies import people, simulated_material
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.people import people_of
from palpate.analysis.regenerating.plan_check import answers_of_study
from palpate.analysis.regenerating.regeneration import run_tests
from palpate.protocols.study import Study
from palpate.protocols.yaml_text import load
from palpate.studies.participants.lab_forms import lab_forms

LAB = Path("no lab")
STUDY = Study.model_validate(
    {
        "study": "two",
        "task": "slider_rating",
        "participants": {"sessions": 2},
        "opening": ["demographics"],
        "questions": ["age", "gender"],
        "closing": ["questionnaire"],
        "questionnaire": {"items": [{"name": "ease", "text": "It was easy."}], "points": 3},
        "stimuli": [{"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "dose": str(n // 2)}} for n in range(6)],
        "groups": {"glove": {"cloth": ["x", "y"]}, "bare": {"cloth": ["x", "y"]}},
        "attributes": [["Soft", "Hard"], ["Cold", "Warm"]],
        "scale": {"from": 0, "to": 100},
        "order": {"design": "williams"},
        "simulation": {"latents": {"Soft": {"dose": 12}}, "noise_sd": 8, "bias_sd": 5},
    }
)
COLUMNS = (
    "participant",
    "session",
    "group",
    "stimulus",
    "cloth",
    "dose",
    "attribute",
    "trial",
    "age",
    "gender",
    "ease",
)


@pytest.fixture(scope="module")
def material():
    return simulated_material(STUDY, LAB, people(24), 3)


def plan_of(*tests, **declared):
    requests = tuple(
        TESTS[one["test"]].settings.model_validate({"name": f"t{n}", **one}) for n, one in enumerate(tests)
    )
    plan = AnalysisPlan.model_validate({"study": "two", "draws": 100, **declared})
    return Plan(Path("analysis.yaml"), "", plan, requests, (), load(b"a: 1", "analysis.yaml"))


def answered(material, *tests, **declared):
    plan = plan_of(*tests, **declared)
    return run_tests(Selector(apply_exclusions(material, plan.declared).material, plan))


def declarations():
    """Every column in every place of the kinds that a group, a session or an answer about oneself may stand in."""
    for name in COLUMNS:
        for test in ("pairs", "wilcoxon", "friedman", "nemenyi"):
            yield {"test": test, "factor": name}
        for test in ("anova", "aligned_ranks"):
            yield from ({"test": test, "within": (name,)}, {"test": test, "between": (name,)})
            yield {"test": test, "within": ("session",), "between": (name,)}
        yield {"test": "anova", "within": (name,), "where": {"session": "1"}}
        yield {"test": "anova", "within": ("cloth", name)}
        yield {"test": "means", "by": (name,)}
        yield {"test": "likert", "by": name}
        yield {"test": "icc", "targets": "stimulus", "raters": name}
        yield {"test": "icc", "targets": name}
    yield {"test": "mixed_model", "fixed": ("session", "gender"), "numeric": ("age",)}
    of_forms = {"source": "forms", "outcomes": ("ease",)}
    yield {"test": "ordinal_model", "numeric": ("age",), "random": "participant", **of_forms}
    yield from ({"test": test} for test in ("retest", "raters", "cronbach_alpha"))
    yield {"test": "icc", "where": {"session": "2", "gender": ("F", "M")}}


def test_what_the_check_calls_in_order_is_never_refused_for_its_declaration(material):
    known = answers_of_study(STUDY, lab_forms(STUDY, LAB, live=False).questions)
    in_order = []
    for number, one in enumerate(declarations()):
        outcomes = {} if one["test"] in ("likert", "cronbach_alpha") or "attribute" in str(one) else ("Soft",)
        try:
            whole = {"name": f"t{number}", **({"outcomes": outcomes} if outcomes else {}), **one}
            request = TESTS[one["test"]].settings.model_validate(whole)
        except ValueError:
            continue
        if not list(known.problems(request)):
            in_order.append(whole)
    assert len(in_order) > 40
    results = answered(material, *in_order, least_people=1)
    shown = [
        (result.settings.model_dump(exclude_defaults=True), result.refused)
        for result in results
        if result.answer is None
    ]
    assert not shown, "\n".join(str(one)[:300] for one in shown)


def test_sessions_groups_and_answers_cross_in_one_analysis(material):
    [result] = answered(material, {"test": "anova", "within": ["session"], "between": ["group"], "outcomes": ["Soft"]})
    assert [(row["effect"], row["df1"], row["df2"]) for row in result.answer.rows] == [
        ("group", 1, 22), ("session", 1, 22), ("group:session", 1, 22)]  # fmt: skip


def test_a_small_group_is_refused_unless_requested(material):
    gender = {"test": "anova", "between": ["gender"], "outcomes": ["Soft"]}
    sizes = {
        level: sum(gender_answer == level for gender_answer in material.people.answers["gender"].values())
        for level in "FMX"
    }
    [result] = answered(material, gender, least_people=min(sizes.values()) + 1)
    assert result.answer is None and f"{min(sizes.values())} of the participants have gender" in result.refused
    assert answered(material, gender, least_people=min(sizes.values()))[0].answer is not None


def test_who_did_not_answer_is_named(material):
    answered_gender = {who: level for who, level in material.people.answers["gender"].items() if who != "P003"}
    object.__setattr__(
        material, "people", people_of([]).__class__({**material.people.answers, "gender": answered_gender})
    )
    gender = {"test": "anova", "between": ["gender"], "outcomes": ["Soft"]}
    [refused] = answered(material, gender, least_people=1)
    assert "no answer to gender from P003" in refused.refused
    [result] = answered(material, {**gender, "missing": "listwise"}, least_people=1)
    assert result.answer.participants == 23 and "P003" in result.missing.text()


def test_answers_about_oneself_leave_people_out_and_free_text_never_groups(material):
    left = apply_exclusions(material, plan_of(exclusions=[{"where": {"gender": "F"}, "because": "x"}]).declared)
    excluded = {who for who, level in material.people.answers["gender"].items() if level == "F"}
    assert set(left.material.participants) == set(material.participants) - excluded
    row = {"session": "two/P001/1", "participant": "P001", "item": "why", "kind": "text", "value": "x", "number": None}
    with pytest.raises(DataRefused, match="own words"):
        people_of([row]).named(material.trials, ["why"])


def test_the_last_answer_of_a_person_counts():
    rows = [
        {
            "session": f"two/P001/{n}",
            "participant": "P001",
            "item": "age",
            "kind": "number",
            "value": str(a),
            "number": a,
        }
        for n, a in ((10, 41.0), (2, 40.0))
    ]
    assert people_of(rows).answers == {"age": {"P001": "41"}}
