"""What qualifies a number goes with it: look-alikes, averages and left-out rows, in every command by one function."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from palpate.analysis.commands import analyse
from palpate.analysis.ratings.dataset import DataRefused, Exclusion, Scale
from palpate.analysis.ratings.design_report import data_notes, exclusion_lines
from palpate.analysis.regenerating.commands import regenerate
from palpate.analysis.reports.csv_files import csv_text, without_formula
from tests.analysis.ratings_for_tests import small_ratings

ALIKE = "1 set of labels that look alike and count as different:\n  participant: '001' and '1'"


def rows(people=("001", "1", "2", "3"), values=range(1, 99)):
    return [(who, "Soft", level, float(value)) for (who, level), value in zip(
        ((who, level) for who in people for level in "abc"), values, strict=False)]  # fmt: skip


@pytest.fixture
def lab(tmp_path):
    from palpate.analysis.ratings.rating_files import save_ratings

    save_ratings(small_ratings(rows()), tmp_path / "imported" / "small")
    (tmp_path / "studies" / "small").mkdir(parents=True)
    plan = "study: small\ntests:\n  - {name: levels, test: anova, within: [level]}\n"
    (tmp_path / "studies" / "small" / "analysis.yaml").write_text(plan)
    return tmp_path


@pytest.mark.parametrize(
    ("command", "more"), [(analyse, ["--no-figures"]), (regenerate, ["--no-figures", "--no-crosscheck"])]
)
def test_look_alike_ids_are_reported_on_the_console_and_as_json(lab, command, more):
    arguments = ["small", "--lab", str(lab), *more]
    assert ALIKE in CliRunner().invoke(command, arguments).output
    output = CliRunner().invoke(command, [*arguments, "--json"]).output
    assert json.loads(output)["notes"] == [ALIKE]


def test_look_alike_ids_are_in_every_file_of_a_regenerated_study_and_beside_a_refusal(lab):
    refused = "\n  - {name: never, test: pairs, factor: level, family: 1}\n"
    with (lab / "studies" / "small" / "analysis.yaml").open("a") as plan:
        plan.write(refused.lstrip("\n"))
    ended = CliRunner().invoke(regenerate, ["small", "--lab", str(lab), "--no-figures", "--no-crosscheck"])
    assert ended.exit_code == 0, ended.output
    [statistics] = lab.rglob("statistics.json")
    content = json.loads(statistics.read_text("utf-8"))
    line = " ".join(ALIKE.split())
    assert content["notes"] == [ALIKE] and content["tests"][1]["refused"].endswith(f" (of the data: {line})")
    assert line in (statistics.parent / "tables.tex").read_text("utf-8").replace(r"\textquotesingle{}", "'")


def test_many_that_say_the_same_are_one_line_and_those_that_differ_are_seen():
    same = [Exclusion("averaged", f"P{n:03d}", "averaged of 2", 2, 1) for n in range(66)]
    other = [Exclusion("averaged", who, "averaged of 3", 3, 1) for who in ("P070", "P071")]
    assert list(exclusion_lines([*same[:9], *other, *same[9:]])) == [
        "averaged of P000 and 65 more (2 each): averaged of 2",
        "averaged of P070 (3): averaged of 3",
        "averaged of P071 (3): averaged of 3",
    ]
    assert data_notes((), [*same, *other]) == (
        "138 repeated ratings averaged into 68 (the exclusion ledger says whose)",
    )


def test_sessions_that_are_averaged_are_noted_where_there_are_several():
    [line] = data_notes((), (), sessions=2)
    assert line.startswith("The answers of each participant's 2 sessions are averaged")
    assert data_notes((), (), sessions=1) == data_notes((), ()) == ()


@pytest.mark.parametrize("scale", [None, Scale(-1e308, 1e308)])
def test_ratings_that_overflow_are_refused(scale):
    with pytest.raises(DataRefused, match=r"of 1e\+308; at most 1e\+100 is expected"):
        replace(small_ratings(rows(values=[1e308, -1e308] * 6)), scale=scale)


@pytest.mark.parametrize("text", ["=HYPERLINK(1)", "@b", "+a", "-a", "\tx", "'=1", "''@"])
def test_a_formula_in_a_cell_is_a_text_and_can_be_had_back(text):
    assert without_formula(text) == f"'{text}"


@pytest.mark.parametrize("text", ["-5", "+3.5", "-1e-3", "a=b", "'quoted'", "", "K3 - K8"])
def test_numbers_and_ordinary_texts_stay_as_they_are(text):
    assert without_formula(text) == text
    assert csv_text([{"x": -0.5, "y": "=1"}]) == "x,y\n-0.5,'=1\n"
