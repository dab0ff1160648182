import json
import os
import re
import shutil
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest
from sqlalchemy import create_engine, inspect, make_url, select, text

from palpate.protocols.canonical import digest
from palpate.studies.collecting import schema
from palpate.studies.collecting.collect import CollectError, collect, open_database, rebuild_command
from palpate.studies.messages import hide_passwords
from palpate.studies.participants.identities import Identity, identify
from palpate.studies.participants.registry import reading
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.session import resume
from palpate.studies.sessions.session_files import ledger_path, ledgers_in
from tests.studies.labs import Lab, stopping
from tests.studies.participants.labs import filled, new_lab, postgres_schema

TABLES = ("studies", "participants", "sessions", "trials", "responses", "events", "streams")


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.needs("psycopg", "postgres"))])
def engine(request, tmp_path):
    if request.param == "sqlite":
        engine = open_database(f"sqlite:///{tmp_path / 'lab.sqlite'}")
    else:
        url = os.environ["PALPATE_TEST_POSTGRES"]
        empty = create_engine(url)
        with empty.begin() as connection:
            connection.execute(text("DROP VIEW IF EXISTS ratings"))
            schema.metadata.drop_all(connection)
        empty.dispose()
        engine = open_database(url)
    yield engine
    engine.dispose()


def rows(engine, query):
    with engine.connect() as connection:
        return [tuple(row) for row in connection.execute(text(query) if isinstance(query, str) else query)]


def collect_all(lab, engine):
    return [result.what for result in collect(ledgers_in(lab.path), engine)]


def test_sessions_are_gathered_once(lab, engine):
    lab.start("P001")
    lab.start("P002")
    assert collect_all(lab, engine) == ["new", "new"]
    before = {name: sorted(rows(engine, select(schema.metadata.tables[name])), key=str) for name in TABLES}
    assert collect_all(lab, engine) == ["unchanged", "unchanged"]
    assert {name: sorted(rows(engine, select(schema.metadata.tables[name])), key=str) for name in TABLES} == before
    assert [len(before[name]) for name in ("studies", "participants", "sessions", "trials")] == [1, 2, 2, 8]
    assert set(TABLES) < set(inspect(engine).get_table_names())


def test_the_view_holds_the_ratings_that_count(lab, engine):
    record = read(lab.start("P001"))
    collect_all(lab, engine)
    seen = rows(
        engine, "SELECT trial, stimulus, attribute, antonym, value, revised FROM ratings ORDER BY trial, attribute"
    )
    last = {}
    for event in record.events:
        if event.kind == "reply" and "answers" in event.value:
            last[event.trial] = event.value["answers"]
    stimuli = [t.stimulus.id for t in lab.plan().trials]
    expected = [
        (n, stimuli[n - 1], name, {"Soft": "Hard", "Cold": "Warm"}[name], float(last[n][name]))
        for n in sorted(last) for name in sorted(last[n])
    ]  # fmt: skip
    assert [row[:5] for row in seen] == expected


def test_a_revised_answer_keeps_both_and_counts_the_last(lab, engine):
    simulation = {"latents": {}, "revise_rate": 0.6, "lapse_rate": 1.0}
    record = read(lab.start("P001", simulation=simulation))
    collect_all(lab, engine)
    given = rows(engine, "SELECT trial, attempt, counts, revised FROM responses WHERE attribute = 'Soft' ORDER BY 1, 2")
    assert any(revised for *_, revised in given)
    for trial in {row[0] for row in given}:
        counted = [bool(counts) for number, _, counts, _ in given if number == trial]
        assert counted == [False] * (len(counted) - 1) + [True]
    answers = sum(e.kind == "reply" and "answers" in e.value for e in record.events)
    assert len(given) == answers > 4
    attempts = dict(rows(engine, "SELECT trial, attempts FROM trials"))
    started = [e.trial for e in record.events if e.kind == "trial_started"]
    assert attempts == {n: started.count(n) for n in range(1, 5)}


def test_an_interrupted_session_grows(lab, engine):
    path = lab.start(rig=stopping(lab.rig, 4))
    assert collect_all(lab, engine) == ["new"]
    status = "SELECT status, trials_planned, trials_answered, sittings FROM sessions"
    assert rows(engine, status) == [("interrupted", 4, 2, 1)]
    met = rows(engine, "SELECT trial, status, attempts FROM trials ORDER BY trial")
    assert [row[1] for row in met].count("not met") >= 1
    resume(path, lab.rig)
    assert collect_all(lab, engine) == ["updated"]
    assert rows(engine, status) == [("complete", 4, 4, 2)]
    assert {row[0] for row in rows(engine, "SELECT status FROM trials")} == {"answered"}


def test_the_database_can_be_dropped_and_rebuilt(lab, engine, tmp_path):
    lab.start()
    collect_all(lab, engine)
    again = open_database(f"sqlite:///{tmp_path / 'again.sqlite'}")
    collect_all(lab, again)
    for name in TABLES:
        query = select(schema.metadata.tables[name])
        assert sorted(rows(again, query), key=str) == sorted(rows(engine, query), key=str)
    again.dispose()


def test_the_study_explains_itself(lab, engine):
    lab.start()
    collect_all(lab, engine)
    [(study_digest, definition)] = rows(engine, "SELECT study_digest, definition FROM studies")
    assert json.loads(definition) == lab.plan().study.definition()
    assert study_digest == digest(lab.plan().study.definition())


def test_another_session_of_the_same_name_is_refused(lab, engine, tmp_path):
    lab.start()
    collect_all(lab, engine)
    other = Lab(tmp_path / "other")
    other.start(title="Another lab's")
    with pytest.raises(CollectError, match=r"session toy/P001/1 is another session.*distinct pseudonyms"):
        collect_all(other, engine)
    assert len(rows(engine, "SELECT * FROM sessions")) == 1


def test_a_session_that_was_cut_short_is_refused(lab, engine, tmp_path):
    whole = lab.start()
    collect_all(lab, engine)
    shorter = Lab(tmp_path / "shorter")
    path = shorter.cut(9)
    header = read(whole).header
    assert read(path).header == header
    with pytest.raises(CollectError, match=r"session toy/P001/1 is cut short .*event 9"):
        collect_all(shorter, engine)


def test_a_damaged_ledger_brings_nothing(lab, engine):
    path = lab.start("P001")
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(LedgerError):
        collect_all(lab, engine)
    assert rows(engine, "SELECT * FROM sessions") == []


def test_samples_are_listed_as_streams(tmp_path, engine):
    from palpate.studies.sessions.session import start
    from tests.studies.sessions.nursery import the_plan, the_rig

    record = read(start(tmp_path, the_plan(), the_rig()).path)
    list(collect([record.path], engine))
    streams = rows(engine, "SELECT stream, channels, units, rate_hz, samples FROM streams")
    presented = [e for e in record.events if e.samples]
    assert len(streams) == len(presented) >= 30
    assert set(streams) == {("door", "angle,force", "deg,N", 100.0, e.samples[0].count) for e in presented}


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("nonsense", "nonsense: not a database URL; use a SQLite file"),
        ("postgresql+psycopg://joe:pw@127.0.0.1:notaport/x", r"joe:\*\*\*@127.0.0.1:notaport/x: not a database URL"),
        ("postgresql+psycopg://joe:pw@[::1/x", r"joe:\*\*\*@\[::1/x: not a database URL"),
        ("mysql://joe:pw@h/x", r"mysql://joe:\*\*\*@h/x: the driver MySQLdb is not installed; use a SQLite file"),
        ("sqlite:////no/such/folder/x.sqlite", "unable to open database file"),
        ("postgresql+psycopg://me:secret@127.0.0.1:1/x", r"postgresql\+psycopg://me:\*\*\*@127.0.0.1:1/x: .*"),
        ("mysql://host/x", "MySQLdb"),
    ],
)
def test_the_error_of_an_unusable_database_does_not_show_its_password(url, message):
    with pytest.raises(CollectError, match=message) as caught:
        open_database(url)
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    ("url", "command"),
    [
        ("sqlite:///my lab/lab.sqlite", "palpate collect --rebuild --lab 'my lab'"),
        ("sqlite:///shared.sqlite", "palpate collect --rebuild --lab 'my lab' --to sqlite:///shared.sqlite"),
        (
            "postgresql+psycopg://me:secret@host:5433/lab?sslpassword=secret&options=-csearch_path%3Dx",
            "palpate collect --rebuild --lab 'my lab' --to"
            " 'postgresql+psycopg://me@host:5433/lab?options=-csearch_path%3Dx'"
            " (the URL is shown without its password: add it)",
        ),
    ],
)
def test_the_command_that_rebuilds_a_database_names_lab_and_url_and_no_password(url, command):
    assert rebuild_command(make_url(url), Path("my lab")) == hide_passwords(command) == command


def test_a_database_of_another_version_is_refused(tmp_path):
    url = f"sqlite:///{tmp_path / 'x.sqlite'}"
    engine = open_database(url)
    with engine.begin() as connection:
        connection.execute(text("UPDATE palpate SET version = 99"))
    engine.dispose()
    command = f"collect again from the ledgers: palpate collect --rebuild --lab {tmp_path} --to {url}"
    with pytest.raises(CollectError, match=rf"x.sqlite: collected in version 99, .*{re.escape(command)}"):
        open_database(url, lab=tmp_path)


@pytest.mark.parametrize("rebuild", [False, True])
@pytest.mark.parametrize("name", ["participants", "ratings", "mine", "palpate", "registry"])
def test_a_database_of_somebody_elses_is_refused_and_stays_as_it_was(tmp_path, name, rebuild):
    path = tmp_path / "x.db"
    with sqlite3.connect(path) as own:
        own.execute(f"CREATE TABLE {name} (email TEXT)")
        own.execute(f"INSERT INTO {name} VALUES ('a@b')")
    own.close()
    before = path.read_bytes()
    with pytest.raises(CollectError, match=rf"x\.db: holds the table {name}, and no mark .* nothing was changed"):
        open_database(f"sqlite:///{path}", rebuild)
    assert path.read_bytes() == before


@pytest.mark.parametrize("file", ["registry.sqlite", "identities.sqlite", "session"])
def test_the_other_files_of_a_lab_are_no_place_to_collect_into(lab, file):
    filled(new_lab(lab.path), 1)
    identify(lab.path, "P001", Identity(name="A B"))
    path = lab.start() if file == "session" else next(lab.path.rglob(file))
    before = path.read_bytes()
    with pytest.raises(CollectError, match="no mark of palpate collect|is a session's ledger"):
        open_database(f"sqlite:///{path}", rebuild=True)
    assert path.read_bytes() == before


def test_to_rebuild_drops_our_tables_and_no_other(lab, engine):
    lab.start()
    collect_all(lab, engine)
    with engine.begin() as connection:
        connection.execute(text("DROP TABLE IF EXISTS notes"))
        connection.execute(text("CREATE TABLE notes (words TEXT)"))
        connection.execute(text("INSERT INTO notes VALUES ('mine')"))
    open_database(engine.url, rebuild=True).dispose()
    assert rows(engine, "SELECT words FROM notes") == [("mine",)] and rows(engine, "SELECT * FROM sessions") == []
    assert collect_all(lab, engine) == ["new"]
    with engine.begin() as connection:
        connection.execute(text("DROP TABLE notes"))


def test_a_table_under_one_of_our_names_that_is_not_ours_is_not_dropped(tmp_path):
    url = f"sqlite:///{tmp_path / 'x.db'}"
    engine = open_database(url)
    with engine.begin() as connection:
        connection.execute(text("DROP TABLE answers"))
        connection.execute(text("CREATE TABLE answers (mine TEXT)"))
    with pytest.raises(CollectError, match="its table answers has no column item: palpate collect did not write it"):
        open_database(url, rebuild=True)
    assert "answers" in inspect(engine).get_table_names()
    engine.dispose()


@pytest.mark.needs("psycopg", "postgres")
def test_a_registry_in_postgresql_may_lie_beside(tmp_path):
    with postgres_schema() as url:
        registry = new_lab(tmp_path, url)
        filled(registry, 1)
        open_database(url, rebuild=True).dispose()
        open_database(url, rebuild=True).dispose()
        with reading(registry) as connection:
            assert connection.execute(text("SELECT count(*) FROM registry_participants")).scalar_one() == 1


def test_only_the_ledgers_of_a_study_are_listed(lab):
    path = lab.start()
    for name in ("toy_two_P001_s1.sqlite", "toy_P001_s1.sqlite-wal", ".toy_P003_s1.sqlite", "lab.sqlite"):
        shutil.copy(path, path.with_name(name))
    assert ledgers_in(lab.path, "toy") == [ledger_path(lab.path, "toy", "P001")]
    assert len(ledgers_in(lab.path)) == 2


@pytest.mark.needs("psycopg", "postgres")
def test_stations_that_collect_at_once_wait_for_each_other(lab):
    path, start = lab.start("P001"), Barrier(6)

    def station(url):
        start.wait(30)
        own = open_database(url)
        try:
            return [result.what for result in collect([path], own)]
        finally:
            own.dispose()

    with postgres_schema() as url, ThreadPoolExecutor(6) as stations:
        results = [what for whats in stations.map(station, [url] * 6) for what in whats]
    assert sorted(results) == ["new", *["unchanged"] * 5]
