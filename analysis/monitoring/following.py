"""Following a ledger while it grows: read and verified once, then only what is new."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.protocols.event_shapes import EventShapes
from palpate.protocols.events import event_hash
from palpate.protocols.session_state import SessionState
from palpate.studies.sessions.ledger_schema import connect_to_read
from palpate.studies.sessions.ledger_state import FileState, file_state
from palpate.studies.sessions.record import RunNote, demand_shape, linked_events, read, stored_run_notes


@dataclass
class Followed:
    """A ledger as far as it was read; every event's hash was verified on reading.

    `file` is the state of the file then, `session` that of the session; `times_ns` are the times of the events.
    """

    path: Path
    file: FileState
    session: SessionState
    times_ns: list[int]
    head: str
    run_notes: tuple[RunNote, ...]
    lacks_wal: bool

    @property
    def laid_down(self) -> bool:
        """Whether the last process that held the ledger closed it properly."""
        return self.run_notes[-1].kind == "closed"


def follow(path: Path) -> Followed:
    """Read a whole ledger. Raises as `record.read` does, and FileNotFoundError if there is none."""
    file = file_state(path)
    record = read(path)
    times_ns = [event.t_ns for event in record.events]
    return Followed(path, file, record.state, times_ns, record.head, record.run_notes, record.lacks_wal)


def catch_up(followed: Followed) -> Followed:
    """Return the ledger as it is now, with new events; a file with another beginning is read again completely."""
    file = file_state(followed.path)
    if file == followed.file:
        return followed
    try:
        grown = _grown(followed, file)
    except (sqlite3.Error, ValueError, KeyError, TypeError, AttributeError):
        grown = None  # Whatever it is, reading it whole says it in words.
    return follow(followed.path) if grown is None else grown


def _grown(followed: Followed, file: FileState) -> Followed | None:
    """Return the ledger with its new events; None if its beginning changed, and `followed` is then invalid."""
    with closing(connect_to_read(str(followed.path))) as connection:
        connection.execute("BEGIN")  # one moment of a session that is running
        last = connection.execute("SELECT hash FROM events WHERE seq = ?", (len(followed.times_ns) - 1,)).fetchone()
        if last != (followed.head,):
            return None
        head, times_ns, shapes = followed.head, followed.times_ns, EventShapes(followed.session)
        for event, link in linked_events(followed.path, connection, len(times_ns)):
            head = event_hash(head, event)
            if link != head or event.seq != len(times_ns) or event.t_ns < times_ns[-1]:
                return None  # the chain breaks, or time runs backwards
            demand_shape(followed.path, shapes, event)
            times_ns.append(event.t_ns)
        run_notes = tuple(run_note for _, run_note in stored_run_notes(connection))
    if len(run_notes) < len(followed.run_notes):
        return None
    return replace(followed, file=file, head=head, run_notes=run_notes, lacks_wal=False)
