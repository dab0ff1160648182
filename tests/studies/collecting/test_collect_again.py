"""Collecting again reads only what changed, and leaves the database as a full rebuild would make it."""

import os
import shutil
import sqlite3

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from sqlalchemy import select

from palpate.studies.collecting import collect as collecting
from palpate.studies.collecting import schema
from palpate.studies.collecting.collect import CollectError, Collector, collect, open_database
from palpate.studies.sessions.record import LedgerError
from palpate.studies.sessions.session_files import ledger_path, ledgers_in
from tests.studies.labs import Lab

PEOPLE = ("P001", "P002", "P003")
LENGTHS = (9, 16, None)
"""How many events of a session lie in its file, one after another; None: all."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(participant, length) -> a ledger of so many events."""
    ledgers = {}
    for who in PEOPLE:
        for length in LENGTHS:
            lab = Lab(tmp_path_factory.mktemp(f"{who}_{length}"))
            ledgers[who, length] = lab.start(who) if length is None else lab.cut(length, who)
    return ledgers


@pytest.fixture
def reads(monkeypatch):
    """The names of the ledgers that were read whole, in order."""
    names = []

    def read(path):
        names.append(path.name)
        return whole(path)

    whole = collecting.read
    monkeypatch.setattr(collecting, "read", read)
    return names


def put(ledger, lab, who):
    """Lay a ledger, with its write-ahead log where it has one, in the place of the participant's."""
    place = ledger_path(lab, "toy", who)
    place.parent.mkdir(exist_ok=True)
    for ending in ("", "-wal", "-shm"):
        place.with_name(place.name + ending).unlink(missing_ok=True)
        if (source := ledger.with_name(ledger.name + ending)).exists():
            shutil.copy(source, place.with_name(place.name + ending))
    return place


def contents(engine, sessions):
    """Every row of these sessions, table by table, and of what they refer to."""
    rows = {}
    with engine.connect() as connection:
        for name, table in schema.metadata.tables.items():
            table_rows = [tuple(row) for row in connection.execute(select(table))]
            where = list(table.c).index(table.c.session) if "session" in table.c else None
            rows[name] = sorted(row for row in table_rows if where is None or row[where] in sessions)
    return rows


actions = st.one_of(
    st.tuples(st.sampled_from(["grow", "grow", "grow", "withdraw", "remove", "touch"]), st.sampled_from(PEOPLE)),
    st.tuples(st.just("collect"), st.none()),
)


@settings(
    max_examples=6,
    deadline=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.lists(actions, min_size=5, max_size=10))
def test_the_database_is_as_a_rebuild_makes_it_whatever_happened_between(recorded, tmp_path_factory, acts):
    lab = tmp_path_factory.mktemp("lab")
    engine = open_database(f"sqlite:///{lab / 'lab.sqlite'}")
    length, withdrawn, ever = dict.fromkeys(PEOPLE, -1), set(), set()
    for act, who in [*acts, ("collect", None)]:
        place = ledger_path(lab, "toy", who or "")
        if act == "grow":
            length[who] = min(length[who] + 1, len(LENGTHS) - 1)
            put(recorded[who, LENGTHS[length[who]]], lab, who)
        elif act == "withdraw":
            withdrawn ^= {who}
        elif act == "touch" and place.exists():
            os.utime(place, ns=(1, 10**18))
        elif act == "remove":
            place.unlink(missing_ok=True)
        elif act == "collect":
            there = {f"toy/{path.stem.split('_')[1]}/1" for path in ledgers_in(lab)}
            ever |= there
            list(collect(ledgers_in(lab), engine, frozenset(withdrawn)))
            rebuilt = open_database("sqlite://")
            list(collect(ledgers_in(lab), rebuilt, frozenset(withdrawn)))
            expected = contents(rebuilt, there)
            actual = contents(engine, there)
            assert {**actual, "participants": [], "studies": []} == {**expected, "participants": [], "studies": []}
            assert set(expected["participants"]) <= set(actual["participants"])
            with engine.connect() as connection:  # one whose ledger is gone is kept
                assert set(connection.execute(select(schema.sessions.c.session)).scalars()) == ever
            rebuilt.dispose()
    engine.dispose()


def test_only_what_changed_is_read(recorded, tmp_path, reads):
    engine = open_database(f"sqlite:///{tmp_path / 'lab.sqlite'}")
    places = {who: put(recorded[who, 9], tmp_path, who) for who in PEOPLE}
    assert [result.what for result in collect(ledgers_in(tmp_path), engine)] == ["new"] * 3
    reads.clear()
    assert [result.what for result in collect(ledgers_in(tmp_path), engine)] == ["unchanged"] * 3 and reads == []
    put(recorded["P002", None], tmp_path, "P002")
    os.utime(places["P003"], ns=(1, 10**18))
    results = list(collect(ledgers_in(tmp_path), engine, {"P001"}))
    assert [result.what for result in results] == ["updated", "updated", "unchanged"]
    assert reads == [f"toy_{who}_s1.sqlite" for who in PEOPLE]
    reads.clear()
    results = list(collect(ledgers_in(tmp_path), engine, {"P001"}))
    assert [result.what for result in results] == ["unchanged"] * 3 and not reads
    assert [result.what for result in collect(ledgers_in(tmp_path), engine)] == ["updated", "unchanged", "unchanged"]
    assert reads == ["toy_P001_s1.sqlite"]  # came back: withdrawn no longer
    engine.dispose()


def test_what_is_in_the_write_ahead_log_is_a_change(recorded, tmp_path, reads):
    engine = open_database(f"sqlite:///{tmp_path / 'lab.sqlite'}")
    place = put(recorded["P001", 9], tmp_path, "P001")
    list(collect([place], engine))
    with sqlite3.connect(place) as running:
        running.execute("PRAGMA journal_mode=WAL")
        running.execute("PRAGMA user_version = 3")
        running.commit()
        state = place.stat()
        reads.clear()
        list(collect([place], engine))
        assert reads and place.stat().st_size == state.st_size
    running.close()
    engine.dispose()


def meddle(place, statement):
    """Change a ledger behind its back: size and time of change stay as they were."""
    before = place.stat()
    connection = sqlite3.connect(place)
    connection.execute(statement)
    connection.commit()
    connection.close()
    os.utime(place, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert place.stat().st_size == before.st_size and place.stat().st_mtime_ns == before.st_mtime_ns


def test_a_changed_ledger_of_the_same_size_and_time_is_refused_by_verify(recorded, tmp_path):
    engine = open_database(f"sqlite:///{tmp_path / 'lab.sqlite'}")
    place = put(recorded["P001", None], tmp_path, "P001")
    list(collect([place], engine))
    meddle(place, "UPDATE events SET t_ns = t_ns + 1 WHERE seq = 3")
    assert Collector(engine).bring(place).what == "unchanged"
    with pytest.raises(LedgerError, match="the hash chain breaks at event 3"):
        Collector(engine, verify=True).bring(place)
    meddle(place, "UPDATE events SET hash = printf('%064d', 0) WHERE seq = (SELECT max(seq) FROM events)")
    with pytest.raises(LedgerError, match="the hash chain breaks at event 3"):  # the last hash alone shows it
        Collector(engine).bring(place)
    engine.dispose()


def test_a_session_run_anew_is_refused_until_the_database_is_rebuilt(recorded, tmp_path):
    engine = open_database(f"sqlite:///{tmp_path / 'lab.sqlite'}")
    list(collect([put(recorded["P001", None], tmp_path, "P001")], engine))
    anew = put(Lab(tmp_path / "anew").start("P001", title="Another"), tmp_path, "P001")
    with pytest.raises(CollectError, match="is another session, or was changed"):
        list(collect([anew], engine))
    engine.dispose()


def test_a_database_collected_before_there_were_states_of_files_is_read_once_more(recorded, tmp_path, reads):
    url = f"sqlite:///{tmp_path / 'lab.sqlite'}"
    engine = open_database(url)
    place = put(recorded["P001", None], tmp_path, "P001")
    list(collect([place], engine))
    with engine.begin() as connection:
        schema.ledgers.drop(connection)
    engine.dispose()
    reads.clear()
    engine = open_database(url)
    assert [result.what for _ in range(2) for result in collect([place], engine)] == ["unchanged"] * 2
    assert len(reads) == 1
    engine.dispose()


def test_several_processes_read_the_same_and_name_each_refused_ledger(recorded, tmp_path):
    """The database is that of one process, and a ledger that cannot be trusted stops no other."""
    places = [put(recorded[who, None], tmp_path, who) for who in PEOPLE]
    meddle(places[1], "UPDATE events SET t_ns = t_ns + 1 WHERE seq = 3")
    whole, one, two = [], *(open_database(f"sqlite:///{tmp_path / name}") for name in ("one.sqlite", "two.sqlite"))
    for engine, workers in ((one, 1), (two, 2)):
        rows = list(Collector(engine).bring_all(places, workers))
        assert [type(row).__name__ for row in rows] == ["Collected", "Refused", "Collected"]
        assert rows[1].path == places[1] and "hash chain breaks at event 3" in rows[1].problem
        whole.append(contents(engine, {row.session for row in (rows[0], rows[2])}))
        engine.dispose()
    assert whole[0] == whole[1] and len(whole[0]["sessions"]) == 2
