"""The reference names every kind of test and figure, and every setting that a kind has."""

import re
from pathlib import Path

import pytest

from palpate.analysis.figures.figure_kind import FigureSettings
from palpate.analysis.plans import kinds
from palpate.analysis.plans.answers import StatisticSettings
from palpate.analysis.plans.reading import AnalysisPlan, Rule

DOCS = Path(__file__).resolve().parents[3] / "docs" / "reference"
PLAN = (DOCS / "analysis-plan.md").read_text(encoding="utf-8")
FIGURES = (DOCS / "figures.md").read_text(encoding="utf-8")


def own(settings, common):
    return set(settings.model_fields) - set(common.model_fields)


@pytest.mark.parametrize("name", kinds.TESTS)
def test_every_setting_of_every_kind_of_test_is_in_its_row(name):
    row = next(line for line in PLAN.splitlines() if line.startswith(f"| `{name}` |") and ".md)" in line)
    named = set(re.findall(r"`(\w+)`", row.split("|")[2]))
    assert named == own(kinds.TESTS[name].settings, StatisticSettings)
    page = re.search(r"\]\((\S+\.md)\)", row)[1]
    assert (DOCS / page).is_file()


@pytest.mark.parametrize("name", kinds.FIGURES)
def test_every_kind_of_figure_has_its_section_with_its_settings_and_a_picture(name):
    sections = re.split(r"^## ", FIGURES, flags=re.M)
    section = next(section for section in sections if section.split("\n", 1)[0].strip().strip("`").startswith(name))
    for setting in own(kinds.FIGURES[name].settings, FigureSettings):
        assert f"`{setting}`" in section, setting
    picture = re.search(r"\]\(\.\./(pictures/\S+\.png)\)", section)
    assert picture and (DOCS.parent / picture[1]).is_file()


@pytest.mark.parametrize("key", [*AnalysisPlan.model_fields, *Rule.model_fields])
def test_every_key_of_a_plan_is_in_the_reference(key):
    assert re.search(rf"\b{key}\b", PLAN)
