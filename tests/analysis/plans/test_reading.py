"""A plan is read strictly: every complaint names file, line, place and the nearest valid name."""

import pytest

from palpate.analysis.plans import kinds
from palpate.analysis.plans.reading import PlanError, read_plan
from palpate.protocols.yaml_text import YamlError


@pytest.fixture
def plan(tmp_path):
    def written(text):
        (tmp_path / "analysis.yaml").write_text(text)
        return read_plan(tmp_path / "analysis.yaml")

    return written


GOOD = """
study: doors
missing: listwise
exclusions:
  - {participants: [P003], because: fell asleep}
tests:
  - {name: variants, test: anova, within: [variant]}
  - {name: means, test: means, by: [variant]}
figures:
  - {name: means, figure: means, by: [variant]}
"""


def test_a_good_plan_holds_each_test_by_its_own_schema(plan):
    parsed = plan(GOOD)
    assert [(test.name, test.test) for test in parsed.tests] == [("variants", "anova"), ("means", "means")]
    assert parsed.tests[0].within == ("variant",)
    assert parsed.figures[0].figure == "means"
    assert len(parsed.sha256) == 64


@pytest.mark.parametrize(
    ("before", "after", "mentioned"),
    [
        ("study: doors", "studdy: doors", ["line 2: studdy: unknown key", "did you mean 'study'"]),
        ("missing: listwise", "missing: listwize", ["line 3: missing", "did you mean 'listwise'"]),
        ("because: fell asleep", "", ["line 5: exclusions[0].because", "required"]),
        ("participants: [P003], ", "", ["line 5: exclusions[0]", "exactly one of participants"]),
        ("test: anova", "test: anovva", ["line 7: tests[0].test", "did you mean 'anova'"]),
        ("test: anova, ", "", ["line 7: tests[0]: no key 'test'"]),
        ("within: [variant]", "witin: [variant]", ["line 7: tests[0].witin: unknown key", "'within'"]),
        ("name: means, test", "name: variants, test", ["line 8: tests[1].name", "appears twice"]),
        ("name: variants", "name: ../variants", ["line 7: tests[0].name", "letters, digits"]),
        ("figure: means, by", "figure: meens, by", ["line 10: figures[0].figure", "did you mean 'means'"]),
        ("figure: means,", "figure: means, tests: [varants],", ["line 10: figures[0].tests[0]", "'variants'"]),
        ("by: [variant]", "by: [variant], table: mine", ["line 8: tests[1].table", "no table 'mine'"]),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_line_and_the_nearest_name(plan, before, after, mentioned):
    assert before in GOOD
    with pytest.raises(PlanError) as error:
        plan(GOOD.replace(before, after, 1))
    message = str(error.value)
    assert "analysis.yaml: " in message
    for words in mentioned:
        assert words in message, message


def test_several_mistakes_are_reported_together(plan):
    with pytest.raises(PlanError) as error:
        plan(GOOD.replace("test: anova", "test: anovva").replace("figure: means, by", "figure: meens, by"))
    assert len(str(error.value).splitlines()) == 2


def test_a_table_must_lie_beside_the_plan(plan, tmp_path):
    (tmp_path / "words.csv").write_text("word,antonym\n")
    assert plan(f"{GOOD}\ntables: {{antonyms: words.csv}}").table_path("antonyms").is_file()
    with pytest.raises(PlanError, match="no file 'wrds.csv' beside the plan; did you mean 'words.csv'"):
        plan(f"{GOOD}\ntables: {{antonyms: wrds.csv}}")
    with pytest.raises(PlanError, match="leads out of the plan's folder"):
        plan(f"{GOOD}\ntables: {{antonyms: ../words.csv}}")


def test_what_is_no_plan_is_refused(plan, tmp_path):
    with pytest.raises(PlanError, match="keys and values are expected"):
        plan("- a list")
    with pytest.raises(YamlError, match="twice"):
        plan("study: a\nstudy: b\n")
    with pytest.raises(PlanError, match="cannot be read"):
        read_plan(tmp_path / "nowhere.yaml")


@pytest.mark.parametrize("name", kinds.TESTS)
def test_every_kind_of_test_exists_and_bears_its_name(name):
    kind = kinds.TESTS[name]
    assert kind.settings.model_fields["test"].annotation.__args__ == (name,)


@pytest.mark.parametrize("name", kinds.FIGURES)
def test_every_kind_of_figure_exists_and_bears_its_name(name):
    kind = kinds.FIGURES[name]
    assert kind.settings.model_fields["figure"].annotation.__args__ == (name,)
