"""Sessions with a lab's own parts: what the ledger says of them; missing, changed and broken ones are named."""

import json
import shutil
import sqlite3
from contextlib import closing

import pytest

from palpate.command_line import _status
from palpate.protocols.extensions import finder
from palpate.studies.sessions.record import read
from tests.studies.extensions.labs import STIMULI, STUDY, TASK, add_study, make_lab


@pytest.fixture(scope="module")
def ran_lab(tmp_path_factory):
    """A lab in which one simulated person took part in each study."""
    lab = make_lab(tmp_path_factory.mktemp("extensions") / "lab")
    for study in ("sets", "levels"):
        assert _status(["run", study, "--participant", "P001", "--simulate", "--lab", str(lab)]) == 0
    return lab


@pytest.fixture
def lab(ran_lab, tmp_path):
    return shutil.copytree(ran_lab, tmp_path / "lab")


@pytest.fixture
def run(lab, capsys):
    """Call a command in the lab; its exit code and what it prints."""

    def call(*words):
        capsys.readouterr()
        status = _status([*words, "--lab", str(lab)])
        return status, "".join(capsys.readouterr())

    return call


def header(lab, study, participant="P001"):
    return read(lab / "sessions" / f"{study}_{participant}_s1.sqlite").header


def changed(lab, text="# another line\n"):
    file = lab / "extensions" / "acme.py"
    file.write_text(file.read_text(encoding="utf-8") + text, encoding="utf-8")


def test_a_session_is_run_replayed_and_collected_and_its_first_event_names_the_extension(lab, run):
    assert set(header(lab, "sets")["extensions"]) == {"acme"}
    assert header(lab, "sets")["extensions"]["acme"]["version"] == "1.2"
    assert set(header(lab, "levels")["extensions"]) == {"drawn"}
    assert run("replay", "--recompute")[0] == 0
    assert run("collect")[0] == 0
    with closing(sqlite3.connect(lab / "lab.sqlite")) as database:
        rows = database.execute("SELECT trial, stimulus, counts FROM acme_largest ORDER BY trial").fetchall()
    assert sorted(name for _, name, _ in rows) == ["BBB", "CC"]
    assert [(trial, counts) for trial, _, counts in rows] == [(1, 1), (2, 1)]


def test_a_session_without_own_parts_says_nothing_of_extensions(run, lab):
    assert run("run", "texture_ratings", "--participant", "P001", "--simulate")[0] == 0
    assert "extensions" not in header(lab, "texture_ratings")


def test_without_the_lab_s_word_its_code_is_not_run(lab, run):
    (lab / "lab.yaml").write_text("extensions: false\n", encoding="utf-8")
    (lab / "extensions" / "acme.py").write_text("raise SystemExit('run all the same')", encoding="utf-8")
    status, said = run("check", "sets")
    assert status == 1 and "line 2: task: the extension 'acme' is code in" in said and "`extensions: true`" in said


def test_a_missing_extension_is_named_and_stops_nothing_else(lab, run):
    (lab / "extensions" / "acme.py").unlink()
    (lab / "extensions" / "drawn.py").unlink()
    status, said = run("check", "sets", "levels", "texture_ratings")
    assert status == 1 and said.count("is not here: install the package that brings it, or put") == 2
    assert "ok: texture_ratings" in said
    status, said = run("replay")
    digest = header(lab, "sets")["extensions"]["acme"]["sha256"][:12]
    assert status == 1 and f"made with the extension acme 1.2 (SHA-256 {digest}), which is not here" in said
    assert "1 of 2 sessions repeat exactly" in said  # a replay needs no procedure: its levels are on record
    status, said = run("collect", "--rebuild")
    assert status == 1 and "2 sessions" not in said and "1 session collected" in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = undefined\n", "NameError: name 'undefined' is not defined"),
        ("def (\n", "SyntaxError"),
        ("TASKS = {'largest': 3}\n", "acme.largest is 3; a Task is expected among tasks"),
        ("TASKS = {'biggest': TASKS['largest']}\n", "has no 'acme.largest' among its tasks"),
        ("TASKS = ['largest']\n", "a mapping of parts by names"),
        ("COLUMNS[0].name = 'x'\n", "FrozenInstanceError: cannot assign to field 'name'"),
    ],
)
def test_a_broken_extension_is_named_with_file_and_line_and_stops_nothing_else(lab, run, text, message):
    line = TASK.count("\n") + 1
    changed(lab, text)
    status, said = run("check", "sets", "levels")
    assert status == 1 and message in said and "ok: levels" in said
    assert ("Error" in message) == (f"acme.py line {line}: " in said)


def test_a_table_of_an_own_form_is_named_after_its_extension(lab, run):
    changed(lab, "FORMS = {'largest': FormKind('x', simulate, table=OwnTable('trials', '', COLUMNS, rows))}\n")
    (lab / "lab.sqlite").unlink(missing_ok=True)
    status, said = run("collect")
    assert status != 0 and "its table 'trials' is to be named acme_trials" in said


def test_after_a_change_the_next_person_and_the_interrupted_one_need_an_accepted_change(lab, run):
    changed(lab)
    before = header(lab, "sets")["extensions"]["acme"]
    status, said = run("run", "sets", "--participant", "P002", "--simulate")
    assert status == 2 and f"acme 1.2 (SHA-256 {before['sha256'][:12]}) is acme 1.2" in said
    assert run("run", "sets", "--participant", "P002", "--simulate", "--accept-change")[0] == 0
    first = header(lab, "sets", "P002")
    change = first["accepted_change"]["extensions_changed"]["acme"]
    assert change == {"before": before, "now": first["extensions"]["acme"]} and before != change["now"]
    assert run("replay")[0] == 0


def test_a_replay_that_differs_says_that_the_extension_has_changed(lab, run):
    file = lab / "extensions" / "acme.py"
    file.write_text(TASK.replace('"place"]', '"spot"]'), encoding="utf-8")
    status, said = run("replay", "--json")
    [sets] = [row for row in json.loads(said) if "sets" in row["ledger"]]
    assert status == 1 and sets["verdict"] == "differs"
    assert 'recorded "place", now "spot"' in sets["problem"] and " now)" in sets["problem"]


def test_two_extensions_of_one_name_are_refused(lab, run):
    folder = lab / "extensions" / "acme"
    folder.mkdir()
    (folder / "__init__.py").write_text(TASK, encoding="utf-8")
    status, said = run("check", "sets")
    assert status == 1 and "the extension 'acme' is there twice" in said and "rename one" in said
    assert run("check", "levels")[0] == 0  # the other extension goes on


def test_a_folder_is_an_extension_whose_every_file_counts(lab, run):
    folder = lab / "extensions" / "folded"
    folder.mkdir()
    (folder / "__init__.py").write_text("from lab_extensions.folded.task import TASKS, FORMS\n", encoding="utf-8")
    (folder / "task.py").write_text(TASK.replace("acme", "folded"), encoding="utf-8")
    add_study(lab, "folded_sets", STUDY.replace("acme", "folded").replace("study: sets", "study: folded_sets"), STIMULI)
    assert run("run", "folded_sets", "--participant", "P001", "--simulate")[0] == 0
    (folder / "words.txt").write_text("smooth", encoding="utf-8")
    assert run("run", "folded_sets", "--participant", "P002", "--simulate")[0] == 2


def test_what_looks_for_extensions_is_put_back_when_a_command_ends(run):
    before = finder()
    run("check", "sets")
    assert finder() is before


def test_workers_look_in_the_same_lab(run):
    assert run("replay", "--workers", "2")[0] == 0
