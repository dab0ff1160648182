"""The verbs analyse, report and import, from real ledgers and a real table to files."""

from __future__ import annotations

import contextlib
import hashlib
import json
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from palpate.analysis.first_look.compare_reference import (
    SHIPPED,
    Compared,
    compare_with_reference,
    fitting_test,
    read_reference,
)
from palpate.analysis.first_look.study_statistics import study_statistics
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.synthetic_ratings import door_ratings, reasoning
from tests.commands_for_tests import run_command

MAP = SHIPPED.parents[1] / "importing" / "maps" / "sk2011.yaml"
PEOPLE = 4


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four simulated sessions of the door study and the imported table of Singmann and Klauer."""
    folder = tmp_path_factory.mktemp("lab")
    people = f"P001..P{PEOPLE:03d}"
    assert (
        run_command("run", "door_ratings", "--participant", people, "--simulate", "--seed", 1, "--lab", folder)[0] == 0
    )
    assert run_command("import", MAP, "--lab", folder)[0] == 0
    return folder


@pytest.fixture(scope="module")
def analysed(lab: Path) -> dict[str, Any]:
    code, out, _ = run_command("analyse", "door_ratings", "--lab", lab, "--json")
    assert code == 0
    return dict(json.loads(out))


def test_analyse_writes_what_it_says(lab: Path, analysed: dict[str, Any]) -> None:
    files = [Path(name) for name in analysed["files"]]
    assert {path.parent for path in files} == {lab / "analysis" / "door_ratings"}
    assert all(path.stat().st_size > 0 for path in files)
    assert (analysed["participants"], analysed["ratings"]) == (PEOPLE, PEOPLE * 45 * 7)
    assert analysed["simulated"] and analysed["complete"] and len(analysed["headlines"]) == 7


def test_the_inputs_are_the_ledgers_with_their_real_hashes(lab: Path, analysed: dict[str, Any]) -> None:
    data = json.loads((lab / "analysis" / "door_ratings" / "statistics.json").read_text())
    ledgers = {source["name"]: source["sha256"] for source in data["inputs"] if source["name"].endswith(".sqlite")}
    real = {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in (lab / "sessions").glob("*.sqlite")}
    assert ledgers == real and len(real) == PEOPLE
    assert data["title"] == "Opening a car door, rated on seven attributes"


@pytest.mark.long
def test_a_collected_database_gives_the_same_report(lab: Path, tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'all.sqlite'}"
    assert run_command("collect", "--lab", lab, "--to", url)[0] == 0
    for name, source in (("a", ("--lab", lab)), ("b", ("--database", url, "--lab", tmp_path))):
        assert run_command("report", "door_ratings", *source, "--to", tmp_path / f"{name}.html")[0] == 0
    first, second = ((tmp_path / f"{name}.html").read_bytes() for name in "ab")
    assert first == second
    assert b"no person gave these answers" in first


def test_an_interrupted_session_is_left_out_and_the_report_says_so(lab: Path, tmp_path: Path) -> None:
    database = tmp_path / "all.sqlite"
    assert run_command("collect", "--lab", lab, "--to", f"sqlite:///{database}")[0] == 0
    with contextlib.closing(sqlite3.connect(database)) as connection, connection:
        connection.execute(
            "UPDATE sessions SET status = 'interrupted', trials_answered = 44 WHERE participant = 'P004'"
        )
    source = ("--database", f"sqlite:///{database}", "--lab", tmp_path)
    code, out, _ = run_command("report", "door_ratings", *source, "--json")
    assert code == 0
    summary = json.loads(out)
    assert (summary["left_out"], summary["participants"], summary["complete"]) == (1, PEOPLE - 1, True)
    assert "group 2" in " ".join(summary["not_tested"])  # one participant is left in it
    page = Path(summary["files"][0]).read_text()
    assert "interrupted after 44 of 45 trials" in page and "Not tested" in page
    code, out, _ = run_command("analyse", "door_ratings", *source, "--include-incomplete", "--no-figures", "--json")
    assert (code, json.loads(out)["left_out"]) == (0, 0)


def test_analyse_prints_a_summary_a_person_can_use(lab: Path, analysed: dict[str, Any]) -> None:
    code, out, _ = run_command("analyse", "door_ratings", "--lab", lab, "--no-figures")
    assert code == 0
    assert "4 participants, 1,260 ratings" in out and "Simulated participants" in out
    assert "Luxurious – Cheap" in out and "statistics.json" in out
    assert all(
        f"variant: F({headline.split('F(')[1].split(',')[0]}" in out for headline in analysed["headlines"].values()
    )


def test_sk2011_agrees_with_r(lab: Path) -> None:
    code, out, _ = run_command("analyse", "sk2011", "--lab", lab, "--no-figures", "--reference", "r", "--json")
    compared = json.loads(out)["reference"]
    assert code == 0
    assert len(compared) == 10 + 6 + 10
    assert all(row["agrees"] and row["relative_error"] < 1e-12 for row in compared)
    assert {row["number"] for row in compared} == {
        "SS", "SS_error", "F", "p", "GG_eps", "p_GG", "HF_eps_raw", "p_HF", "pes", "ges"
    }  # fmt: skip


def test_a_difference_from_the_reference_is_exit_code_1(lab: Path, tmp_path: Path) -> None:
    entry = json.loads(SHIPPED.read_text())["sk2011_2way"]
    entry["effects"]["plausibility"]["F"] *= 1 + 1e-8
    (tmp_path / "other.json").write_text(json.dumps({"mine": entry}))
    reference = f"{tmp_path / 'other.json'}#mine"
    code, out, _ = run_command("analyse", "sk2011", "--lab", lab, "--no-figures", "--reference", reference)
    assert code == 1
    assert "1.0e-08" in out and "27.42818" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("analyse", "door_rating"), "door_ratings"),
        (("analyse", "nothing_like_it"), "no imported data set"),
        (("report", "sk2O11"), "sk2011"),
        (("analyse", "door_ratings", "--no-figures", "--reference", "r"), "only for sk2011"),
        (("analyse", "sk2011", "--no-figures", "--reference", "missing.json#x"), "missing.json"),
        (("analyse", "door_ratings", "--database", "nonsense"), "nonsense"),
        (("analyse", "door_ratings", "--digest", "ffff"), "versions begin with"),
        (("import", MAP), "exists already"),
        (("import", "no_such_map.yaml"), "no_such_map.yaml"),
    ],
)
def test_a_mistake_is_exit_code_2_and_one_message(lab: Path, arguments: tuple[object, ...], message: str) -> None:
    code, _, err = run_command(*arguments, "--lab", lab)
    assert code == 2
    assert message in err and "Traceback" not in err


def test_an_empty_lab_says_what_to_do(tmp_path: Path) -> None:
    code, _, err = run_command("analyse", "door_ratings", "--lab", tmp_path)
    assert code == 2 and "run a session, import a table" in err


def test_import_lists_what_it_took_and_may_replace(lab: Path) -> None:
    code, out, _ = run_command("import", MAP, "--lab", lab, "--replace", "--json")
    summary = json.loads(out)
    assert code == 0
    assert (summary["participants"], summary["ratings"], summary["left_out"]) == (40, 320, [])
    assert summary["within"] == ["inference", "plausibility"] and summary["between"] == ["instruction"]


def test_help_is_fast_and_imports_no_pandas() -> None:
    script = (
        "import sys, palpate.analysis.commands, palpate.command_line\n"
        "heavy = {'pandas', 'numpy', 'scipy', 'matplotlib', 'sqlalchemy', 'rich', 'jinja2'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_reference_needs_its_effects_and_one_test() -> None:
    tests = study_statistics(reasoning(people=8)).tests
    entry = {"effects": {"inference": {"F": tests[0].rows[0]["F"]}}}
    assert compare_with_reference(fitting_test(tests, entry).rows, entry)[0].relative_error == 0.0
    with pytest.raises(DataRefused, match="did you mean"):
        compare_with_reference(tests[0].rows, {"effects": {"inferences": {"F": 1.0}}})
    with pytest.raises(DataRefused, match="14 tests have the effects variant"):
        fitting_test(
            [t for t in study_statistics(door_ratings(people=2)).tests if t.question.kind == "crossed"],
            {"effects": {"variant": {}}},
        )


def test_an_undefined_number_of_ours_does_not_agree() -> None:
    ratings = reasoning(people=4)
    flat = study_statistics(replace(ratings, table=ratings.table.assign(value=1.0))).tests[0]
    compared = compare_with_reference(flat.rows, {"effects": {"inference": {"F": 2.0}}})
    assert compared == [Compared("inference", "F", None, 2.0, None)] and not compared[0].agrees


@pytest.mark.parametrize("text", ["not json", "[]", '{"other": {}}', '{"k": {"effects": 3}}', '{"k": 1}'])
def test_a_file_that_is_no_reference_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "r.json"
    path.write_text(text)
    with pytest.raises(DataRefused):
        read_reference(f"{path}#k", "sk2011")


def test_no_number_of_the_comparison_is_cut_on_a_narrow_terminal(lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = run_command("analyse", "sk2011", "--lab", lab, "--no-figures", "--reference", "r")
    shown = out[out.index("Beside the reference") : out.index("Written to")]
    assert code == 0 and "…" not in shown and "5.910221424e-06" in shown
    assert max(map(len, shown.splitlines())) <= 80


def test_a_table_without_within_factors_is_reported_on_the_command_line(tmp_path: Path) -> None:
    rows = "".join(f"P{i},{'ab'[i % 2]},{i * i % 7}\n" for i in range(8))
    (tmp_path / "t.csv").write_text(f"who,sex,score\n{rows}")
    columns = "{participant: who, value: score, attribute_is: Soft, between: {sex: sex}}"
    (tmp_path / "map.yaml").write_text(f"name: lone\nfiles: t.csv\ncolumns: {columns}\n")
    assert run_command("import", tmp_path / "map.yaml", "--lab", tmp_path)[0] == 0
    code, out, _ = run_command("report", "lone", "--lab", tmp_path, "--json")
    assert code == 0 and "F(1, 6)" in json.loads(out)["headlines"]["Soft"]
    code, out, _ = run_command("analyse", "lone", "--lab", tmp_path)
    assert code == 0 and "means.svg" not in out and "anova.csv" in out
