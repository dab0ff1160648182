"""Built-in parts keep the contracts of their kinds, and the contracts name what a part does not keep."""

import pytest

from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.regenerating.contract import check_figure, check_test
from palpate.protocols.forms import FORMS
from palpate.protocols.known_tasks import TASKS
from palpate.protocols.needs import NEEDS
from palpate.protocols.simulated_participants import KINDS as PEOPLE
from palpate.studies.catalogue import StudyFiles, read_study
from palpate.studies.extensions.check import check
from palpate.studies.extensions.contract import (
    Session,
    check_form,
    check_need,
    check_participant,
    check_procedure,
    check_task,
    write_sample,
)
from palpate.studies.extensions.templates import write_module
from palpate.studies.procedures.adviser import KINDS as PROCEDURES
from tests.protocols.every_task import PARTS, study_of
from tests.studies.procedures.tracks_for_tests import QUESTPLUS, TWO_DOWN, study

SHORT = {
    "questplus": {**QUESTPLUS, "level": {**QUESTPLUS["level"], "points": 11}, "stop": {"trials": 12}},
    "staircase": {**TWO_DOWN, "stop": {"trials": 24, "reversals": 4}, "last": 4},
    "constant": {"kind": "constant", "level": {**QUESTPLUS["level"], "points": 5}, "repeats": 3},
    "limits": {"kind": "limits", "level": {**QUESTPLUS["level"], "points": 9}, "stop": {"trials": 60, "series": 4}},
}


def failed(verdicts):
    return [str(verdict) for verdict in verdicts if not verdict.ok]


@pytest.mark.needs("fonts")
@pytest.mark.parametrize("task", sorted(set(PARTS) - {"capture", "authoring"}))
def test_built_in_tasks_forms_and_people_keep_the_contracts(task, tmp_path):
    """Capture and authoring need devices: `tests/protocols/simulated_participants/test_kinds.py` has them without."""
    files = [StudyFiles(study_of(task), tmp_path)]
    assert failed(check_task(task, TASKS[task], files, tmp_path)) == []
    for kind in PEOPLE:
        assert failed(check_participant(kind, PEOPLE[kind], files, tmp_path)) == []
    for name in {trial.form.name for trial in Session(files[0], tmp_path).plan.trials}:
        assert failed(check_form(name, FORMS[name], files, tmp_path)) == []


@pytest.mark.parametrize("kind", PROCEDURES)
def test_built_in_procedures_keep_the_contract(kind, tmp_path):
    changes = {"intervals": {"design": "yes_no", "seconds": 0.5}} if kind == "limits" else {}
    files = [StudyFiles(study(SHORT[kind], **changes), tmp_path)]
    assert failed(check_procedure(kind, PROCEDURES[kind], files, tmp_path)) == []


def test_a_built_in_need_keeps_the_contract(tmp_path):
    data = study_of("slider_rating", needs=["skin_temperature"])
    assert (
        failed(check_need("skin_temperature", NEEDS["skin_temperature"], [StudyFiles(data, tmp_path)], tmp_path)) == []
    )


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A study of four stimuli with a plan."""
    lab = tmp_path_factory.mktemp("planned")
    write_module("test", "acme.spread", lab)
    folder = lab / "studies" / "acme_spread"
    plan = "study: acme_spread\ntests: [{name: a, test: means, by: [stimulus]}]\n"
    plan += "figures: [{name: b, figure: rating_heatmap}]\n"
    (folder / "analysis.yaml").write_text(plan, encoding="utf-8")
    return [read_study(folder / "study.yaml")], write_sample


def test_a_built_in_test_and_figure_keep_the_contract(planned):
    assert failed(check_test("means", TESTS["means"], *planned)) == []
    assert failed(check_figure("rating_heatmap", FIGURES["rating_heatmap"], *planned)) == []


WRONG = [
    ("task", "yield Present(trial)", 'yield type("Buzz", (), {"body": lambda _: {"do": "buzz"}})()',
     "by requests that there are", "it yields Buzz; one of Present"),
    ("task", 'answers="ratings"', 'answers="words"', "in the table that it names", "no answer lies there"),
    ("task", "range(TIMES)", "range(CALLS.append(0) or len(CALLS))", "goes on as if", "cut after event"),
    ("form", "return Reply({\"answers\": answers", "return Reply({\"answers\": {}", "comes to its end", "ReplyError"),
    ("form", "if not isinstance(answers, dict) or", "if", "garbage is refused", "TypeError"),
    ("form", '"agreement": answers', '"agrees": answers', "declared columns", "a row lacks agreement"),
    ("form", '"agreement": answers[item.name]', '"agreement": "3"', "declared columns", "agreement is '3', not whole"),
    ("form", "likert:LikertScreen", "likert:NoScreen", "its screen can be drawn", "AttributeError"),
    ("form", 'name: str = "acme.grip"', 'name: str = "sliders"', "comes to its end", "Error"),
    ("procedure", "min(max(index", "max(max(index", "in the grid", "0 to 10"),
    ("procedure", "if len(past) >= self.track.trials:", "if False:", "ends at the cap", "no end after 20 trials"),
    ("procedure", "if not past:", "if len(CALLS) % 3 == CALLS.append(0):", "in the grid", "IndexError"),
    ("procedure", "Estimate(sum(levels) / len(levels))", 'Estimate(float("nan"))', "finite or an", "is not finite"),
    ("participant", "(scale.low + scale.high) / 2", "CALLS.append(0) or len(CALLS)", "equal requests get", "once and"),
    ("participant", "(scale.low + scale.high) / 2", "1e9", "answers every request", "ReplyError"),
    ("need", 'Taken("acme_grip", 20.0)', 'Taken("skin_temperature", 20.0)', "names of their own", "skin_temperature"),
    ("need", '"acme.grip": Taken', '"acme.grop": Taken', "kinds of devices that exist", "did you mean 'acme.grip'"),
    ("test", "class NothingToCompare(ValueError)", "NothingToCompare = ValueError\nclass No(ValueError)",
     "named ValueError",
     "an error with a name"),
    ("test", "if len(means) < 2:", "if False:", "named ValueError", ""),
    ("test", '"spread": spread,', '"spread": spread + len(CALLS) + bool(CALLS.append(0)),',
     "twice the same", "another"),
    ("figure", "return DrawnFigure(figure)", "return None", "is drawn from it", "AttributeError"),
    ("figure", 'figure: Literal["acme.grip"]', "figure: str", "refuses what it does not know", "are taken"),
]  # fmt: skip


@pytest.mark.needs("fonts")
@pytest.mark.parametrize(
    ("kind", "text", "instead", "demand", "problem"),
    WRONG,
    ids=[f"{wrong[0]}: {wrong[3]} {n}" for n, wrong in enumerate(WRONG)],
)
def test_what_a_part_does_not_keep_is_named(kind, text, instead, demand, problem, tmp_path):
    write_module(kind, "acme.grip", tmp_path)
    (tmp_path / "lab.yaml").write_text("extensions: true\n", encoding="utf-8")
    module = tmp_path / "extensions" / "acme" / "__init__.py"
    whole = module.read_text(encoding="utf-8")
    assert whole.count(text) >= 1
    broken = whole.replace(text, instead).splitlines(keepends=True)
    place = next(n for n, line in enumerate(broken) if line.startswith(("class ", "@dataclass", "def ", "NEED =")))
    module.write_text("".join([*broken[:place], "CALLS = []\n", *broken[place:]]), encoding="utf-8")
    problems = [verdict.problem for verdict in check("acme", tmp_path) if demand in verdict.demand]
    assert any(problems) and any(problem in found for found in problems), problems
