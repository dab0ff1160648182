"""A lab of version 0.1: today's code replays, resumes, collects and regenerates it, and its models answer as then.

`tests/recorded/frozen/` never changes (README there). What comes out otherwise here comes out otherwise in every lab.
"""

import csv
import hashlib
import io
import json
import re
import shlex
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace

import pytest

from palpate.analysis.ratings.sources import DataRequest
from palpate.analysis.regenerating.comparison import differences
from palpate.analysis.regenerating.outputs import STATISTICS, file_texts
from palpate.analysis.regenerating.regeneration import regenerate
from palpate.command_line import _status
from palpate.devices.rig.file import read_rig
from palpate.protocols.events import event_hash
from palpate.studies.catalogue import SHIPPED
from palpate.studies.sessions.ledger_schema import SEED
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import recompiled, replay
from palpate.studies.sessions.session import resume
from palpate.studies.sessions.session_files import ledgers_in
from palpate.studies.simulation.rig import simulated
from tests.commands_for_tests import run_command
from tests.recorded.make_frozen import EXPECTED, LAB, STUDIES, answers
from tests.studies.simulation.small_textures import write

HEADS, ANSWERS = (json.loads(EXPECTED.read_text())[key] for key in ("heads", "models"))
LEDGERS = [path.name for path in ledgers_in(LAB)]
RECORDED = LAB.parents[1]
LIVE = "texture_photos_P011_s1.sqlite"
WITHOUT_NUMBERS = {
    "texture_capture_P002_s1.sqlite": "135dc4bcd6a9a2550b774777650215681c91e3dcfe3e3264b1c84376e1597d74",
}
"""Links of the events without their samples, by the code of then: the last bits of what the twin of a stroke measures
depend on the processor, so the code of then comes to another head on another machine, too."""
ADDED: dict[str, set[str]] = {}
"""Columns of a table, or keys of statistics.json, that came later, by file name: written here on purpose."""

REWORDED = {
    "name the ratings that count in an analysis plan: `where: {session: ...}` keeps one session of each participant,"
    " `where: {trial: [...]}` some trials (docs/reference/analysis-plan.md); then palpate regenerate": (
        "leave one of the ratings out"
    ),
}
"""What a refusal advises now, and what it advised then: written here on purpose, too."""


def run(*command, typed=""):
    """Run a command of today in a process of its own."""
    words = [sys.executable, "-m", *map(str, command)]
    return subprocess.run(words, input=typed, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A copy in which no session goes on."""
    return shutil.copytree(LAB, tmp_path_factory.mktemp("frozen") / "lab")


@pytest.fixture(scope="module")
def resumed(tmp_path_factory):
    """A copy in which every simulated session that was killed is resumed."""
    lab = shutil.copytree(LAB, tmp_path_factory.mktemp("resumed") / "lab")
    for name in HEADS:
        assert _status(["resume", str(lab / "sessions" / name), "--accept-change"]) == 0, name
    return lab


def test_every_study_is_there_complete_and_killed_in_mid_trial(lab):
    records = {name: read(lab / "sessions" / name) for name in LEDGERS}
    assert {name for name, record in records.items() if record.status == "interrupted"} == {*HEADS, LIVE}
    for study in STUDIES:
        assert records[f"{study}_P001_s1.sqlite"].complete
    for name in (*HEADS, LIVE):
        last = records[name].events[-1]
        assert (last.kind, last.trial is None) == ("request", False), name
        assert [entry.kind for entry in records[name].run_notes] == ["created", "opened"], name


@pytest.mark.parametrize("name", LEDGERS)
def test_a_session_repeats_event_by_event(lab, name):
    ledger = lab / "sessions" / name
    before = ledger.read_bytes()
    assert replay(ledger).events == len(read(ledger).events)
    assert ledger.read_bytes() == before


@pytest.mark.parametrize("name", HEADS)
def test_a_killed_session_comes_to_the_end_that_it_had_unkilled(resumed, name):
    """Expected: the last link of the same session's event chain, run by the code of then without a kill."""
    ledger = resumed / "sessions" / name
    record = read(ledger)
    assert record.complete and replay(ledger).complete
    if name in WITHOUT_NUMBERS:
        link = SEED
        for event in record.events:
            link = event_hash(link, replace(event, samples=()))
        assert link == WITHOUT_NUMBERS[name]
    else:
        assert record.head == HEADS[name]


OLDER = {1: "sessions/doors_small_P004_s1.sqlite", 2: "ten/texture_ratings_P001_s1.sqlite"}
"""A complete ledger of each format before the lab's: one with a lapse, one that was resumed."""


@pytest.mark.parametrize("version", OLDER)
@pytest.mark.parametrize("share", [0.3, 0.7])
def test_an_unfinished_ledger_of_an_older_format_goes_on_under_the_rule_it_began_with(tmp_path, version, share):
    """Expected: the chain of events of the same session as it was recorded whole, also where it was then resumed."""
    whole = read(RECORDED / OLDER[version])
    ledger = tmp_path / "sessions" / whole.path.name
    ledger.parent.mkdir()
    shutil.copy(whole.path, ledger)
    last = next(
        event.seq for event in whole.events[int(share * len(whole.events)) :] if event.kind == "request" and event.trial
    )
    with closing(sqlite3.connect(ledger)) as connection, connection:
        assert connection.execute("PRAGMA user_version").fetchone() == (version,)
        connection.execute("DELETE FROM samples WHERE seq > ?", (last,))
        connection.execute("DELETE FROM events WHERE seq > ?", (last,))
        connection.execute("DELETE FROM sittings WHERE events > ?", (last + 1,))
    plan = recompiled(whole)
    folder = RECORDED / "doors_small" if version == 1 else SHIPPED / plan.study.study
    assert resume(ledger, simulated(plan.study, folder)).complete
    assert read(ledger).hashes == whole.hashes
    with closing(sqlite3.connect(ledger)) as connection:
        assert connection.execute("PRAGMA user_version").fetchone() == (version,)


def test_a_killed_session_of_a_real_participant_goes_on_at_the_twins_of_the_rig_file(lab, tmp_path):
    lab = shutil.copytree(lab, tmp_path / "lab")
    rig, ledger = lab / "stations" / "BENCH" / "rig.yaml", lab / "sessions" / LIVE
    assert len(read_rig(rig).devices) == 11
    ended = run("palpate", "resume", ledger, "--rig", rig, "--accept-change", typed="abort no camera\n")
    assert "aborted: the session is over" in ended.stdout and read(ledger).status == "aborted", ended


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    """The database of a copy, brought up to date as a user would: collect, and the command that a refusal names."""
    lab = shutil.copytree(LAB, tmp_path_factory.mktemp("collected") / "lab")
    code, _, error = run_command("collect", "--lab", lab)
    if code:
        [rebuild] = re.findall(r"palpate (collect .*--rebuild.*)", error)
        code, _, error = run_command(*shlex.split(rebuild))
    assert code == 0, error
    return lab / "lab.sqlite"


def ratings(database, columns="*"):
    with closing(sqlite3.connect(database)) as connection:
        rows = connection.execute(f"SELECT {columns} FROM ratings ORDER BY session, trial, attribute")
        return ", ".join(column[0] for column in rows.description), rows.fetchall()


def test_the_collected_database_is_updated_or_rebuilt_with_the_same_ratings(lab, collected):
    columns, before = ratings(lab / "lab.sqlite")
    assert len(before) == 1971
    assert ratings(collected, columns) == (columns, before)


def test_a_participant_who_withdrew_stays_withdrawn(lab, collected, run_palpate):
    assert re.search("P004 +withdrawn", run_palpate("participants", "list", "--lab", lab))
    second = ("run", "texture_ratings", "--participant", "P004", "--simulate", "--session", "2", "--lab", lab)
    assert "withdr" in run_palpate(*second, status=2)
    with closing(sqlite3.connect(collected)) as connection:
        rows = connection.execute("SELECT DISTINCT status FROM sessions WHERE participant = 'P004'").fetchall()
    assert rows == [("withdrawn",)]


def without(added, name, text):
    """A file's text without the columns, or keys, that were added to it later."""
    if name == STATISTICS:
        return json.dumps(json.loads(text, object_hook=lambda o: {k: v for k, v in o.items() if k not in added}))
    rows = csv.reader(io.StringIO(text))
    header = next(rows)
    places = [place for place, column in enumerate(header) if column not in added]
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([row[place] for place in places] for row in [header, *rows])
    return out.getvalue()


@pytest.mark.parametrize("name", [pytest.param("texture_ratings", marks=pytest.mark.long), "sponges"])
def test_what_is_regenerated_is_what_was_regenerated_then(lab, name):
    """Of a sample with a second session, one who withdrew and one who was interrupted; and of an imported table."""
    texts = file_texts(regenerate(DataRequest(name, lab)), {})
    for now, then in REWORDED.items():
        texts = {file: text.replace(now, then) for file, text in texts.items()}
    texts |= {file: without(ADDED[file], file, texts[file]) for file in ADDED.keys() & texts.keys()}
    assert [difference.text() for difference in differences(texts, LAB / "regenerated" / name)] == []


def test_every_model_answers_as_it_did(lab):
    """Expected: the answers of version 0.1; single precision rounds otherwise on another processor."""
    for model, now in answers(lab).items():
        assert now == pytest.approx(ANSWERS[model], rel=1e-3, abs=1e-4), model


def test_a_model_that_changed_under_its_name_is_named_with_both_digests_and_accepted_on_record(
    lab, tmp_path, run_palpate
):
    """Of the rest of a session that was killed, and of the next participant."""
    lab = shutil.copytree(lab, tmp_path / "lab")
    sessions, card = lab / "sessions", lab / "models" / "texture-cardboard-hapinf.json"
    before = hashlib.sha256(card.read_bytes()).hexdigest()
    write(lab / "models", "cardboard", "hapinf", louder=2.0)
    now = hashlib.sha256(card.read_bytes()).hexdigest()
    killed = sessions / "texture_similarity_P002_s1.sqlite"
    for path in sessions.glob("texture_similarity_P00[13]*"):
        path.unlink()
    study = ("texture_similarity", "--participant", "P007", "--simulate", "--lab", str(lab))
    own = lab / "studies" / "texture_similarity"  # as it was, so that nothing but the model has changed
    shutil.copytree(SHIPPED / "texture_similarity", own)
    then = read(killed).header["study"]
    scale = {"from": then["scale"]["low"], "to": then["scale"]["high"], "start": then["scale"]["start"]}
    (own / "study.yaml").write_text(json.dumps({**then, "stimuli": "stimuli.csv", "scale": scale}))
    with (own / "stimuli.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, ["id", *then["stimuli"][0]["columns"]])
        table.writeheader()
        table.writerows({"id": stimulus["id"], **stimulus["columns"]} for stimulus in then["stimuli"])
    accepted = {"models_changed": {card.stem: {"before": before, "now": now}}}
    for command in (["resume", str(killed)], ["run", *study]):
        refused = run_palpate(*command, status=2)
        assert f"{card.stem} was {before[:12]} in {killed.name} and is {now[:12]}" in refused
        run_palpate(*command, "--accept-change")
    assert accepted.items() <= read(killed).run_notes[-2].value["accepted_change"].items()
    ledger = sessions / "texture_similarity_P007_s1.sqlite"
    assert accepted.items() <= read(ledger).header["accepted_change"].items()
    run_palpate("run", *(word.replace("P007", "P008") for word in study))


def test_what_is_regenerated_names_the_versions_of_models_that_are_mixed(lab, tmp_path, run_palpate):
    """P001 felt the shipped models of then, P003 those of the lab."""
    command = ["regenerate", "texture_similarity", "--no-figures", "--lab", lab, "--to", tmp_path / "out"]
    out = run_palpate(*command)
    versions = json.loads((tmp_path / "out" / STATISTICS).read_text())["versions"]
    assert len(versions) == 48 and {version["note"] for version in versions} == {"1 session"}
    assert "MIXED VERSIONS" in out
    for version in versions:
        assert f"  {version['name']} {version['sha256'][:12]}: 1 session" in out
