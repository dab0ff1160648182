"""Reading a ledger: every event is verified; anything newer, foreign, damaged or cut short is refused by name."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, fields, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import quote

from palpate.protocols.event_shapes import (
    OBJECT,
    TEXT,
    EventShapes,
    Kind,
    ShapeError,
    demand_fields,
    demand_header,
    demand_samples,
    parse_canonical,
)
from palpate.protocols.events import Event, Samples, event_hash
from palpate.protocols.session_state import Attempt, SessionState
from palpate.protocols.wording import count, some
from palpate.studies.sessions.ledger_schema import (
    APPLICATION_ID,
    CHECKPOINTED,
    FORMAT,
    SEED,
    connect_to_read,
    metadata,
    run_note_hash,
)

_UNFOUNDED = "samples without their event, or no session_started: the file was changed"
_MAGIC = b"SQLite format 3\0"
_EVENTS = "SELECT seq, t_ns, kind, trial, attempt, body, hash FROM events"
_SAMPLES = "SELECT seq, block, stream, form, data FROM samples"
_RUN_NOTES = "SELECT n, kind, events, head, body, hash FROM sittings ORDER BY n"


def _is_moment(value: Any) -> bool:
    try:
        return type(value) is str and bool(datetime.fromisoformat(value))
    except ValueError:
        return False


_NOTE = {"at": Kind(_is_moment, "a date and time")}, {"because": TEXT, "environment": OBJECT}
"""The keys that a note that a ledger was opened or closed must have, and those that it may have."""


class LedgerError(ValueError):
    """The file cannot be trusted or written; the message says why."""


@dataclass(frozen=True)
class RunNote:
    """A note that a process opened or closed the ledger: the time by the wall clock, the software, the reason."""

    kind: str
    events: int
    head: str
    body: str
    hash: str

    @property
    def value(self) -> Any:
        """The body as data."""
        return json.loads(self.body)

    @property
    def at_rest(self) -> bool:
        """Whether the file itself says, without a write-ahead log, that nobody has opened the ledger again."""
        return self.kind == "closed" or (self.kind == "created" and CHECKPOINTED in self.value)


@dataclass(frozen=True)
class Record:
    """A verified session."""

    path: Path
    events: tuple[Event, ...]
    hashes: tuple[str, ...]
    run_notes: tuple[RunNote, ...]
    state: SessionState
    """The state after the events: which attempt of each trial counts, what was answered, what is open."""
    lacks_wal: bool = False
    """Whether the session was interrupted and the -wal file that may hold its last events is missing."""

    @cached_property
    def header(self) -> dict[str, Any]:
        """The body of session_started: study, participant, plan digest, rig, versions."""
        value: dict[str, Any] = self.events[0].value
        return value

    @property
    def ended(self) -> bool:
        """Whether the session is over: nothing more can be added to it."""
        return self.events[-1].kind == "session_ended"

    @property
    def status(self) -> str:
        """`complete`; `aborted` by the experimenter; `declined` or `ineligible`; `interrupted`, to be resumed."""
        return self.events[-1].ended_as or "interrupted"

    @property
    def complete(self) -> bool:
        """Whether the session came to its regular end."""
        return self.status == "complete"

    @property
    def head(self) -> str:
        """The last link of the event chain."""
        return self.hashes[-1]

    def events_of(self, attempt: Attempt) -> tuple[Event, ...]:
        """Return the events of an attempt at a trial, from its start."""
        return self.events[attempt.first : None if attempt.last is None else attempt.last + 1]


def read(path: Path) -> Record:
    """Return the session in a file after verifying its chains link by link.

    Raises LedgerError on a file that is missing, not a ledger, newer, damaged, changed or cut short, or has events that
    no session writes (see `palpate.protocols.event_shapes`).
    """
    _demand_sqlite(path)
    # The file says that a write-ahead log belongs to it (bytes 18 and 19), and none with content is there.
    with path.open("rb") as file:
        lacks_wal = file.read(20)[18:20] == b"\2\2" and not _size(path.with_name(f"{path.name}-wal"))
    try:
        if path.with_name(f"{path.name}-journal").exists():
            # Let SQLite undo what a crash interrupted between two ways of journalling; only a writer may.
            with closing(connect_to_read(str(path), "rw")) as connection:
                _one(connection, "SELECT count(*) FROM sqlite_master")
        with closing(connect_to_read(str(path))) as connection:
            connection.execute("BEGIN")  # one moment of a session that may be running
            _demand_ours(connection, path)
            record = _verified(path, connection)
            return replace(record, lacks_wal=lacks_wal and not record.run_notes[-1].at_rest)
    except LedgerError:
        raise
    except sqlite3.OperationalError as error:
        reason = f"the file is damaged ({error}); restore it from a copy"
        if any(word in str(error) for word in ("unable to open", "locked", "readonly", "disk I/O")):
            # One that cannot be opened here is not thereby damaged.
            reason = (
                f"cannot be read here ({error}); copy it, with its -wal file if it has one, to a folder of your own"
            )
        raise LedgerError(f"{path}: {reason}") from None
    except (sqlite3.Error, ValueError, OverflowError, TypeError, AttributeError) as error:
        raise LedgerError(f"{path}: the file is damaged ({error}); restore it") from None


def read_header(path: Path) -> dict[str, Any]:
    """Return the body of session_started without verifying the rest. Raises LedgerError if there is none."""
    _demand_sqlite(path)
    try:
        with closing(connect_to_read(str(path))) as connection:
            row = connection.execute("SELECT body FROM events WHERE seq = 0").fetchone()
            if row is None:
                raise ValueError("there is none")
            value: dict[str, Any] = json.loads(row[0])
            demand_header(value)
            return value
    except (sqlite3.Error, ValueError, TypeError, RecursionError) as error:
        raise LedgerError(f"{path}: no first event can be read ({error})") from None


def _demand_sqlite(path: Path) -> None:
    if not path.is_file():
        raise LedgerError(f"{path}: no such ledger")
    with path.open("rb") as file:
        start = file.read(len(_MAGIC))
    if start != _MAGIC:
        raise LedgerError(f"{path}: not a ledger (it does not start as an SQLite file does), or damaged at its start")


def _size(path: Path) -> int:
    """Return how many bytes a file has; 0 if it is gone: a running session may remove its log at any moment."""
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def _one(connection: sqlite3.Connection, query: str) -> Any:
    return connection.execute(query).fetchone()[0]


def _demand_ours(connection: sqlite3.Connection, path: Path) -> None:
    application = _one(connection, "PRAGMA application_id")
    version = _one(connection, "PRAGMA user_version")
    if application != APPLICATION_ID:
        raise LedgerError(f"{path}: an SQLite file, but not a Palpate ledger (or its header is damaged)")
    if version > FORMAT:
        raise LedgerError(
            f"{path}: written in ledger format {version} by a newer Palpate; this one reads up to {FORMAT}: update it"
        )
    if version < 1:
        raise LedgerError(f"{path}: ledger format {version} does not exist; the file's header is damaged")
    names = connection.execute("SELECT name FROM sqlite_master WHERE type IN ('table', 'view')")
    tables = {name for (name,) in names}
    if foreign := tables - set(metadata.tables):
        raise LedgerError(f"{path}: holds {some(sorted(foreign))}, which no ledger does: something else wrote to it")
    verdict = _one(connection, "PRAGMA integrity_check(1)")
    if verdict != "ok":
        raise LedgerError(f"{path}: the file is damaged ({verdict}); restore it from a copy")


def _verified(path: Path, connection: sqlite3.Connection) -> Record:
    happened: list[Event] = []
    hashes, previous, shapes = [], SEED, EventShapes()
    for place, (one, link) in enumerate(linked_events(path, connection)):
        previous = event_hash(previous, one)
        if one.seq != place or link != previous:
            raise LedgerError(f"{path}: the hash chain breaks at event {place}: the file was changed or is damaged")
        if happened and one.t_ns < happened[-1].t_ns:
            raise LedgerError(f"{path}: time runs backwards at event {place}: the file was changed")
        demand_shape(path, shapes, one)
        happened.append(one)
        hashes.append(previous)
    if not happened or happened[0].kind != "session_started":
        raise LedgerError(f"{path}: {_UNFOUNDED}")
    return Record(path, tuple(happened), tuple(hashes), _run_notes(path, connection, hashes), shapes.state)


def demand_shape(path: Path, shapes: EventShapes, event: Event) -> None:
    """Raise LedgerError naming event and expectation unless a session can write this event at this place."""
    try:
        shapes.take(event)
    except ShapeError as error:
        raise LedgerError(
            f"{path}: event {event.seq} ({event.kind}) is not one that a session writes: {error}"
        ) from None


def linked_events(path: Path, connection: sqlite3.Connection, first: int | None = None) -> Iterator[tuple[Event, str]]:
    """Yield the events in the file, each with its link of the chain, not yet verified; all, or from number `first` on.

    Raises LedgerError on samples that are damaged or that belong to no event.
    """
    since, numbers = ("", ()) if first is None else (" WHERE seq >= ?", (first,))  # Whole, a number below 0 must show.
    rows = connection.execute(f"{_SAMPLES}{since} ORDER BY seq, block", numbers)
    waiting = rows.fetchone()
    for seq, t_ns, kind, trial, attempt, body, link in connection.execute(f"{_EVENTS}{since} ORDER BY seq", numbers):
        its_own = []
        while waiting is not None and waiting[0] == seq:
            its_own.append(_samples(path, *waiting))
            waiting = rows.fetchone()
        yield Event(seq, t_ns, kind, body.encode(), trial, attempt, tuple(its_own)), link
    if waiting is not None:
        raise LedgerError(f"{path}: {_UNFOUNDED}")


def _samples(path: Path, seq: int, number: int, stream: str, text: str, data: bytes) -> Samples:
    try:
        form = json.loads(text)
        block = Samples(
            stream, tuple(form["channels"]), tuple(form["units"]), form["rate_hz"], form["t0_ns"], data,
            form.get("first", 0), form.get("clock", "host"),
        )  # fmt: skip
        demand_samples(block)
        if block.form().decode() == text:
            return stored(block, path, seq, number)
    except (ValueError, TypeError, KeyError, ZeroDivisionError, RecursionError):
        pass
    raise LedgerError(f"{path}: the samples of event {seq} are damaged")


def stored_run_notes(connection: sqlite3.Connection) -> Iterator[tuple[int, RunNote]]:
    """Yield the notes of runs with their numbers as they are in the file, not yet verified."""
    for number, *run_note in connection.execute(_RUN_NOTES):
        yield number, RunNote(*run_note)


def _run_notes(path: Path, connection: sqlite3.Connection, hashes: Sequence[str]) -> tuple[RunNote, ...]:
    verified, previous = [], SEED
    for place, (number, row) in enumerate(stored_run_notes(connection)):
        previous = run_note_hash(previous, number, row.kind, row.events, row.head, row.body)
        if number != place or row.hash != previous:
            raise LedgerError(f"{path}: the record of runs was changed or is damaged (run {place})")
        if row.events > len(hashes):
            raise LedgerError(
                f"{path}: cut short: of {count(row.events, 'event')} when it was {row.kind}, {len(hashes)} are left"
            )
        if row.events < 1 or hashes[row.events - 1] != row.head:
            raise LedgerError(f"{path}: the events are not those that were there when it was {row.kind}")
        try:
            demand_fields(parse_canonical(row.body.encode()), *_NOTE)
        except ShapeError as error:
            raise LedgerError(f"{path}: the note of when it was {row.kind} (run {place}): {error}") from None
        verified.append(row)
    if not verified:
        raise LedgerError(f"{path}: no run of the session is recorded: the file was changed")
    return tuple(verified)


SMALL_BYTES = 4096
"""Blocks up to this size are kept in memory, such as a form's few touches; recordings are larger."""


FORM = tuple(field.name for field in fields(Samples) if field.name != "data")


class SamplesGone(ValueError):
    """The samples of a ledger that was read are no longer there."""


class StoredSamples(Samples):
    """A block of samples whose `data` is in a ledger; equal to any block of the same form and digest."""

    def __init__(self, block: Samples, path: Path, seq: int, number: int) -> None:
        form = {name: getattr(block, name) for name in FORM}
        sha256 = hashlib.sha256(block.data).digest()
        for name, value in (form | {"_count": block.count, "_sha256": sha256, "_at": (path, seq, number)}).items():
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Samples):
            return NotImplemented
        return self.sha256() == other.sha256() and all(getattr(self, name) == getattr(other, name) for name in FORM)

    def __hash__(self) -> int:
        return hash(self.sha256())

    def __repr__(self) -> str:
        return f"{self.stream}: {self.count} samples in the ledger"

    @property
    def data(self) -> bytes:
        """The bytes, read from the file. Raises SamplesGone where they are missing or changed."""
        path, seq, number = self.__dict__["_at"]
        data = _read(path, seq, number)
        if hashlib.sha256(data).digest() != self.sha256():
            raise SamplesGone(f"{path}: the samples of event {seq} are not those that were there when it was read")
        return data

    @property
    def count(self) -> int:
        """Samples per channel."""
        return int(self.__dict__["_count"])

    def sha256(self) -> bytes:
        """Return the digest of the bytes, known since they were read."""
        return bytes(self.__dict__["_sha256"])


def stored(block: Samples, path: Path, seq: int, number: int) -> Samples:
    """Return the block itself if it is small, else a block that reads its bytes from the ledger."""
    return block if len(block.data) <= SMALL_BYTES else StoredSamples(block, path, seq, number)


def _read(path: Path, seq: int, number: int) -> bytes:
    try:
        connection = sqlite3.connect(f"file:{quote(str(path.resolve()))}?mode=ro", uri=True)
        try:
            row: Any = connection.execute(
                "SELECT data FROM samples WHERE seq = ? AND block = ?", (seq, number)
            ).fetchone()
        finally:
            connection.close()
    except sqlite3.Error as error:
        raise SamplesGone(f"{path}: the samples of event {seq} cannot be read any more ({error})") from None
    if row is None:
        raise SamplesGone(f"{path}: the samples of event {seq} are not there any more")
    return bytes(row[0])
