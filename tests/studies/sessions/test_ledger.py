import random
import shutil
import sqlite3
import threading
from contextlib import closing
from dataclasses import replace

import pytest
from sqlalchemy.exc import OperationalError

from palpate.protocols.canonical import canonical
from palpate.protocols.events import Event, Samples
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.ledger_schema import FORMAT
from palpate.studies.sessions.record import LedgerError, read
from tests.studies.labs import HEADER

NOTE = b'{"do":"note"}'
RUN_START = {"at": "2026-01-01T00:00:00+00:00"}
BLOCK = Samples("door", ("angle", "force"), ("deg", "N"), 100.0, 5, bytes(range(256)))


def write_ledger(tmp_path, events=3):
    path = tmp_path / "s.sqlite"
    create(path, HEADER, RUN_START)
    ledger = open_for_append(path, RUN_START)
    for seq in range(1, events):
        ledger.append(
            Event(
                seq,
                seq * 1000,
                "experimenter",
                canonical({"do": "note", "n": seq}),
                samples=(BLOCK,) if seq % 40 == 1 else (),
            )
        )
    ledger.close({**RUN_START, "because": "complete"})
    return path


def test_what_was_appended_is_read_back(tmp_path):
    record = read(write_ledger(tmp_path))
    assert [e.seq for e in record.events] == [0, 1, 2]
    assert record.events[1].samples == (BLOCK,) and BLOCK.count == 32
    assert record.events[2].value == {"do": "note", "n": 2}
    assert [s.kind for s in record.run_notes] == ["created", "opened", "closed"]
    assert record.header == HEADER and not record.complete
    assert record.run_notes[-1].value == {**RUN_START, "because": "complete"}


def test_a_closed_ledger_is_one_plain_file(tmp_path):
    path = write_ledger(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == [".locks", path.name]
    with sqlite3.connect(path) as plain:
        assert plain.execute("pragma journal_mode").fetchone() == ("delete",)
        assert plain.execute("select count(*) from events").fetchone() == (3,)
    plain.close()


def test_every_event_is_durable_when_append_returns(tmp_path):
    """Another connection sees the event at once, and the file is written through: WAL, synchronous FULL."""
    path = tmp_path / "s.sqlite"
    create(path, HEADER, RUN_START)
    ledger = open_for_append(path, RUN_START)
    for seq in range(1, 5):
        ledger.append(Event(seq, seq, "experimenter", NOTE))
        assert len(read(path).events) == seq + 1
    modes = [ledger.connection.exec_driver_sql(f"pragma {p}").scalar() for p in ("journal_mode", "synchronous")]
    ledger.connection.rollback()
    ledger.close(RUN_START)
    assert modes == ["wal", 3]


def test_a_name_is_taken_once(tmp_path):
    path = write_ledger(tmp_path)
    with pytest.raises(LedgerError, match="a session of this name exists already"):
        create(path, HEADER, RUN_START)
    assert not list(tmp_path.glob("*draft*"))


def test_a_file_system_without_hard_links_is_no_obstacle(tmp_path, monkeypatch):
    def refused(*_paths):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.link", refused)
    path = write_ledger(tmp_path)
    assert len(read(path).events) == 3
    with pytest.raises(LedgerError, match="exists already"):
        create(path, HEADER, RUN_START)
    assert len(read(path).events) == 3


def test_only_one_process_writes(tmp_path):
    path = write_ledger(tmp_path)
    ledger = open_for_append(path, RUN_START)
    with pytest.raises(LedgerError, match="another process is running this session"):
        open_for_append(path, RUN_START)
    ledger.close(RUN_START)
    open_for_append(path, RUN_START).close(RUN_START)


def test_an_event_out_of_turn_is_refused(tmp_path):
    ledger = open_for_append(write_ledger(tmp_path), RUN_START)
    with pytest.raises(LedgerError, match="event 7 offered, event 3 is next"):
        ledger.append(Event(7, 0, "experimenter", NOTE))
    ledger.close(RUN_START)


def test_a_full_disk_is_reported_and_what_was_written_stays(tmp_path):
    path = write_ledger(tmp_path)
    ledger = open_for_append(path, RUN_START)
    ledger.connection.exec_driver_sql("pragma max_page_count=1")
    ledger.connection.commit()
    big = Samples("door", ("angle",), ("deg",), 1.0, 0, bytes(400_000))
    with pytest.raises(LedgerError, match=r"event 3 could not be recorded: .*full"):
        ledger.append(Event(3, 9999, "experimenter", NOTE, samples=(big,)))
    ledger.close({**RUN_START, "because": "failed"})
    assert len(read(path).events) == 3


def change(path, *statements):
    connection = sqlite3.connect(path)
    for statement in statements:
        connection.execute(statement)
    connection.commit()
    connection.close()


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("update events set body='{\"n\":3}' where seq=1", "the hash chain breaks at event 1"),
        ("update events set t_ns=7 where seq=2", "the hash chain breaks at event 2"),
        ("update events set trial=2 where seq=2", "the hash chain breaks at event 2"),
        ("update events set hash='00' where seq=0", "the hash chain breaks at event 0"),
        ("delete from events where seq=1", "the hash chain breaks at event 1"),
        (
            "insert into events select -1, t_ns, kind, trial, attempt, body, hash from events where seq=0",
            "chain breaks",
        ),
        ("delete from events where seq=2", "cut short: of 3 events when it was closed, 2 are left"),
        ("delete from events", "no session_started"),
        ("update samples set data=zeroblob(256)", "the hash chain breaks at event 1"),
        ("update samples set form=replace(form,'100.0','200.0')", "the hash chain breaks at event 1"),
        ("update samples set form='{}'", "the samples of event 1 are damaged"),
        ("update samples set form='['", "the samples of event 1 are damaged"),
        ("update samples set seq=9", "the hash chain breaks at event 1"),
        ("insert into samples select 9, 0, stream, form, data from samples", "samples without their event"),
        ("update sittings set body='{}' where n=2", r"the record of runs was changed or is damaged \(run 2\)"),
        ("delete from sittings where n=1", r"runs was changed or is damaged \(run 1\)"),
        ("delete from sittings", "no run of the session is recorded"),
        ("drop table sittings", r"the file is damaged \(no such table: sittings\)"),
        ("update events set body=x'ff' where seq=1", "damaged|hash chain breaks"),
        ("update events set t_ns='soon' where seq=1", "damaged|hash chain breaks"),
        ("pragma user_version=4", f"written in ledger format 4 by a newer Palpate; this one reads up to {FORMAT}"),
        ("pragma user_version=0", "ledger format 0 does not exist"),
        ("pragma application_id=1", "not a Palpate ledger"),
    ],
)
def test_a_changed_file_is_refused_with_its_reason(tmp_path, statement, message):
    path = write_ledger(tmp_path)
    change(path, statement)
    with pytest.raises(LedgerError, match=message) as caught:
        read(path)
    assert str(path) in str(caught.value)
    with pytest.raises(LedgerError, match=message):
        open_for_append(path, RUN_START)


def test_events_rewritten_with_a_good_chain_do_not_match_the_notes_of_runs(tmp_path):
    """Whoever rewrites the last event and its hash still has to explain the entry of its closing."""
    from palpate.protocols.events import event_hash

    path = write_ledger(tmp_path)
    record = read(path)
    forged = replace(record.events[2], body=b'{"do":"note","n":9}')
    link = event_hash(record.hashes[1], forged)
    change(path, f"update events set body='{forged.body.decode()}', hash='{link}' where seq=2")
    with pytest.raises(LedgerError, match="the events are not those that were there when it was closed"):
        read(path)


def test_a_truncated_file_is_refused_at_any_length(tmp_path):
    path = write_ledger(tmp_path, events=40)
    whole = path.read_bytes()
    for length in [0, 1, 15, 16, 50, 99, 100, *range(1000, len(whole), 1777), len(whole) - 1]:
        path.write_bytes(whole[:length])
        with pytest.raises(LedgerError):
            read(path)


def test_a_flipped_bit_is_refused_or_lies_where_nothing_is_stored(tmp_path):
    """60 seeded flips: a file that is still read holds exactly what it held."""
    path = write_ledger(tmp_path, events=300)
    whole, before = path.read_bytes(), read(path)
    chance, refused = random.Random(20261121), 0
    for _ in range(60):
        bit = chance.randrange(len(whole) * 8)
        changed = bytearray(whole)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        try:
            after = read(path)
        except LedgerError:
            refused += 1
        else:
            assert (after.events, after.hashes, after.run_notes) == (before.events, before.hashes, before.run_notes)
    assert refused > 30


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such ledger"),
        (b"", "not a ledger"),
        (b"id,value\n1,2\n", "not a ledger"),
    ],
)
def test_what_is_no_ledger_is_refused(tmp_path, content, message):
    path = tmp_path / "x.sqlite"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(LedgerError, match=message):
        read(path)
    with pytest.raises(LedgerError, match=message):
        open_for_append(path, RUN_START)


def test_another_sqlite_file_is_refused(tmp_path):
    path = tmp_path / "x.sqlite"
    change(path, "create table events (seq)")
    with pytest.raises(LedgerError, match="not a Palpate ledger"):
        read(path)


def test_a_folder_name_with_odd_characters_is_no_obstacle(tmp_path):
    folder = tmp_path / "a #1 100% lab?"
    folder.mkdir()
    assert len(read(write_ledger(folder)).events) == 3


def test_a_write_that_a_crash_left_in_a_rollback_journal_is_undone(tmp_path):
    path = write_ledger(tmp_path, events=60)
    before = read(path)
    writer = sqlite3.connect(path, isolation_level=None)
    writer.executescript("pragma journal_mode=delete; pragma synchronous=full; pragma cache_size=1; begin;")
    writer.execute("update events set body = body || printf('%.*c', 3000, ' ')")
    crashed = tmp_path / "crashed.sqlite"
    shutil.copy(path, crashed)
    shutil.copy(f"{path}-journal", f"{crashed}-journal")
    writer.execute("rollback")
    writer.close()
    assert crashed.read_bytes() != path.read_bytes()
    assert read(crashed).events == before.events
    open_for_append(crashed, RUN_START).close(RUN_START)


def test_a_running_session_can_be_read_at_any_moment(tmp_path):
    path = tmp_path / "s.sqlite"
    create(path, HEADER, RUN_START)
    done = threading.Event()

    def write():
        ledger = open_for_append(path, RUN_START)
        for seq in range(1, 100):
            ledger.append(Event(seq, seq, "experimenter", NOTE, samples=(BLOCK, BLOCK)))
        ledger.close(RUN_START)
        done.set()

    writer = threading.Thread(target=write)
    writer.start()
    lengths = []
    while not done.is_set():
        lengths.append(len(read(path).events))
    writer.join()
    assert lengths == sorted(lengths) and len(set(lengths)) > 3
    assert len(read(path).events) == 100


def test_a_file_that_something_else_wrote_to_is_refused(tmp_path):
    path = write_ledger(tmp_path)
    change(path, "create table notes (x)")
    with pytest.raises(LedgerError, match="holds notes, which no ledger does"):
        read(path)


def test_time_that_runs_backwards_is_refused(tmp_path):
    path = tmp_path / "s.sqlite"
    create(path, HEADER, RUN_START)
    ledger = open_for_append(path, RUN_START)
    ledger.append(Event(1, 50, "experimenter", NOTE))
    ledger.append(Event(2, 49, "experimenter", NOTE))
    ledger.close(RUN_START)
    with pytest.raises(LedgerError, match="time runs backwards at event 2"):
        read(path)


def test_a_crashed_ledger_without_its_wal_file_is_known(tmp_path):
    path = tmp_path / "s.sqlite"
    create(path, HEADER, RUN_START)
    ledger = open_for_append(path, RUN_START)
    ledger.append(Event(1, 1, "experimenter", NOTE))
    alone = tmp_path / "alone.sqlite"
    shutil.copy(path, alone)
    assert read(alone).lacks_wal
    assert not read(path).lacks_wal
    ledger.close(RUN_START)
    assert not read(path).lacks_wal
    again = open_for_append(path, RUN_START)
    shutil.copy(path, alone)
    assert read(alone).lacks_wal and read(alone).run_notes[-1].kind == "opened"
    again.close(RUN_START)


def test_a_ledger_whose_power_failed_before_its_first_act_is_complete(tmp_path):
    path = tmp_path / "s.sqlite"
    create(path, HEADER, RUN_START)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
    assert path.read_bytes()[18:20] == b"\2\2" and not read(path).lacks_wal


def test_creating_a_ledger_on_a_full_disk_fails_with_a_message(tmp_path, monkeypatch):
    def full(*_arguments):
        raise OperationalError("INSERT", {}, Exception("database or disk is full"))

    monkeypatch.setattr("palpate.studies.sessions.ledger._insert_event", full)
    with pytest.raises(LedgerError, match="its first event could not be recorded: database or disk is full"):
        create(tmp_path / "s.sqlite", {}, RUN_START)
    assert list(tmp_path.iterdir()) == []


def test_a_log_that_a_lost_ledger_left_is_not_taken_over(tmp_path):
    path = write_ledger(tmp_path)
    log = path.with_name(f"{path.name}-wal")
    path.rename(tmp_path / "elsewhere.sqlite")
    log.write_bytes(b"events of another session")
    with pytest.raises(LedgerError, match=r"s\.sqlite-wal: belongs to a ledger that is gone"):
        write_ledger(tmp_path)
    assert log.read_bytes() == b"events of another session" and not path.exists()


def test_a_reader_at_the_last_instant_does_not_keep_the_log_alive(tmp_path):
    path = write_ledger(tmp_path)
    ledger = open_for_append(path, RUN_START)
    ledger.append(Event(3, 3000, "experimenter", canonical({"do": "note", "n": 3})))
    reading = threading.Event()

    def look():
        connection = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
        connection.execute("BEGIN")
        connection.execute("SELECT count(*) FROM events").fetchone()
        reading.set()
        closing.wait(10)
        connection.close()

    closing = threading.Event()
    reader = threading.Thread(target=look)
    reader.start()
    reading.wait(10)
    threading.Timer(0.1, closing.set).start()
    ledger.close(RUN_START)
    reader.join()
    assert path.read_bytes()[18:20] == b"\1\1" and not path.with_name(f"{path.name}-wal").exists()
