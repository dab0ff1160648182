"""The tables of a ledger file, how the file is opened, and the chain of hashes over its runs."""

from __future__ import annotations

import hashlib
import os
import sqlite3
from typing import Any
from urllib.parse import quote

from sqlalchemy import URL, Column, Engine, Integer, LargeBinary, MetaData, Table, Text, create_engine, event

from palpate.protocols.canonical import canonical

_DRIVER = "sqlite+pysqlite"
FORMAT = 3
"""3: samples as they come, and faults. 2: forms, tasks and what the experimenter does. Older ones can still be read."""
APPLICATION_ID = 0x50414C50
"""'PALP' in the file's header: how a ledger is known from any other SQLite file."""
SEED = hashlib.sha256(b"palpate ledger").hexdigest()

CHECKPOINTED = "checkpointed"
"""A key in the note of a ledger's creation.

Whoever opens the ledger writes a note of that into the file itself, not only its log, before the first act.
"""

DURABLE = ("synchronous=EXTRA", "fullfsync=ON")
"""A commit is on the disk when it returns. EXTRA syncs as FULL does, and the folder, too, after a rollback journal was
removed, without which a power cut can bring the journal back and undo the commit. On macOS, `fullfsync` has the drive
empty its own memory; elsewhere it does nothing."""

metadata = MetaData()
events = Table(
    "events",
    metadata,
    Column("seq", Integer, primary_key=True, autoincrement=False),
    Column("t_ns", Integer, nullable=False),
    Column("kind", Text, nullable=False),
    Column("trial", Integer),
    Column("attempt", Integer),
    Column("body", Text, nullable=False),
    Column("hash", Text, nullable=False),
)
samples = Table(
    "samples",
    metadata,
    Column("seq", Integer, primary_key=True, autoincrement=False),
    Column("block", Integer, primary_key=True, autoincrement=False),
    Column("stream", Text, nullable=False),
    Column("form", Text, nullable=False),
    Column("data", LargeBinary, nullable=False),
)
run_notes = Table(
    "sittings",
    metadata,
    Column("n", Integer, primary_key=True, autoincrement=False),
    Column("kind", Text, nullable=False),
    Column("events", Integer, nullable=False),
    Column("head", Text, nullable=False),
    Column("body", Text, nullable=False),
    Column("hash", Text, nullable=False),
)


def run_note_hash(previous: str, n: int, kind: str, events_then: int, head: str, body: str) -> str:
    """Return a link of the chain of runs."""
    return hashlib.sha256(previous.encode() + canonical([n, kind, events_then, head, body])).hexdigest()


def connect_to_read(path: str, mode: str = "ro") -> sqlite3.Connection:
    """Open a ledger file only to read it; with `rw`, SQLite may recover what a crash left unfinished.

    This does without SQLAlchemy, which would take longer for each row than the reading.
    """
    return sqlite3.connect(f"file:{quote(os.fsencode(path))}?mode={mode}", uri=True)


def engine_to_write(path: str) -> Engine:
    """Return a SQLAlchemy engine on a ledger file whose commits are on the disk when they return (WAL; see DURABLE)."""
    engine = create_engine(URL.create(_DRIVER, database=path))

    @event.listens_for(engine, "connect")
    def durable(connection: Any, _record: Any) -> None:
        connection.execute("PRAGMA journal_mode=WAL")
        for pragma in DURABLE:
            connection.execute(f"PRAGMA {pragma}")

    return engine
