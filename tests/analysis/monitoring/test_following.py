from __future__ import annotations

import sqlite3
from dataclasses import replace

import pytest

from palpate.analysis.monitoring import following
from palpate.analysis.monitoring.following import catch_up, follow
from palpate.studies.sessions.ledger import open_for_append
from palpate.studies.sessions.ledger_state import file_state, held
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.session_files import ledger_path
from tests.studies.labs import Lab

AT = {"at": "2026-01-01T00:00:00+00:00"}


@pytest.fixture
def lab(tmp_path):
    return Lab(tmp_path)


def growing(lab, first):
    """A ledger of `first` events, open for writing, and the events still to come."""
    path = lab.cut(first)
    whole = read(ledger_path(lab.path / "whole", "toy", "P001"))
    return path, open_for_append(path, AT), whole.events[first:]


def no_second_reading(monkeypatch):
    monkeypatch.setattr(following, "read", lambda path: pytest.fail(f"{path} was read whole again"))


def test_a_ledger_followed_event_by_event_comes_to_what_it_comes_to_read_whole(lab, monkeypatch):
    path, ledger, rest = growing(lab, 3)
    followed = follow(path)
    with monkeypatch.context() as patched:
        no_second_reading(patched)
        for event in rest:
            ledger.append(event)
            followed = catch_up(followed)
        ledger.close({**AT, "because": "complete"})
        followed = catch_up(followed)
    anew = follow(path)
    assert followed == replace(anew, file=followed.file, lacks_wal=followed.lacks_wal)
    assert followed.laid_down


def test_a_file_that_did_not_change_is_not_opened(lab, monkeypatch):
    followed = follow(lab.start())
    monkeypatch.setattr(following, "connect_to_read", lambda *_: pytest.fail("the ledger was opened"))
    assert catch_up(followed) is followed


def test_following_leaves_every_byte_of_a_running_session_alone(lab):
    path, ledger, rest = growing(lab, 5)
    followed = follow(path)
    ledger.append(rest[0])
    files = [path, path.with_name(f"{path.name}-wal")]
    before = [(file.read_bytes(), file.stat().st_mtime_ns) for file in files]
    catch_up(followed)
    assert [(file.read_bytes(), file.stat().st_mtime_ns) for file in files] == before
    ledger.close({**AT, "because": "complete"})


def test_a_session_that_was_watched_ends_as_one_plain_file(lab):
    path, ledger, rest = growing(lab, 5)
    followed = follow(path)
    for event in rest:
        ledger.append(event)
        followed = catch_up(followed)
    ledger.close({**AT, "because": "complete"})
    assert [file.name for file in path.parent.iterdir() if file.name.startswith(path.name)] == [path.name]


@pytest.mark.parametrize("column", ["body", "hash"])
def test_an_event_that_was_changed_before_it_was_seen_is_refused(lab, column):
    path, ledger, rest = growing(lab, 20)
    followed = follow(path)
    for event in rest[:4]:
        ledger.append(event)
    ledger.close({**AT, "because": "interrupted"})
    with sqlite3.connect(path) as connection:
        connection.execute(f"UPDATE events SET {column} = {column} || ' ' WHERE seq = 21")
    connection.close()
    with pytest.raises(LedgerError, match="event 2"):
        catch_up(followed)


def test_another_session_in_the_files_place_is_read_whole(lab):
    path = lab.start("P001")
    followed = follow(path)
    other = lab.start("P002")
    other.replace(path)
    assert catch_up(followed).session.header["participant"] == "P002"


def test_a_ledger_is_held_while_a_process_has_it_and_trying_that_lock_takes_it_from_nobody(lab):
    path = lab.cut(5)
    assert not held(path)
    ledger = open_for_append(path, AT)
    assert held(path)
    assert held(path)
    ledger.close({**AT, "because": "interrupted"})
    assert not held(path)
    open_for_append(path, AT).close({**AT, "because": "interrupted"})


def test_a_commit_to_the_write_ahead_log_alone_changes_the_files_state(lab):
    path, ledger, rest = growing(lab, 5)
    before, size = file_state(path), path.stat().st_size
    ledger.append(rest[0])
    assert path.stat().st_size == size
    assert file_state(path) != before
    ledger.close({**AT, "because": "interrupted"})
