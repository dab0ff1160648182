"""What `--check-plan` calls in order is refused for its answers only, never for its declaration.

For each kind of test, every setting that names columns gets every column of the study in turn (and one that does not
exist), and every column gets levels and ranges in `where`. Answers of simulated people, two days of two groups, say
what running does; the type of the error tells a wrong declaration from answers that are not enough. `regenerate` makes
the same check before it reads an answer, so what the check refuses is refused by both.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from palpate.analysis.plans.answers import COLUMNS, READ, TERMS
from palpate.analysis.plans.idle import effective
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import AnalysisPlan, Plan, Rule
from palpate.analysis.plans.selecting import Selector
from palpate.analysis.plans.study_tables import TRIALS, study_tables
from palpate.analysis.power.simulated_studies import people, simulated_material
from palpate.analysis.ratings.dataset import NoRows
from palpate.analysis.ratings.design import CellsRefused
from palpate.analysis.regenerating.plan_check import answers_of_study
from palpate.analysis.regenerating.regeneration import run_tests
from palpate.analysis.statistics.refusals import (
    IncompleteCells,
    NoEstimate,
    NoResidual,
    NotConverged,
    NotIdentified,
    RankDeficient,
    Separated,
    TooFew,
)
from palpate.protocols.study import Study
from palpate.protocols.yaml_text import load
from palpate.studies.participants.lab_forms import lab_forms

LAB = Path("no lab")
DOCS = Path(__file__).resolve().parents[3] / "docs" / "reference"
OF_ANSWERS = (
    NoRows, TooFew, CellsRefused, IncompleteCells, RankDeficient, NotIdentified, NoResidual, NoEstimate, Separated,
    NotConverged,
)  # fmt: skip
"""The errors of answers that are not enough; every other one is about the declaration."""
COMMON = {
    "opening": ["demographics"], "questions": ["age", "gender"], "participants": {"sessions": 2},
    "groups": {"bare": {"cloth": ["x", "y"]}, "glove": {"cloth": ["x", "y"]}},
}  # fmt: skip
RATED = Study.model_validate({
    **COMMON, "study": "rated", "task": "slider_rating", "closing": ["questionnaire"],
    "order": {"design": "random", "within": "block", "blocks": {"by": "cloth"}},
    "questionnaire": {"items": [{"name": "ease", "text": "Easy."}, {"name": "fun", "text": "Fun."}], "points": 5},
    "stimuli": [
        {"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "dose": str(n // 2), "wish": str(20 + 10 * n),
                                    "of": ("Soft", "Cold")[n % 2], "same": "k"}}
        for n in range(6)
    ],
    "attributes": [
        {"low": "Soft", "high": "Hard", "category": "physical"},
        {"low": "Cold", "high": "Warm", "category": "physical"},
        {"low": "Calm", "high": "Tense", "category": "emotional"},
    ],
    "scale": {"from": 0, "to": 100},
    "simulation": {"latents": {"Soft": {"dose": 12}, "Calm": {"dose": 7}}, "noise_sd": 8, "bias_sd": 5, "gain_sd": 0.2},
})  # fmt: skip
TICKED = Study.model_validate({
    **COMMON, "study": "ticked", "task": "adjective_selection", "order": {"design": "random"},
    "stimuli": [{"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "dose": str(n)}} for n in range(4)],
    "adjectives": {"words": ["Soft", "Hard", "Warm", "Cold"], "order": "random"},
    "simulation": {"latents": {"Soft": {"intercept": 1, "dose": -1}, "Hard": {"dose": 1}}},
})  # fmt: skip
CHOSEN = Study.model_validate({
    **COMMON, "study": "chosen", "task": "intervals", "order": {"design": "random"},
    "stimuli": [{"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "dose": str(n)}} for n in range(2)],
    "intervals": {"design": "forced_choice"}, "ask": [{"name": "chosen", "kind": "choice", "of": "intervals"}],
    "procedure": {"kind": "constant", "level": {"column": "level_db", "values": [-20, -14, -8, -2]}, "repeats": 4},
    "simulation": {"observer": {"threshold": -11, "slope": 3, "guess": 0.5, "lapse": 0.02, "scale": "db"}},
})  # fmt: skip
DETECTED = Study.model_validate({
    **CHOSEN.model_dump(mode="json", exclude_unset=True), "study": "detected",
    "intervals": {"design": "yes_no", "catch": {"absent": {"every": 4}}},
    "ask": [{"name": "felt", "kind": "choice", "of": "intervals"}],
    "simulation": {"observer": {"threshold": -11, "threshold_sd": 4, "slope": 3, "guess": 0.1, "lapse": 0.02,
                                "scale": "db"}},
})  # fmt: skip
QUESTPLUS = {
    "kind": "questplus", "level": {"column": "level_db", "from": -20, "to": -2, "points": 10}, "stop": {"trials": 24},
    "model": {"shape": "logistic", "scale": "linear", "threshold": {"from": -20, "to": -2, "points": 10},
              "slope": [0.2, 0.6, 1], "lapse": [0, 0.02], "guess": [0.1, 0.2]},
}  # fmt: skip
MIXED = Study.model_validate({
    **DETECTED.model_dump(mode="json", exclude_unset=True, by_alias=True), "study": "mixed",
    "procedure": [{"name": "grid", **CHOSEN.model_dump(mode="json", exclude_unset=True)["procedure"][0]},
                  {"name": "fast", **QUESTPLUS}],
})  # fmt: skip
WIDE = Study.model_validate({
    **CHOSEN.model_dump(mode="json", exclude_unset=True), "study": "wide", "procedure": {
        **QUESTPLUS, "level": [QUESTPLUS["level"], {"column": "wide", "values": [0, 1]}],
        "model": {**QUESTPLUS["model"], "guess": 0.5, "gradient": [0, 1]}},
})  # fmt: skip
PAIRED = Study.model_validate({
    **COMMON, "study": "paired", "task": "intervals", "order": {"design": "random", "repeats": 2},
    "stimuli": [{"id": f"s{n}", "columns": {"cloth": "x", "dose": str(n)}} for n in range(3)],
    "groups": {"bare": {"cloth": ["x"]}, "glove": {"cloth": ["x"]}},
    "intervals": {"seconds": 1.0}, "pairs": {"orders": "one"},
    "ask": [{"name": "softer", "kind": "choice", "of": "intervals"}],
    "simulation": {"latents": {"softer": {"dose": 1}}, "noise_sd": 1.2},
})  # fmt: skip
WRITTEN = Study.model_validate({
    **COMMON, "study": "written", "task": "free_lexicon", "order": {"design": "random"}, "lexicon": {"at_least": 1},
    "stimuli": [{"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "dose": str(n)}} for n in range(4)],
    "simulation": {"latents": {}, "vocabulary": ["soft", "hard", "warm", "cold"], "answer_s": 8},
})  # fmt: skip
NUMBERED = Study.model_validate({
    **COMMON, "study": "numbered", "task": "questions", "order": {"design": "random"},
    "stimuli": [{"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "dose": str(n + 1)}} for n in range(4)],
    "ask": [{"name": "strength", "kind": "number", "above": 0}],
    "simulation": {"latents": {"strength": {"dose": 0.3}}, "noise_sd": 0.1, "bias_sd": 0.3},
})  # fmt: skip
STUDIES = {
    "power_law": NUMBERED,
    "bradley_terry": PAIRED, "thurstone": PAIRED, "lexicon": WRITTEN, "binomial_mixed_model": DETECTED,
    "ratings": RATED, "forms": RATED, "words": TICKED, "choices": CHOSEN,
}  # fmt: skip
SOFT = {"outcomes": ["Soft"]}
DIFFER = {"random": "intercept_and_condition", "nodes": 1}
FAST = {"interval": "none", "source": "choices"}
TWO = {"outcomes": ["Soft", "Calm", "Cold"]}
MAP = {**TWO, "method": "classical"}
SHARES = {"normalisation": "share_of_trials", "threshold": 0.6}
TRIED: dict[str, list[dict[str, Any]]] = {
    "anova": [{**SOFT, "within": ["session"], "between": ["group"]}], "pairs": [{**SOFT, "factor": "session"}],
    "equivalence": [{**SOFT, "factor": "session", "bounds": [-50, 50]}],
    "mixed_model": [{**SOFT, "fixed": ["session", "group"], "interactions": ["session:group"]}],
    "friedman": [{**SOFT, "factor": "session"}], "cochran": [{**SOFT, "factor": "session", "yes": 50}],
    "nemenyi": [{**SOFT, "factor": "session"}], "wilcoxon": [{**SOFT, "factor": "session"}],
    "aligned_ranks": [{**SOFT, "within": ["session"], "between": ["group"]}],
    "ordinal_model": [{"source": "forms", "outcomes": ["ease"], "fixed": ["session"], "random": "participant"}],
    "likert": [{}, {"by": "session"}], "icc": [SOFT], "cronbach_alpha": [{}, {"cases": ["stimulus"]}],
    "kendall_w": [{**SOFT, "p": "chi2"}], "krippendorff_alpha": [{**SOFT, "level": "interval"}], "retest": [SOFT],
    "raters": [SOFT], "relevance": [{**SHARES, "draws": 100}], "word_agreement": [{}],
    "adjective_pairs": [{**SHARES, "antonyms": [["Soft", "Hard"]]}], "means": [{**SOFT, "by": ["session"]}],
    "trends": [{"families": "cloth", "pooled": "stimulus"}], "categories": [{"by": ["dose"]}],
    "target_error": [{"target": "wish", "attribute_column": "of"}], "dprime": [{}],
    "lexicon": [{}], "bradley_terry": [{"source": "choices"}], "thurstone": [{"source": "choices"}],
    "psychometric": [FAST], "pca": [{**TWO, "draws": 19}], "mds": [{"replications": 0, **MAP}],
    "procrustes": [{**TWO, "draws": 19}], "vectors": [{**TWO, "draws": 19, "on": "classical"}],
    "binomial_mixed_model": [{**DIFFER, "condition": "track"}], "power_law": [{"intensity": "dose"}],
}  # fmt: skip
"""The tests that are tried, by kind."""
BARE = {"anova", "icc", "likert", "trends", "retest", "relevance"}
"""The kinds that the bare run tries, one of each family; the full run tries all."""
PEOPLE = {"psychometric": 2}
"""The number of people where it is not eight: a function is of one person, and takes a search of its own."""
TRIED_COLUMNS = (
    "session", "session_number", "group", "block", "trial", "stimulus", "participant", "attribute", "cloth", "dose",
    "same", "age", "gender", "ease", "answer.age", "value", "word", "track", "cloth:session", "nowhere",
)  # fmt: skip
CONDITIONS = ("1", ["1", "2"], {"from": 1, "to": 2})


@pytest.fixture(scope="module")
def material():
    materials: dict[str, Any] = {}

    def of(study: Study, count: int = 8) -> Any:
        name = f"{study.study} {count}"
        if name not in materials:
            materials[name] = simulated_material(study, LAB, people(count), 3)
        return materials[name]

    return of


def known(study: Study) -> Any:
    return answers_of_study(study, lab_forms(study, LAB, live=False).questions)


def declarations(kind: str) -> Iterator[dict[str, Any]]:
    """The tests of a kind with another column in each of their places, and with conditions on every column."""
    settings = TESTS[kind].settings
    for base in TRIED[kind]:
        yield base
        for key in (*COLUMNS, *TERMS, *READ):
            if key in settings.model_fields and key not in settings.not_columns:
                for column in TRIED_COLUMNS:
                    yield from ({**base, key: value} for value in (column, [column], ["session", column]))
                yield {**base, key: ["cloth", "cloth"]}
        for column in TRIED_COLUMNS:
            yield from ({**base, "where": {column: condition}} for condition in CONDITIONS)
        yield from ({**base, "outcomes": outcomes} for outcomes in (["Soft"], ["nothing"]))
        yield from ({**base, "source": source} for source in ("ratings", "words", "forms", "choices"))


def requests(kind: str) -> Iterator[Any]:
    for one in declarations(kind):
        try:
            yield TESTS[kind].settings.model_validate({"name": "t", "test": kind, **one})
        except ValidationError:
            continue  # reading the plan refuses it


def kinds() -> Iterator[Any]:
    for kind in TESTS:
        yield pytest.param(kind, marks=[] if kind in BARE else [pytest.mark.long])


@pytest.mark.parametrize("kind", list(kinds()))
def test_what_the_check_calls_in_order_is_refused_for_its_answers_only(kind, material):
    takes = TRIED[kind][0].get("source", TESTS[kind].takes)
    study = STUDIES.get(kind) or STUDIES[takes]
    plan = AnalysisPlan.model_validate({"study": study.study, "draws": 100, "least_people": 1})
    tried = [(request, list(known(study).problems(request))) for request in requests(kind)]
    # Those that differ only in settings without effect are one test.
    same = {effective(request, TESTS[kind]).model_dump_json(): request for request, problems in tried if not problems}
    in_order = list(same.values())
    assert in_order and len(in_order) < len(tried)
    file = Plan(Path("analysis.yaml"), "", plan, tuple(in_order), (), load(b"a: 1", "analysis.yaml"))
    results = run_tests(Selector(material(study, PEOPLE.get(kind, 8)), file))
    wrong = [
        (result.settings.model_dump(exclude_defaults=True), result.refused)
        for result in results
        if result.reason is not None and not issubclass(result.reason, OF_ANSWERS)
    ]
    assert not wrong, "\n".join(str(one)[:300] for one in wrong)
    assert any(result.answer is not None for result in results)


@pytest.mark.parametrize("study", [RATED, TICKED, WRITTEN, CHOSEN, DETECTED, PAIRED], ids=lambda study: study.study)
def test_the_columns_that_the_check_knows_are_those_of_the_answers(study, material):
    answers = material(study)
    of_items = answers.forms[answers.forms["form"] == "likert"]
    actual = {TRIALS: answers.trials, "words": answers.words, "forms": of_items, **answers.own}
    if answers.ratings is not None:
        actual["ratings"] = answers.ratings.table
    questions = lab_forms(study, LAB, live=False).questions
    for name, columns in study_tables(study, questions).items():
        if name == "fields" and name not in actual:
            continue  # these studies ask nothing beside the intervals
        own = {column: is_of for column, is_of in columns.items() if not is_of.about_people}
        assert set(own) == set(actual[name].columns), name
        for column, expected in own.items():
            levels = set(answers.people.added(actual[name], (column,))[column].dropna().astype(str))
            assert not expected.levels or levels <= set(expected.levels), (name, column)
            assert not expected.plain or actual[name][column].dtype.kind in "if", (name, column)


@pytest.mark.parametrize(
    ("test", "message"),
    [
        ({"test": "anova", "within": ["session_number"]}, "no column 'session_number'; did you mean 'session'?"),
        ({"test": "anova", "within": ["cloth:session"]}, "no column 'cloth:session'"),
        ({"test": "anova", "within": ["cloth"], "where": {"word": "x"}}, "no column 'word'"),
        ({"test": "anova", "within": ["cloth"], "where": {"trial": "x"}}, "'trial' holds numbers, and 'x' is none"),
        ({"test": "anova", "within": ["cloth"], "where": {"attribute": "Sofd"}}, "no attribute 'Sofd'; did you mean"),
        ({"test": "anova", "within": ["cloth"], "source": "words"}, "it takes ratings, and no words"),
        ({"test": "aligned_ranks", "within": ["cloth", "cloth"]}, "'cloth' has a place in this test already"),
        ({"test": "icc", "value": "dose"}, "'dose' holds words, not numbers"),
        ({"test": "trends", "families": "cloth", "pooled": "dose"}, "dose 0 has several levels of 'cloth'"),
        ({"test": "retest", "where": {"session": "1"}}, "nobody meets a stimulus twice"),
        ({"test": "mixed_model", "fixed": ["cloth"], "interactions": ["cloth:dose"]}, "an interaction is of two"),
        ({"test": "mds", "pairs": ["cloth", "dose"]}, "`pairs` needs one outcome"),
        ({"test": "mds", "dimensions": 6}, "a map of 6 levels of 'stimulus' has 5 dimensions at most"),
        ({"test": "vectors", "on": "pca", "outcomes": ["Soft"]}, "by 1 of 'attribute' has 1 dimension at most"),
        ({"test": "pca", "over": "attribute"}, "'attribute' has a place in this test already"),
        ({"test": "relevance", **SHARES}, "asks about words, of which the study has none"),
    ],
)  # fmt: skip
def test_a_wrong_declaration_is_named(test, message):
    [problem, *_] = known(RATED).problems(TESTS[test["test"]].settings.model_validate({"name": "t", **test}))
    assert message in problem.message


@pytest.mark.parametrize(
    ("study", "test", "settings", "message"),
    [
        (CHOSEN, "binomial_mixed_model", {}, "the study's design is forced_choice: a forced choice has a guess rate"),
        (DETECTED, "binomial_mixed_model", {**DIFFER, "condition": "block"}, "'block' has 1 level here"),
        (DETECTED, "binomial_mixed_model", {**DIFFER, "condition": "group"}, "'group' differs by group"),
        (DETECTED, "binomial_mixed_model", {**DIFFER, "condition": "trial"}, "'trial' is known from answers only"),
        (DETECTED, "binomial_mixed_model", {**DIFFER, "condition": "session"}, ""),
        (CHOSEN, "psychometric", {**FAST, "guess": 0.3}, "the design of these choices decides `guess`"),
        (MIXED, "psychometric", {**FAST, "by": ["participant"]}, "several values of procedure (constant, questplus)"),
        (MIXED, "psychometric", {"source": "choices", "prior": "declared_model", "by": ["procedure", "cloth"]}, ""),
        (MIXED, "psychometric", {"source": "choices", "prior": "declared_model", "where": {"procedure": "questplus"},
                                 "by": ["participant"]}, ""),
        (MIXED, "binomial_mixed_model", {}, "several values of procedure (constant, questplus)"),
        (MIXED, "binomial_mixed_model", {"where": {"procedure": "constant"}}, ""),
        (WIDE, "psychometric", FAST, "the levels have two dimensions"),
    ],
)  # fmt: skip
def test_what_a_design_contradicts_is_named_by_the_check_and_refused_where_it_runs(
    study, test, settings, message, material
):
    request = TESTS[test].settings.model_validate({"name": "t", "test": test, **settings})
    assert [message in problem.message for problem in known(study).problems(request)] == [True] * bool(message)
    plan = AnalysisPlan.model_validate({"study": study.study, "draws": 100, "least_people": 1})
    file = Plan(Path("analysis.yaml"), "", plan, (request,), (), load(b"a: 1", "analysis.yaml"))
    [result] = run_tests(Selector(material(study), file))
    if message:
        assert result.refused
    else:
        assert result.reason is None or issubclass(result.reason, OF_ANSWERS), result.refused


def test_a_rule_about_response_times_needs_ratings_or_choices():
    rule = Rule(because="so", faster_than_s=0.2)
    assert [*known(RATED).problems_of_rule(rule)] == [*known(CHOSEN).problems_of_rule(rule)] == []
    [problem] = known(TICKED).problems_of_rule(rule)
    assert problem.path == ("faster_than_s",) and "no response times" in problem.message
    [problem] = known(CHOSEN).problems_of_rule(Rule(because="so", flagged=1))
    assert problem.message == "is about ratings, of which the study has none"


def test_a_number_in_a_condition_is_compared_as_a_number(material):
    """A truth or a level of choices is a number, in whatever way a plan writes it."""
    tests = [{"name": f"t{n}", "test": "dprime", "where": {"level": level}} for n, level in enumerate((-2, "-2.0"))]
    requests = tuple(TESTS["dprime"].settings.model_validate(test) for test in tests)
    plan = AnalysisPlan.model_validate({"study": "chosen"})
    file = Plan(Path("analysis.yaml"), "", plan, requests, (), load(b"a: 1", "analysis.yaml"))
    one, other = run_tests(Selector(material(CHOSEN), file))
    assert one.answer.values == other.answer.values == 8 * 2 * 2 * 4  # people, sessions, tracks, repeats


def test_the_example_of_sessions_groups_and_blocks_is_in_order_and_answered(material):
    page = (DOCS / "analysis-plan.md").read_text("utf-8").split("groups and blocks as factors")[1]
    example = page.split("```yaml\n")[1].split("```")[0]
    tests = load(example.encode(), "analysis-plan.md").data["tests"]
    requests = tuple(TESTS[test["test"]].settings.model_validate(test) for test in tests)
    assert [list(known(RATED).problems(request)) for request in requests] == [[]] * 7
    plan = AnalysisPlan.model_validate({"study": "rated"})
    file = Plan(Path("analysis.yaml"), "", plan, requests, (), load(b"a: 1", "analysis.yaml"))
    results = run_tests(Selector(material(RATED), file))
    assert not [(result.settings.name, result.refused) for result in results if result.answer is None]
    effects = [row["effect"] for result in results[:1] for row in result.answer.rows]
    assert effects == ["group", "session", "group:session"]
