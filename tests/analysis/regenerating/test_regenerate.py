"""From recorded sessions to files: the same bytes twice, gaps handled as declared, mistakes named."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from palpate.analysis.regenerating.commands import regenerate
from palpate.analysis.regenerating.regeneration import digest
from tests.test_recorded import HERE

PLAN = """
study: doors_small
exclusions: []
tests:
  - {name: variants, test: anova, within: [variant]}
  - {name: all, test: anova, within: [car, variant]}
  - {name: pairs, test: pairs, factor: variant, correction: holm}
  - {name: model, test: mixed_model, fixed: [variant], random: {participant: []}}
  - {name: means, test: means, by: [variant]}
figures:
  - {name: means, figure: means, by: [variant]}
"""


def make_lab(folder):
    shutil.copytree(HERE / "sessions", folder / "sessions")
    shutil.copytree(HERE / "doors_small", folder / "studies" / "doors_small")
    (folder / "studies" / "doors_small" / "analysis.yaml").write_text(PLAN)
    return folder


@pytest.fixture
def lab(tmp_path):
    return make_lab(tmp_path / "lab")


@pytest.fixture(scope="module")
def done_lab(tmp_path_factory):
    """A lab whose plan was regenerated with figures: to be read only."""
    folder = make_lab(tmp_path_factory.mktemp("regenerated") / "lab")
    done = run(folder)
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture
def copied_lab(done_lab, tmp_path):
    """A copy of it, to be changed."""
    return Path(shutil.copytree(done_lab, tmp_path / "lab"))


def change(lab, before, after):
    plan = lab / "studies" / "doors_small" / "analysis.yaml"
    text = plan.read_text()
    assert before in text
    plan.write_text(text.replace(before, after, 1))


def run(lab, *more):
    return CliRunner().invoke(regenerate, ["doors_small", "--lab", str(lab), "--no-crosscheck", *more])


def statistics(lab):
    return json.loads((lab / "regenerated" / "doors_small" / "statistics.json").read_text())


def stored_answer(lab, name, outcome=None):
    return next(
        t for t in statistics(lab)["tests"] if t["name"] == name and (outcome is None or t["outcome"] == outcome)
    )


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_everything_is_written_and_every_number_says_what_it_is(done_lab):
    lab, files = done_lab, contents(done_lab / "regenerated" / "doors_small")
    for name in (
        *("statistics.json", "report.html", "tables.docx", "tables.tex", "tests/variants.csv", "tables/ratings.csv"),
        *("tables/trials.csv", "tables/exclusions.csv", "figures/means.svg", "figures/means.png", "figures/means.csv"),
    ):
        assert files[name], name
    answer = stored_answer(lab, "variants", "Damped")
    assert answer["participants"] == 12 and answer["refused"] is None
    assert len(answer["inputs_sha256"]) == 64 and answer["method"] and answer["seconds"] >= 0
    numbers = {key for row in answer["results"] for key, value in row.items() if isinstance(value, float)}
    assert numbers <= set(answer["kinds"]), numbers - set(answer["kinds"])
    crossed = {row["effect"]: row["F"] for row in stored_answer(lab, "all", "Damped")["results"]}
    assert crossed == {source: pytest.approx(expected_f("Damped", source), rel=1e-9) for source in crossed}
    assert {exclusion["what"] for exclusion in statistics(lab)["exclusions"]} == {"practice"}
    assert len(statistics(lab)["inputs"]) == 1 + 12 + 1


def expected_f(attribute, source):
    """F of the crossed test as pingouin 0.7.0 gave it (tests/recorded/README.md)."""
    return json.loads((HERE / "expected" / "statistics.json").read_text())[attribute][source]["F"]


def test_another_process_writes_the_same_bytes(done_lab, tmp_path):
    code = "import sys; from palpate.analysis.regenerating.commands import regenerate; regenerate(sys.argv[1:])"
    to = str(tmp_path / "again")
    command = [sys.executable, "-c", code, "doors_small", "--lab", str(done_lab), "--to", to, "--no-crosscheck"]
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "PYTHONHASHSEED": "7"})
    assert contents(tmp_path / "again") == contents(done_lab / "regenerated" / "doors_small")


def test_check_says_equal_or_names_what_differs(copied_lab):
    lab = copied_lab
    assert run(lab, "--check").exit_code == 0
    table = lab / "regenerated" / "doors_small" / "tables" / "ratings.csv"
    table.write_text(table.read_text().replace("-5.0", "-5.5", 1))
    done = run(lab, "--check")
    assert done.exit_code == 1
    assert "tables/ratings.csv: line " in done.output and "differs from" in done.output


@pytest.mark.long
def test_a_test_that_left_the_plan_leaves_no_table_behind(copied_lab):
    lab = copied_lab
    change(lab, "  - {name: pairs, test: pairs, factor: variant, correction: holm}\n", "")
    run(lab, "--no-figures")
    assert "tests/pairs.csv" not in contents(lab / "regenerated" / "doors_small")


def test_the_same_number_keeps_its_seconds_and_a_new_one_gets_its_own(copied_lab):
    lab = copied_lab
    file = lab / "regenerated" / "seconds.json"
    known = dict.fromkeys(json.loads(file.read_text()), 1234.0)
    file.write_text(json.dumps(known))
    change(lab, "correction: holm", "correction: bonferroni")
    run(lab, "--no-figures")
    assert stored_answer(lab, "variants")["seconds"] == 1234.0
    assert stored_answer(lab, "pairs")["seconds"] < 100


@pytest.mark.long
def test_other_draws_are_another_question_with_a_time_of_its_own(copied_lab):
    lab = copied_lab
    file = lab / "regenerated" / "seconds.json"
    file.write_text(json.dumps(dict.fromkeys(json.loads(file.read_text()), 1234.0)))
    change(lab, "study: doors_small", "study: doors_small\ndraws: 500")
    run(lab, "--no-figures")
    assert stored_answer(lab, "variants")["seconds"] < 100


@pytest.mark.long
def test_without_figures_no_older_report_stays_behind(copied_lab):
    lab = copied_lab
    mine = lab / "regenerated" / "doors_small" / "figures" / "mine.svg"
    mine.write_text("drawn by hand")
    run(lab, "--no-figures")
    files = contents(lab / "regenerated" / "doors_small")
    assert "report.html" not in files and "figures/means.png" not in files and "figures/mine.svg" in files


def test_a_folder_of_ones_own_is_not_written_over(lab, tmp_path):
    own = tmp_path / "thesis" / "tables.tex"
    own.parent.mkdir()
    own.write_text("mine")
    done = run(lab, "--no-figures", "--to", str(own.parent))
    assert "tables.tex exists" in str(done.exception)
    assert contents(own.parent) == {"tables.tex": b"mine"}


@pytest.mark.long
def test_check_tells_a_report_that_is_gone(copied_lab):
    lab = copied_lab
    (lab / "regenerated" / "doors_small" / "report.html").unlink()
    done = run(lab, "--check")
    assert done.exit_code == 1 and "report.html: the file: committed listed, found not there" in done.output


@pytest.mark.long
@pytest.mark.parametrize("policy", ["refuse", "listwise", "mixed_model"])
def test_a_where_that_takes_other_cells_from_everyone_never_averages_what_is_left(lab, policy):
    """The first trials of a session met other stimuli in each of the orders."""
    first = "where: {trial: ['2', '3', '4']}"
    change(lab, "within: [variant]", f"within: [variant], missing: {policy}, {first}")
    assert run(lab, "--no-figures").exit_code == 0
    answer = stored_answer(lab, "variants", "Damped")
    messages = {
        "refuse": "`where` leaves P001 without",
        "listwise": "nobody is left listwise",
        "mixed_model": "means of different stimuli would be compared",
    }
    assert messages[policy] in answer["refused"] and "results" not in answer


@pytest.mark.long
def test_a_where_on_the_stimulus_keeps_whole_cells(lab):
    change(lab, "within: [variant]", "within: [variant], where: {car: K3, stimulus: [K3_g0, K3_g3, K3_g6]}")
    run(lab, "--no-figures")
    assert stored_answer(lab, "variants", "Damped")["participants"] == 12


def test_a_version_of_a_changed_study_is_chosen_by_its_digest(lab):
    from palpate.studies.commands_sessions import run as run_sessions

    study = lab / "studies" / "doors_small" / "study.yaml"
    study.write_text(study.read_text().replace("Damped", "Muffled"))
    changed = ["doors_small", "--participant", "P021", "--simulate", "--lab", str(lab), "--accept-change"]
    assert not CliRunner().invoke(run_sessions, changed).exception
    message = str(run(lab, "--no-figures").exception)
    assert "was changed between participants" in message
    old = next(part.split()[0] for part in message.replace(":", ",").split(",") if "12 sessions" in part)
    done = run(lab, "--no-figures", "--digest", old)
    assert done.exit_code == 0, done.exception
    assert stored_answer(lab, "variants", "Damped")["participants"] == 12
    assert any("another version" in exclusion["why"] for exclusion in statistics(lab)["exclusions"])
    notes = {version["note"]: version["sha256"] for version in statistics(lab)["versions"]}
    assert set(notes) == {"12 sessions", "1 session, left out"}
    for note, sha256 in notes.items():
        assert f"  study doors_small {sha256[:12]}: {note}" in done.output


def drop_a_cell(lab, policy):
    change(lab, "exclusions: []", "exclusions:\n  - {because: a slip, where: {participant: P003, stimulus: K3_g3}}")
    if policy:
        change(lab, "study: doors_small", f"study: doors_small\nmissing: {policy}")
    return run(lab, "--no-figures")


def group_of(lab, who):
    rows = (lab / "regenerated" / "doors_small" / "tables" / "trials.csv").read_text().splitlines()
    return {line.split(",")[5] for line in rows if line.startswith(who)}


def test_a_missing_cell_is_refused_by_name_unless_the_plan_says_otherwise(lab):
    done = drop_a_cell(lab, None)
    assert done.exit_code == 0
    assert "K3_g3" not in group_of(lab, "P003")
    answer = stored_answer(lab, "variants", "Damped")
    assert "P003 lacks 1 of 6 cells" in answer["refused"] and "results" not in answer
    assert "P003 lacks" in done.output
    assert "P003 lacks 1 of 6 cells" in stored_answer(lab, "model", "Damped")["refused"]


def test_listwise_leaves_the_participant_out_by_name(lab):
    drop_a_cell(lab, "listwise")
    answer = stored_answer(lab, "variants", "Damped")
    assert answer["participants"] == 11
    assert answer["missing"] == {
        "policy": "listwise", "cells": 1, "participants_with_gaps": 1, "left_out": ["P003"],
    }  # fmt: skip
    assert stored_answer(lab, "model", "Damped")["participants"] == 11


@pytest.mark.long
def test_a_mixed_model_answers_on_what_is_there(lab):
    drop_a_cell(lab, "mixed_model")
    for name in ("all", "model"):
        answer = stored_answer(lab, name, "Damped")
        assert answer["participants"] == 12 and "mixed model" in answer["method"].lower()
        assert answer["missing"]["cells"] == 1 and answer["missing"]["left_out"] == []
    for name in ("variants", "means"):
        assert "means of different stimuli would be compared" in stored_answer(lab, name, "Damped")["refused"]
    assert "has no form that takes gaps" in stored_answer(lab, "pairs", "Damped")["refused"]


def test_every_anova_is_within_1e_12_of_exact_fractions(lab):
    done = run(lab, "--no-figures", "--exact")
    assert done.exit_code == 0
    lines = [line for line in done.output.splitlines() if line.startswith("exact: ")]
    assert len(lines) == 3 * (1 + 3)
    assert all("from exact arithmetic" in line for line in lines)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("within: [variant]", "within: [varient]", "line 5: tests[0].within: the study has no column 'varient'; did"),
        ("factor: variant,", "factor: variant, outcomes: [Dampt],", "tests[2].outcomes[0]: no outcome 'Dampt'; did"),
        ("factor: variant,", "factor: variant, where: {car: K33},", "tests[2].where.car: no car 'K33'; did you mean"),
        (
            "exclusions: []",
            "exclusions: [{where: {carr: K3}, because: x}]",
            "exclusions[0].where.carr: the study has no col",
        ),
        (
            "random: {participant: []}",
            "random: {participant: [varient]}",
            "tests[3].random: the study has no column 'vari",
        ),
        ("study: doors_small", "study: doors", "study: found 'doors', the plan of 'doors_small' is expected"),
        ("test: means, by: [variant]", "test: likert", "asks about forms, of which the study has none"),
    ],
)
def test_a_plan_is_held_against_the_study_before_there_are_data(lab, before, after, message):
    shutil.rmtree(lab / "sessions")
    assert run(lab, "--check-plan").exit_code == 0
    change(lab, before, after)
    done = run(lab, "--check-plan")
    assert done.exit_code == 1 and message in str(done.exception), done.exception


def test_without_a_plan_or_without_data_it_says_what_to_do(lab):
    (lab / "studies" / "doors_small" / "analysis.yaml").unlink()
    assert "no analysis plan; write one" in str(run(lab).exception)
    (lab / "studies" / "doors_small" / "analysis.yaml").write_text(PLAN)
    shutil.rmtree(lab / "sessions")
    assert "the lab holds no data yet" in str(run(lab).exception)


def test_a_labs_own_plan_goes_before_the_shipped_one(tmp_path):
    own = tmp_path / "studies" / "texture_similarity"
    own.mkdir(parents=True)
    (own / "analysis.yaml").write_text("study: texture_similarity\ntests: []\n")
    done = CliRunner().invoke(regenerate, ["texture_similarity", "--lab", str(tmp_path), "--check-plan", "--json"])
    assert json.loads(done.output)["tests"] == 0
    (own / "analysis.yaml").unlink()
    done = CliRunner().invoke(regenerate, ["texture_similarity", "--lab", str(tmp_path), "--check-plan", "--json"])
    assert json.loads(done.output)["tests"] > 3


@pytest.mark.parametrize("name", sorted(path.parent.name for path in Path("studies").glob("*/analysis.yaml")))
def test_every_shipped_plan_fits_its_study(tmp_path, name):
    done = CliRunner().invoke(regenerate, [name, "--lab", str(tmp_path), "--check-plan"])
    assert done.exit_code == 0, done.exception


def test_the_hash_of_a_table_of_the_plans_own_covers_every_column():
    table = pd.DataFrame({"session": ["1", "2"], "level": [1.0, 2.0], "correct": [1, 0]})
    assert digest(table, own=True) == digest(table.iloc[::-1, ::-1], own=True)
    assert digest(table, own=True) != digest(table.assign(correct=[0, 0]), own=True)


def test_an_imported_table_is_regenerated_by_the_labs_plan(tmp_path):
    from palpate.analysis.commands import import_

    assert CliRunner().invoke(import_, ["sk2011", "--lab", str(tmp_path)]).exit_code == 0
    plan = tmp_path / "studies" / "sk2011" / "analysis.yaml"
    plan.parent.mkdir(parents=True)
    plan.write_text("study: sk2011\ntests:\n  - {name: two, test: anova, within: [inference, plausibility]}\n")
    done = CliRunner().invoke(regenerate, ["sk2011", "--lab", str(tmp_path), "--no-figures"])
    assert done.exit_code == 0, done.output
    answer = json.loads((tmp_path / "regenerated" / "sk2011" / "statistics.json").read_text())["tests"][0]
    row = next(row for row in answer["results"] if row["effect"] == "inference")
    assert row["F"] == pytest.approx(5.1492441741628365, rel=1e-12)  # R 4.2.2, afex 1.2.1 (analysis/reference)


def test_a_second_opinion_lies_beside_the_statistics_and_is_no_part_of_what_is_compared(lab):
    done = run(lab, "--no-figures", "--crosscheck")
    folder = lab / "regenerated" / "doors_small"
    checks = json.loads((folder / "crosscheck.json").read_text())
    outcomes = len({check["outcome"] for check in checks["checks"]})
    assert [check["test"] for check in checks["checks"]][::outcomes] == ["variants", "all", "pairs", "model"]
    assert checks["disagreements"] == 0 and "DISAGREEMENT" not in done.output
    assert all(check["largest_relative_difference"] < 1e-9 for check in checks["checks"] if not check["not_checked"])
    assert "Second opinion: " in done.output
    (folder / "crosscheck.json").write_text("{}")
    assert run(lab, "--check").exit_code == 0
    assert run(lab, "--no-figures").exit_code == 0
    assert not (folder / "crosscheck.json").exists()


def test_a_disagreement_stands_at_the_head_of_console_and_report(lab, monkeypatch):
    from palpate.analysis.crosschecking import packages

    right = packages.read_pingouin_anova
    monkeypatch.setattr(packages, "read_pingouin_anova", lambda table: {k: 1.01 * v for k, v in right(table).items()})
    change(lab, "  - {name: pairs, test: pairs, factor: variant, correction: holm}\n", "")
    done = run(lab, "--crosscheck")
    assert done.exit_code == 0
    assert (
        "DISAGREEMENT: variants Damped: " in done.output and " differs by 1e-02 of its value (pingouin " in done.output
    )
    page = (lab / "regenerated" / "doors_small" / "report.html").read_text()
    assert page.index("Another package disagrees. variants") < page.index("<nav")


def test_questions_refused_for_the_same_reason_are_one_line(lab):
    for path in sorted((lab / "sessions").iterdir())[1:]:
        path.unlink()
    lines = run(lab, "--no-figures").output.splitlines()
    assert "  not answered: variants (3), all (3), pairs (3): one participant, 'P001'; " in "\n".join(lines)
    reasons = [line.rpartition("): ")[2] for line in lines if line.startswith("  not answered: ")]
    assert reasons and len(reasons) == len(set(reasons))
