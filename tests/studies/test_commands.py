import json
import shutil
import sqlite3
from pathlib import Path

import pytest

from palpate.command_line import _status
from palpate.studies.sessions.record import read
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
def run(tmp_path, run_palpate):
    """Return a function that runs a command in a lab with the study toy."""
    folder = tmp_path / "studies" / "toy"
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(TOY)

    def run_in_lab(*arguments, status=0):
        return run_palpate(*arguments, "--lab", tmp_path, status=status)

    return run_in_lab


def test_studies_are_listed(run):
    text = run("studies")
    assert "door_ratings" in text and "90 stimuli, 7 attributes" in text and "toy" in text
    listed = {row["study"] for row in json.loads(run("studies", "--json"))}
    assert {name for name in listed if "_" not in name} == {"toy"} and len(listed) == 17


def test_a_broken_study_is_listed_as_broken(run, tmp_path):
    (tmp_path / "studies" / "toy" / "study.yaml").write_text("study: toy\n")
    assert "BROKEN" in run("studies")


def test_check_says_what_a_study_is(run, tmp_path):
    assert "group 1: 45 trials, group 2: 45 trials" in run("check", "door_ratings")
    assert json.loads(run("check", "toy", "--json"))[0]["ok"] is True
    (tmp_path / "studies" / "toy" / "study.yaml").write_text(TOY.replace("task:", "tsk:"))
    text = run("check", "toy", "door_ratings", status=1)
    assert "NOT OK" in text and "line 3: tsk: unknown key; did you mean 'task'?" in text and "ok: door_ratings" in text
    assert run("check", "tyo", status=2) == "Error: no study is called 'tyo'; did you mean 'toy'?\n"


@pytest.mark.parametrize(
    "trick", ["a: &x [1]\nb: *x\n", "a: !!python/object/apply:os.system [ls]\n", "caf\u00e9: 1\n", "[" * 60]
)
def test_a_study_file_with_tricks_is_one_screen_and_nothing_written(run, tmp_path, trick):
    (tmp_path / "studies" / "toy" / "study.yaml").write_bytes(trick.encode("latin-1"))
    before = sorted(tmp_path.rglob("*"))
    text = run("check", "toy", status=1)
    assert text.startswith("NOT OK\n") and len(text.splitlines()) < 12
    error = run("run", "toy", "--participant", "P001", "--simulate", status=2)
    assert error.startswith("Error: ") and "Traceback" not in error
    assert sorted(tmp_path.rglob("*")) == before


def test_plan_shows_the_trials(run):
    text = run("plan", "toy", "--participant", "P002")
    assert "row 1" in text and text.count("(rest first)") == 1
    data = json.loads(run("plan", "toy", "--participant", "P002", "--json"))
    assert [t["trial"] for t in data["trials"]] == [1, 2, 3, 4] and data["row"] == 1


def test_plan_certifies_balance(run):
    assert "group all: 4 sequences of 4 items: balanced." in run("plan", "toy", "--balance", "4")
    assert "not balanced (yet)" in run("plan", "toy", "--balance", "3")
    data = json.loads(run("plan", "door_ratings", "--balance", "180", "--json"))
    assert data["1"]["balanced"] and data["2"]["balanced"]
    assert data["1"]["position_range"] == [2, 2] and data["1"]["carry_over_range"] == [2, 2]


def test_a_life_of_a_lab(run, tmp_path):
    assert "complete: " in run("run", "toy", "--participant", "P001", "--simulate", "--seed", "1")
    assert "3 sessions complete" in run("run", "toy", "--participant", "P002..P004", "--simulate")
    assert "4 of 4 sessions repeat exactly" in run("replay")
    assert "4 sessions collected (4 new)" in run("collect")
    assert "4 sessions collected (4 unchanged)" in run("collect")
    connection = sqlite3.connect(tmp_path / "lab.sqlite")
    assert connection.execute("select count(*) from ratings").fetchone() == (4 * 4 * 2,)
    connection.close()
    other = f"sqlite:///{tmp_path / 'other.sqlite'}"
    assert json.loads(run("collect", "--to", other, "--json")) == {
        "new": 4, "problems": [], "refused": 0, "sessions": 4, "skipped": [], "unchanged": 0, "updated": 0,
    }  # fmt: skip
    assert len(json.loads(run("replay", "--json"))) == 4


def test_an_interrupted_session_is_reported_and_resumed(run, tmp_path, monkeypatch):
    lab = Lab(tmp_path)
    monkeypatch.setattr("palpate.studies.simulation.rig.simulated", lambda *_: stopping(lab.rig, 5))
    text = run("run", "toy", "--participant", "P001..P003", "--simulate", status=1)
    ledger = tmp_path / "sessions" / "toy_P001_s1.sqlite"
    events = len(read(ledger).events)
    assert f"interrupted by SIGTERM; recorded: {events} events. Resume with: palpate resume {ledger}" in text
    assert not (tmp_path / "sessions" / "toy_P002_s1.sqlite").exists()
    monkeypatch.undo()
    assert f"(interrupted after {events} events" in run("replay")
    assert "complete: " in run("resume", ledger.name)
    assert "is complete; nothing to resume" in run("resume", str(ledger), status=2)


def test_a_damaged_ledger_fails_the_replay_alone(run, tmp_path):
    run("run", "toy", "--participant", "P001..P002", "--simulate")
    bad = tmp_path / "sessions" / "toy_P001_s1.sqlite"
    bad.write_bytes(bad.read_bytes()[:3000])
    text = run("replay", str(tmp_path / "sessions"), status=1)
    assert f"REFUSED  {bad}" in text and "1 of 2 sessions repeat exactly" in text


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("run", "toy", "--participant", "P001"), "is not a lab"),
        (("run", "door_ratings", "--participant", "P001"), "needs door, and this station has no rig file"),
        (("run", "toy", "--participant", "P001", "--simulate", "--rehearse"), "needs no window"),
        (("run", "toy", "--participant", "P001", "--no-window"), "--no-window goes with --rehearse"),
        (("run", "toy", "--participant", "Anna Smith", "--simulate"), "a pseudonym of a letter"),
        (("run", "toy", "--participant", "P001..P003"), "only simulated sessions run several at once"),
        (("run", "toy", "--participant", "P003..P001", "--simulate"), "from first to last is expected"),
        (("run", "toy", "--participant", "P001", "--simulate", "--group", "x"), "toy has no groups"),
        (("run", "toy", "--simulate"), "Missing option '--participant'"),
        (("run", "toy", "--participant", "P001", "--simulate", "--row", "-1"), "is not in the range x>=0"),
        (("runn", "toy"), "no verb 'runn'; did you mean 'run'?"),
        (("replay",), "no ledgers in"),
        (("collect",), "no ledgers in"),
        (("resume", "nowhere.sqlite"), "/sessions/nowhere.sqlite: no such ledger"),
        (("resume", "."), "a folder; name one ledger"),
        (("replay", "nowhere.sqlite"), "nowhere.sqlite: no such ledger or folder"),
        (("run", "toy", "--participant", "P001\n", "--simulate"), "a pseudonym of a letter"),
        (("run", "toy", "--participant", "P001,P002", "--simulate"), "also several, as P001..P040"),
        (("run", "toy", "--participant", "P001", "--simulate", "--seed", "9" * 20), "at most 63 bits"),
        (("check", "."), "a study's name, its folder or its study.yaml is expected"),
    ],
)  # fmt: skip
def test_mistakes_are_one_clear_line_and_nothing_is_written(run, tmp_path, arguments, error):
    before = sorted(tmp_path.rglob("*"))
    text = run(*arguments, status=2)
    assert error in text and "Traceback" not in text and len(text.splitlines()) <= 6
    assert sorted(tmp_path.rglob("*")) == before


def test_a_question_that_the_lab_does_not_have_is_noted(run, tmp_path, capsys):
    file = tmp_path / "studies" / "toy" / "study.yaml"
    file.write_text(TOY + "opening: [demographics]\nquestions: [age, gendre]\n")
    note = "note: the lab has no question 'gendre', so it is not asked; did you mean 'gender'?"
    assert note in run("check", "toy") and len(json.loads(run("check", "toy", "--json"))[0]["notes"]) == 1
    assert _status(["run", "toy", "--participant", "P001", "--simulate", "--lab", str(tmp_path)]) == 0
    assert capsys.readouterr().err.count(note) == 1
    file.write_text(file.read_text().replace("gendre", "gender"))
    assert "note:" not in run("check", "toy")


def test_a_plan_notes_a_session_beyond_those_declared(run, tmp_path):
    assert "note:" not in run("plan", "toy", "--session", "3")
    (tmp_path / "studies" / "toy" / "study.yaml").write_text(TOY + "participants: {sessions: 2}\n")
    assert "note: the study declares 2 sessions: run refuses session 3" in run("plan", "toy", "--session", "3")
    assert "note:" not in run("plan", "toy", "--session", "2")


def test_a_session_is_not_run_twice(run):
    run("run", "toy", "--participant", "P001", "--simulate")
    assert "P001 has had session 1 of toy (complete); if a further one is meant, give --session 2" in run(
        "run", "toy", "--participant", "P001", "--simulate", status=2
    )
    run("run", "toy", "--participant", "P001", "--simulate", "--session", "2")


def test_one_bad_ledger_does_not_hold_up_the_others(run, tmp_path):
    run("run", "toy", "--participant", "P001..P004", "--simulate")
    folder = tmp_path / "sessions"
    bad = folder / "toy_P002_s1.sqlite"
    bad.write_bytes(bad.read_bytes()[:3000])
    shutil.copy(folder / "toy_P003_s1.sqlite", folder / "toy_P003_s1 (copy).sqlite")
    text = run("collect", status=1)
    assert "3 sessions collected (3 new, 1 refused)" in text and f"REFUSED  {bad}" in text
    assert "not taken for sessions by their names: toy_P003_s1 (copy).sqlite" in text


def test_a_database_can_be_rebuilt(run, tmp_path):
    run("run", "toy", "--participant", "P001..P002", "--simulate")
    run("collect")
    (tmp_path / "sessions" / "toy_P001_s1.sqlite").unlink()
    run("run", "toy", "--participant", "P001", "--simulate", "--seed", "5")
    assert "if it was run again, collect with --rebuild" in run("collect", status=1)
    assert "2 sessions collected (2 new)" in run("collect", "--rebuild")


@pytest.mark.parametrize("url", ["sqlite://", "sqlite:///:memory:"])
def test_a_database_in_memory_is_refused(run, url):
    run("run", "toy", "--participant", "P001", "--simulate")
    assert "lost when the command ends" in run("collect", "--to", url, status=2)


def test_a_ledger_is_no_database_to_collect_into(run, tmp_path):
    run("run", "toy", "--participant", "P001", "--simulate")
    ledger = tmp_path / "sessions" / "toy_P001_s1.sqlite"
    before = ledger.read_bytes()
    assert "a session's ledger; collect into another database" in run(
        "collect", "--to", f"sqlite:///{ledger}", status=2
    )
    assert ledger.read_bytes() == before


def test_a_lab_may_have_any_name(tmp_path, capsys):
    lab = tmp_path / "what? 100% #lab"
    (lab / "studies" / "toy").mkdir(parents=True)
    (lab / "studies" / "toy" / "study.yaml").write_text(TOY)
    for verb in (["run", "toy", "--participant", "P001", "--simulate"], ["replay"], ["collect"]):
        assert _status([*verb, "--lab", str(lab)]) == 0
    assert (lab / "lab.sqlite").exists() and [p.name for p in tmp_path.iterdir()] == [lab.name]
    capsys.readouterr()


def test_a_row_of_the_square_belongs_to_one_participant(run):
    run("run", "toy", "--participant", "P001", "--simulate")
    text = run("run", "toy", "--participant", "Q1", "--simulate", status=2)
    assert "participant Q1: row 0 is P001's; give --row" in text
    assert "complete" in run("run", "toy", "--participant", "Q1", "--row", "0", "--simulate")
    run("run", "toy", "--participant", "P001", "--simulate", "--session", "2")


def test_several_are_refused_before_the_first_starts(run, tmp_path):
    run("run", "toy", "--participant", "P003", "--simulate")
    assert "P003 has had session 1 of toy (complete)" in run(
        "run", "toy", "--participant", "P001..P004", "--simulate", status=2
    )
    assert len(list((tmp_path / "sessions").glob("*.sqlite"))) == 1


def test_a_session_is_resumed_from_inside_its_folder_and_without_its_study_file(
    run, run_palpate, tmp_path, monkeypatch
):
    lab = Lab(tmp_path)
    monkeypatch.setattr("palpate.studies.simulation.rig.simulated", lambda *_: stopping(lab.rig, 5))
    run("run", "toy", "--participant", "P001", "--simulate", status=1)
    monkeypatch.undo()
    (tmp_path / "studies" / "toy" / "study.yaml").write_text("broken: [")
    monkeypatch.chdir(tmp_path / "sessions")
    assert "The study's file cannot be read any more" in run_palpate("resume", "toy_P001_s1.sqlite", status=2)
    assert "complete: " in run_palpate("resume", "toy_P001_s1.sqlite", "--accept-change")
    assert read(Path("toy_P001_s1.sqlite")).run_notes[-2].value["accepted_change"] == {
        "since_session": 1, "differences": "the study's file could not be read",
    }  # fmt: skip


def test_a_study_changed_meanwhile_is_named_and_its_acceptance_recorded(run, tmp_path):
    run("run", "toy", "--participant", "P001", "--simulate")
    file = tmp_path / "studies" / "toy" / "study.yaml"
    file.write_text(file.read_text().replace("[Soft, Hard]", "[Soft, Firm]"))
    again = ("run", "toy", "--participant", "P001", "--simulate", "--session", "2")
    assert 'attributes.Soft.high was "Hard" and is "Firm"' in run(*again, status=2)
    run(*again, "--accept-change")
    accepted = read(tmp_path / "sessions" / "toy_P001_s2.sqlite").header["accepted_change"]
    assert accepted["since_session"] == 1 and accepted["study_before"] != accepted["study_now"]
    assert "P001 has no session 3" in run(*again[:-1], "4", status=2)


def test_a_study_that_changed_is_not_run_with_the_next_participant_unless_that_is_accepted(run, tmp_path):
    run("run", "toy", "--participant", "P001..P002", "--simulate")
    file = tmp_path / "studies" / "toy" / "study.yaml"
    file.write_text(file.read_text().replace("[Soft, Hard]", "[Soft, Firm]"))
    others = ("run", "toy", "--participant", "P003..P004", "--simulate")
    refused = run(*others, status=2)
    assert not (tmp_path / "sessions" / "toy_P003_s1.sqlite").exists()
    run(*others, "--accept-change")
    for who in ("P003", "P004"):
        accepted = read(tmp_path / "sessions" / f"toy_{who}_s1.sqlite").header["accepted_change"]
        before, now = accepted["study_before"], accepted["study_now"]
        assert f"(digest {before[:12]}, now {now[:12]}): attributes.Soft.high" in refused
    run("run", "toy", "--participant", "P005", "--simulate")
    assert "accepted_change" not in read(tmp_path / "sessions" / "toy_P005_s1.sqlite").header


def test_a_crashed_session_without_its_wal_is_not_silently_resumed(run, tmp_path):
    from palpate.studies.sessions.ledger import open_for_append
    from palpate.studies.sessions.session import create, header_of

    lab = Lab(tmp_path)
    path = tmp_path / "sessions" / "toy_P001_s1.sqlite"
    create(path, header_of(lab.plan(), lab.rig), {"at": "2026-01-01T00:00:00+00:00"})
    ledger = open_for_append(path, {"at": "2026-01-01T00:00:00+00:00"})
    alone = tmp_path / "alone" / "sessions" / path.name
    alone.parent.mkdir(parents=True)
    shutil.copy(path, alone)
    ledger.close({"at": "2026-01-01T00:00:00+00:00"})
    assert "the -wal file is missing" in run("replay", str(alone))
    assert "its -wal file, which may hold the session's last events, is not there" in run(
        "resume", str(alone), status=2
    )
    assert "complete" in run("resume", str(alone), "--without-wal", "--accept-change")


FELT = """study: felt
task: intervals
stimuli:
  - {id: f250, waveform: sine, frequency_hz: 250, reference: m_s2}
intervals: {seconds: 0.6}
procedure:
  kind: constant
  repeats: 1
  level: {column: level_db, values: [0, 10]}
order: {design: random}
needs: [window, vibration]
"""


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ("[0, 10]", "[0, 60]", "line 9: procedure.level: vibrator: stimulus 'f250' (60 dB re 1 m/s^2 RMS, sine)"),
        ("{seconds", "{standard: 60, seconds", "line 5: intervals.standard: vibrator: stimulus 'f250' (60 dB"),
        ("sine", "sinus", "line 4: stimuli[0]: stimulus 'f250', column 'waveform': found 'sinus'"),
    ],
)
def test_a_vibration_that_cannot_be_played_is_reported_by_check_with_its_line(
    run_palpate, tmp_path, right, wrong, message
):
    file = tmp_path / "study.yaml"
    file.write_text(FELT.replace(right, wrong))
    assert f"NOT OK\n{file}: {message}" in run_palpate("check", tmp_path, status=1)


def test_a_study_that_cannot_be_presented_is_reported_by_check_and_leaves_no_session(run, tmp_path):
    folder = tmp_path / "studies" / "toy"
    (folder / "study.yaml").write_text(TOY.replace("[A, B, C, D]", "stimuli.csv") + "needs: [door]\n")
    (folder / "stimuli.csv").write_text("id,file\na,a.csv\nb,b.csv\n")
    for name in "ab":
        (folder / f"{name}.csv").write_text("hello\n")
    assert "NOT OK" in run("check", "toy", status=1)
    assert "a.csv" in run("run", "toy", "--participant", "P001", "--simulate", status=2)
    assert not (tmp_path / "sessions").exists()
    (folder / "stimuli.csv").write_text("id\na\nb\n")
    assert "no door profile" in run("check", "toy", status=1)


def test_a_folder_and_its_study_have_one_name(run, tmp_path):
    (tmp_path / "studies" / "toy" / "study.yaml").write_text(TOY.replace("study: toy", "study: toys"))
    assert "found 'toys' in a folder named 'toy'" in run("check", "toy", status=1)
