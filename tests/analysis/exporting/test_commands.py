"""`palpate export` as a command: mistakes are reported, and so is what was exported."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.analysis.exporting.labs import lab_of
from tests.commands_for_tests import run_command


@pytest.fixture
def lab(tmp_path):
    return lab_of(tmp_path / "lab", "door_lexicon")


@pytest.mark.parametrize(("arguments", "message"), [
    (["--csv", "--bids"], "one of --bids, --psych-ds, --csv, --parquet is expected; found --bids and --csv"),
    ([], "one of --bids, --psych-ds, --csv, --parquet is expected; found none of them"),
    (["--csv", "--missing", "listwise"], "No such option"),
    (["--csv", "--without", "handednes"], "--without handednes: no such column; did you mean 'handedness'?"),
    (["--csv", "--without", "participant"], "--without participant: the tables mean nothing without this column"),
])  # fmt: skip
def test_mistakes_are_reported(lab, tmp_path, arguments, message):
    code, _, errors = run_command("export", "door_lexicon", "--lab", lab, "--to", tmp_path / "out", *arguments)
    assert code == 2 and message in " ".join(errors.split()) and not (tmp_path / "out").exists()


def test_an_unknown_study_names_the_nearest(lab, tmp_path):
    code, _, errors = run_command("export", "door_lexikon", "--lab", lab, "--to", tmp_path / "out", "--csv")
    assert code == 2 and "did you mean 'door_lexicon'?" in errors
    code, _, errors = run_command("export", "x", "--lab", tmp_path / "none", "--to", tmp_path / "out", "--csv")
    assert code == 2 and "no sessions; run one first" in errors


def test_an_imported_table_is_not_ours_to_share(tmp_path):
    (tmp_path / "lab/imported/sk2011").mkdir(parents=True)
    code, _, errors = run_command("export", "sk2011", "--lab", tmp_path / "lab", "--to", tmp_path / "out", "--csv")
    assert code == 2 and "was imported, not recorded here" in errors


@pytest.mark.parametrize(("text", "message"), [
    ('{"Author": ["A"]}', "Author: not a key that a lab can set; did you mean 'Authors'?"),
    ('{"Authors": "A"}', "found 'A', a list of texts is expected"),
    ("{", "this is not JSON"),
])  # fmt: skip
def test_what_the_lab_says_of_its_data_is_checked(lab, tmp_path, text, message):
    (lab / "dataset_description.json").write_text(text)
    code, _, errors = run_command("export", "door_lexicon", "--lab", lab, "--to", tmp_path / "out", "--bids")
    assert code == 2 and message in errors


def test_it_says_what_it_did(lab, tmp_path):
    code, out, _ = run_command("export", "door_lexicon", "--lab", lab, "--to", tmp_path / "out", "--csv", "--json")
    summary = json.loads(out)
    assert code == 0 and (summary["participants"], summary["sessions"], summary["simulated"]) == (1, 1, True)


def test_help_needs_nothing_heavy_and_shows_examples():
    code, out, _ = run_command("export", "--help")
    assert code == 0 and "palpate export door_ratings --lab LAB --to shared/doors --bids" in out
    heavy = "pandas", "numpy", "sqlalchemy", "scipy", "pyarrow"
    script = f"import sys, palpate.analysis.exporting.commands; sys.exit(any(name in sys.modules for name in {heavy}))"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
