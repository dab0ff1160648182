import json
import sqlite3

import pytest

from palpate import _status
from studies.record import read
from tests.studies.labs import Lab, stopping

TOY = """\
study: toy
title: A toy
task: slider_rating
stimuli: [A, B, C, D]
attributes: [[Soft, Hard], [Cold, Warm]]
scale: {from: -10, to: 10, step: 1}
order: {design: williams}
navigation: back_and_forward
rest: {every: 2}
simulation: {latents: {Soft: {intercept: 2}}, revise_rate: 0.2}
"""


@pytest.fixture
def said(tmp_path, capsys):
    folder = tmp_path / "studies" / "toy"
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(TOY)

    def call(*arguments, status=0):
        assert _status([*arguments, *(["--lab", str(tmp_path)] if arguments[0] != "resume" else [])]) == status
        caught = capsys.readouterr()
        return caught.err if status == 2 else caught.out

    return call


def test_studies_are_listed(said):
    text = said("studies")
    assert "door_ratings" in text and "90 stimuli, 7 attributes" in text and "toy" in text
    assert {row["study"] for row in json.loads(said("studies", "--json"))} == {"door_ratings", "toy"}


def test_a_broken_study_is_listed_as_broken(said, tmp_path):
    (tmp_path / "studies" / "toy" / "study.yaml").write_text("study: toy\n")
    assert "BROKEN" in said("studies")


def test_check_says_what_a_study_is(said, tmp_path):
    assert "group 1: 45 trials, group 2: 45 trials" in said("check", "door_ratings")
    assert json.loads(said("check", "toy", "--json"))[0]["ok"] is True
    (tmp_path / "studies" / "toy" / "study.yaml").write_text(TOY.replace("task:", "tsk:"))
    text = said("check", "toy", "door_ratings", status=1)
    assert "NOT OK" in text and "line 3: tsk: unknown key; did you mean 'task'?" in text and "ok: door_ratings" in text
    assert said("check", "tyo", status=2) == "Error: no study is called 'tyo'; did you mean 'toy'?\n"


@pytest.mark.parametrize(
    "trick", ["a: &x [1]\nb: *x\n", "a: !!python/object/apply:os.system [ls]\n", "caf\u00e9: 1\n", "[" * 5000]
)
def test_a_study_file_with_tricks_is_one_screen_and_nothing_written(said, tmp_path, trick):
    (tmp_path / "studies" / "toy" / "study.yaml").write_bytes(trick.encode("latin-1"))
    before = sorted(tmp_path.rglob("*"))
    text = said("check", "toy", status=1)
    assert text.startswith("NOT OK\n") and len(text.splitlines()) < 12
    error = said("run", "toy", "--participant", "P001", "--simulate", status=2)
    assert error.startswith("Error: ") and "Traceback" not in error
    assert sorted(tmp_path.rglob("*")) == before


def test_plan_shows_the_trials(said):
    text = said("plan", "toy", "--participant", "P002")
    assert "row 1" in text and text.count("(rest first)") == 1
    data = json.loads(said("plan", "toy", "--participant", "P002", "--json"))
    assert [t["trial"] for t in data["trials"]] == [1, 2, 3, 4] and data["row"] == 1


def test_plan_certifies_balance(said):
    assert "group all: 4 sequences of 4 items: balanced." in said("plan", "toy", "--balance", "4")
    assert "not balanced (yet)" in said("plan", "toy", "--balance", "3")
    data = json.loads(said("plan", "door_ratings", "--balance", "180", "--json"))
    assert data["1"]["balanced"] and data["2"]["balanced"]
    assert data["1"]["position_range"] == [2, 2] and data["1"]["carry_over_range"] == [2, 2]


def test_a_life_of_a_lab(said, tmp_path):
    assert "complete: " in said("run", "toy", "--participant", "P001", "--simulate", "--seed", "1")
    assert "3 sessions complete" in said("run", "toy", "--participant", "P002..P004", "--simulate")
    assert "4 of 4 sessions repeat exactly" in said("replay")
    assert "4 sessions collected (4 new)" in said("collect")
    assert "4 sessions collected (4 unchanged)" in said("collect")
    connection = sqlite3.connect(tmp_path / "lab.sqlite")
    assert connection.execute("select count(*) from ratings").fetchone() == (4 * 4 * 2,)
    connection.close()
    other = f"sqlite:///{tmp_path / 'other.sqlite'}"
    assert json.loads(said("collect", "--to", other, "--json")) == {"grown": 0, "new": 4, "sessions": 4, "unchanged": 0}
    assert len(json.loads(said("replay", "--json"))) == 4


def test_an_interrupted_session_is_told_and_resumed(said, tmp_path, monkeypatch):
    lab = Lab(tmp_path)
    monkeypatch.setattr("studies.rig.simulated", lambda plan, folder, t_ns: stopping(lab, 5)(plan, t_ns))
    text = said("run", "toy", "--participant", "P001..P003", "--simulate", status=1)
    ledger = tmp_path / "sessions" / "toy_P001_s1.sqlite"
    kept = len(read(ledger).events)
    assert f"interrupted by SIGTERM; {kept} events are kept. Go on with: palpate resume {ledger}" in text
    assert not (tmp_path / "sessions" / "toy_P002_s1.sqlite").exists()
    monkeypatch.undo()
    assert f"(interrupted after {kept} events" in said("replay")
    assert "complete: " in said("resume", str(ledger))
    assert "is complete; there is nothing to go on with" in said("resume", str(ledger), status=2)


def test_a_damaged_ledger_fails_the_replay_alone(said, tmp_path):
    said("run", "toy", "--participant", "P001..P002", "--simulate")
    bad = tmp_path / "sessions" / "toy_P001_s1.sqlite"
    bad.write_bytes(bad.read_bytes()[:3000])
    text = said("replay", str(tmp_path / "sessions"), status=1)
    assert f"DIFFERS  {bad}" in text and "1 of 2 sessions repeat exactly" in text


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("run", "toy", "--participant", "P001"), "drives simulated devices only: add --simulate"),
        (("run", "toy", "--participant", "Anna Smith", "--simulate"), "a pseudonym of a letter"),
        (("run", "toy", "--participant", "P001..P003"), "only simulated sessions run several at once"),
        (("run", "toy", "--participant", "P003..P001", "--simulate"), "from first to last is expected"),
        (("run", "toy", "--participant", "P001", "--simulate", "--group", "x"), "toy has no groups"),
        (("run", "toy", "--simulate"), "Missing option '--participant'"),
        (("run", "toy", "--participant", "P001", "--simulate", "--row", "-1"), "is not in the range x>=0"),
        (("runn", "toy"), "no verb 'runn'; did you mean 'run'?"),
        (("replay",), "no ledgers in"),
        (("collect",), "no ledgers in"),
        (("resume", "nowhere.sqlite"), "nowhere.sqlite: no such ledger"),
    ],
)  # fmt: skip
def test_mistakes_are_one_clear_line_and_nothing_is_written(said, tmp_path, arguments, error):
    before = sorted(tmp_path.rglob("*"))
    text = said(*arguments, status=2)
    assert error in text and "Traceback" not in text and len(text.splitlines()) <= 6
    assert sorted(tmp_path.rglob("*")) == before


def test_a_session_is_not_run_twice(said):
    said("run", "toy", "--participant", "P001", "--simulate")
    assert "exists: go on with it (palpate resume), or give --session 2" in said(
        "run", "toy", "--participant", "P001", "--simulate", status=2
    )
    said("run", "toy", "--participant", "P001", "--simulate", "--session", "2")
