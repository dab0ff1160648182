"""A ledger's samples stay in the file until they are read, and are unchanged."""

import hashlib
import sqlite3
import tracemalloc
from pathlib import Path

import pytest

from palpate.protocols.canonical import canonical
from palpate.protocols.events import Event, Samples
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import SMALL_BYTES, SamplesGone, StoredSamples, read
from palpate.studies.sessions.tables import tables
from tests.studies.labs import HEADER

AT = {"at": "2026-01-01T00:00:00+00:00"}
RECORDED = Path(__file__).parents[2] / "recorded" / "ten"
CHANNELS, UNITS = ("x", "y", "z"), ("N",) * 3


def block(number, count=20_000):
    data = bytes([number]) * (12 * count)
    return Samples("force", CHANNELS, UNITS, 8000.0, number, data, number * count, "daq")


def ledger(path, blocks, header=None):
    create(path, header or HEADER, AT)
    open_ledger = open_for_append(path, AT)
    for number, block in enumerate(blocks, start=1):
        open_ledger.append(Event(number, number, "experimenter", canonical({"do": "note"}), samples=(block,)))
    open_ledger.close(AT)
    return path


def test_large_blocks_are_read_when_they_are_asked_for(tmp_path):
    path = ledger(tmp_path / "a.sqlite", [block(n) for n in range(1, 101)])  # 24 MB
    tracemalloc.start()
    record = read(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 5_000_000, "not one recording of 24 MB is kept in memory"
    samples = [event.samples[0] for event in record.events[1:]]
    assert all(isinstance(stored, StoredSamples) for stored in samples)
    assert samples[41] == block(42) and block(42) == samples[41] and samples[41] != block(43)
    assert samples[41].data == block(42).data and (samples[41].first, samples[41].clock) == (840_000, "daq")
    assert read(path).events == record.events


def test_a_session_is_collected_without_its_samples_in_memory(tmp_path):
    header = read(RECORDED / "door_capture_P001_s1.sqlite").header
    path = ledger(tmp_path / "a.sqlite", [block(n) for n in range(1, 101)], header)  # 24 MB
    tracemalloc.start()
    collected = tables(read(path))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 5_000_000
    assert [row["samples"] for row in collected.streams] == [20_000] * 100
    assert collected.session["file_sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()


def test_small_blocks_stay_in_memory(tmp_path):
    path = ledger(tmp_path / "a.sqlite", [block(1, SMALL_BYTES // 12)])
    assert type(read(path).events[1].samples[0]) is Samples


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("update samples set data=zeroblob(240000)", "are not those that were there"),
        ("delete from samples", "any more"),
    ],
)
def test_samples_that_changed_since_are_refused(tmp_path, statement, message):
    path = ledger(tmp_path / "a.sqlite", [block(1)])
    [stored] = read(path).events[1].samples
    connection = sqlite3.connect(path)
    connection.execute(statement)
    connection.commit()
    connection.close()
    with pytest.raises(SamplesGone, match=message):
        _ = stored.data


def test_a_missing_ledger_is_reported(tmp_path):
    path = ledger(tmp_path / "a.sqlite", [block(1)])
    [stored] = read(path).events[1].samples
    path.unlink()
    with pytest.raises(SamplesGone, match="cannot be read any more"):
        _ = stored.data
