"""Writing a ledger: one SQLite file per session, one commit per event, on disk before the next act.

So kill -9 or a power cut loses at most the act under way; `palpate.studies.sessions.session.resume` goes on from there.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from sqlalchemy import Connection, Engine, insert, text
from sqlalchemy.exc import OperationalError, SQLAlchemyError

from palpate.protocols.canonical import canonical
from palpate.protocols.events import Event, event_hash
from palpate.protocols.files import make_folder, sync_folder
from palpate.studies.messages import database_reason
from palpate.studies.sessions.ledger_schema import (
    APPLICATION_ID,
    CHECKPOINTED,
    FORMAT,
    SEED,
    engine_to_write,
    events,
    metadata,
    run_note_hash,
    run_notes,
    samples,
)
from palpate.studies.sessions.record import LedgerError, Record, read

Shield = Callable[[], AbstractContextManager[object]]


def create(path: Path, header: Mapping[str, Any], run_note: Mapping[str, Any]) -> None:
    """Create a ledger that holds session_started; it appears under its name atomically.

    Raises LedgerError if the name is taken or the disk is full.
    """
    make_folder(path.parent)
    # A log that a ledger of this name left behind would be taken for the new one's.
    log = path.with_name(f"{path.name}-wal")
    if log.exists() and not path.exists():
        raise LedgerError(f"{log}: belongs to a ledger that is gone; bring that ledger back, or move this file away")
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    draft.unlink(missing_ok=True)
    try:
        with ledger_errors(path, "its first event"):
            _write_first(draft, header, run_note)
        # Give the draft its name, unless the name is taken (FileExistsError).
        try:
            os.link(draft, path)
        except FileExistsError:
            raise
        except OSError:
            # A file system without hard links: claim the name, then put the draft in its place.
            path.open("x").close()
            draft.replace(path)
    except FileExistsError:
        raise LedgerError(f"{path}: a session of this name exists already") from None
    finally:
        draft.unlink(missing_ok=True)
    sync_folder(path.parent)


def _write_first(draft: Path, header: Mapping[str, Any], run_note: Mapping[str, Any]) -> None:
    engine = engine_to_write(str(draft))
    try:
        metadata.create_all(engine)
        with engine.begin() as connection:
            connection.execute(text(f"PRAGMA application_id={APPLICATION_ID}"))
            connection.execute(text(f"PRAGMA user_version={FORMAT}"))
            first = Event(0, 0, "session_started", canonical(header))
            head = event_hash(SEED, first)
            _insert_event(connection, first, head)
            _insert_run_note(connection, 0, SEED, "created", (1, head), {**run_note, CHECKPOINTED: True})
        _to_plain_file(engine)
    finally:
        engine.dispose()


@contextmanager
def ledger_errors(path: Path, what: str) -> Iterator[None]:
    """Turn a failed write into a LedgerError that says what could not be written and why."""
    try:
        yield
    except SQLAlchemyError as error:
        raise LedgerError(f"{path}: {what} could not be recorded: {database_reason(error)}") from error


@dataclass
class Ledger:
    """An open ledger: the session so far, and its only writer."""

    record: Record
    engine: Engine
    connection: Connection
    lock: FileLock
    shield: Shield = nullcontext
    head: str = field(init=False)
    written: int = field(init=False)
    status: str = field(init=False)
    last_run_note: str = field(init=False)
    run_note_count: int = field(init=False)

    def __post_init__(self) -> None:
        self.head, self.written = self.record.head, len(self.record.events)
        self.status, self.last_run_note = self.record.status, self.record.run_notes[-1].hash
        self.run_note_count = len(self.record.run_notes)

    def append(self, event: Event) -> None:
        """Write the event and its samples; they are on the disk when this returns."""
        if event.seq != self.written:
            raise LedgerError(f"{self.record.path}: event {event.seq} offered, event {self.written} is next")
        link = event_hash(self.head, event)
        with self.shield():
            with ledger_errors(self.record.path, f"event {event.seq}"), self.connection.begin():
                _insert_event(self.connection, event, link)
            self.head, self.written = link, self.written + 1
            self.status = event.ended_as or "interrupted"

    def record_run_note(self, kind: str, body: Mapping[str, Any]) -> None:
        """Record that a process opened or closed the ledger."""
        with ledger_errors(self.record.path, f"the note that it was {kind}"), self.connection.begin():
            at = (self.written, self.head)
            self.last_run_note = _insert_run_note(
                self.connection, self.run_note_count, self.last_run_note, kind, at, body
            )
        self.run_note_count += 1

    def close(self, body: Mapping[str, Any]) -> None:
        """Close the ledger, leaving one plain file, and release its lock."""
        try:
            self.record_run_note("closed", body)
        finally:
            self.connection.close()
            with suppress(SQLAlchemyError):
                _to_plain_file(self.engine)
            self.engine.dispose()
            self.lock.release()


@dataclass
class Watched:
    """A ledger that calls `watch` with every event once it is written; `planned` counts the events handed over."""

    ledger: Ledger
    planned: int
    watch: Callable[[Event], None] = lambda _event: None

    def append(self, event: Event) -> None:
        """Write the event, then call `watch`."""
        with self.ledger.shield():
            self.ledger.append(event)
            self.planned += 1
        self.watch(event)


def open_for_append(
    path: Path,
    run_note: Mapping[str, Any],
    shield: Shield = nullcontext,
    demand: Callable[[Record], object] = lambda _record: None,
) -> Ledger:
    """Open a ledger to append events; everything in it is verified first, and `demand` may refuse it before any change.

    Raises LedgerError if the file is refused (see `palpate.studies.sessions.record.read`) or another process has it.
    """
    if not path.is_file():
        raise LedgerError(f"{path}: no such ledger")
    lock = _locked(path)
    try:
        record = read(path)
        demand(record)
        engine = engine_to_write(str(path))
        ledger = Ledger(record, engine, engine.connect(), lock, shield)
        ledger.record_run_note("opened", run_note)
        ledger.connection.exec_driver_sql("PRAGMA wal_checkpoint(FULL)")
        ledger.connection.rollback()  # of the transaction that SQLAlchemy begins by itself
    except OperationalError as error:
        lock.release()
        raise LedgerError(f"{path}: cannot be written ({database_reason(error)})") from None
    except BaseException:
        lock.release()
        raise
    return ledger


def _locked(path: Path) -> FileLock:
    path = path.resolve()
    folder = path.parent / ".locks"
    folder.mkdir(exist_ok=True)
    lock = FileLock(folder / f"{path.name}.lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise LedgerError(f"{path}: another process is running this session") from None
    return lock


def _insert_event(connection: Connection, event: Event, link: str) -> None:
    connection.execute(
        insert(events),
        {
            "seq": event.seq,
            "t_ns": event.t_ns,
            "kind": event.kind,
            "trial": event.trial,
            "attempt": event.attempt,
            "body": event.body.decode(),
            "hash": link,
        },
    )
    for number, block in enumerate(event.samples):
        row = {"seq": event.seq, "block": number, "stream": block.stream}
        connection.execute(insert(samples), {**row, "form": block.form().decode(), "data": block.data})


def _insert_run_note(
    connection: Connection, n: int, previous: str, kind: str, at: tuple[int, str], body: Mapping[str, Any]
) -> str:
    (count, head), text_body = at, canonical(body).decode()
    link = run_note_hash(previous, n, kind, count, head, text_body)
    row = {"n": n, "kind": kind, "events": count, "head": head, "body": text_body, "hash": link}
    connection.execute(insert(run_notes), row)
    return link


def _to_plain_file(engine: Engine) -> None:
    """Fold the write-ahead log into the file, so that the session is one file that can be copied anywhere.

    A reader at that moment is waited for, a second at most.
    """
    with engine.connect() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
        for patience in reversed(range(50)):
            try:
                connection.exec_driver_sql("PRAGMA journal_mode=DELETE")
                return
            except OperationalError:
                if not patience:
                    raise
                time.sleep(0.02)
