"""Following a ledger while it grows: read and verified once, from then on only what is new."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from palpate.analysis.monitoring.course import Course
from palpate.protocols.event_shapes import EventShapes
from palpate.protocols.events import Event
from palpate.studies.ledger_schema import connect_to_read, event_hash
from palpate.studies.ledger_state import FileState, file_state
from palpate.studies.record import Sitting, demand_shape, linked_events, read, stored_sittings


@dataclass
class Followed:
    """A ledger as far as it was read: every event's hash was checked when it was taken in."""

    path: Path
    state: FileState
    course: Course
    head: str
    sittings: tuple[Sitting, ...]
    lacks_wal: bool
    shapes: EventShapes

    @property
    def laid_down(self) -> bool:
        """Whether the last process to hold the ledger laid it down properly."""
        return self.sittings[-1].kind == "closed"


def follow(path: Path) -> Followed:
    """Read a ledger whole. Raises as `palpate.studies.record.read` does, FileNotFoundError where there is none."""
    state = file_state(path)
    record = read(path)
    course = Course()
    for event in record.events:
        course.take(event)
    shapes = EventShapes.after(record.events)
    return Followed(path, state, course, record.head, record.sittings, record.lacks_wal, shapes)


def catch_up(followed: Followed) -> Followed:
    """The ledger as it is now: what is new is added; a file that does not go on as it began is read whole again."""
    state = file_state(followed.path)
    if state == followed.state:
        return followed
    try:
        grown = _grown(followed, state)
    except (sqlite3.Error, ValueError, KeyError, TypeError, AttributeError):
        grown = None  # Whatever it is, reading it whole says it in words.
    return follow(followed.path) if grown is None else grown


def _grown(followed: Followed, state: FileState) -> Followed | None:
    known = len(followed.course.times_ns)
    with closing(connect_to_read(str(followed.path))) as connection:
        connection.execute("BEGIN")  # one moment of a session that is running
        last = connection.execute("SELECT hash FROM events WHERE seq = ?", (known - 1,)).fetchone()
        if last != (followed.head,):
            return None
        new, head = _verified(connection, followed)
        sat = tuple(sitting for _, sitting in stored_sittings(connection))
    if new is None or len(sat) < len(followed.sittings):
        return None
    for event in new:
        followed.course.take(event)
    return Followed(followed.path, state, followed.course, head, sat, False, followed.shapes)


def _verified(connection: sqlite3.Connection, followed: Followed) -> tuple[list[Event] | None, str]:
    """The events after those known and the new head; None where the chain breaks or time runs backwards."""
    head, t_ns, known = followed.head, followed.course.times_ns[-1], len(followed.course.times_ns)
    new: list[Event] = []
    for place, (event, link) in enumerate(linked_events(followed.path, connection, known)):
        head = event_hash(head, event)
        if link != head or event.seq != known + place or event.t_ns < t_ns:
            return None, head
        demand_shape(followed.path, followed.shapes, event)
        t_ns = event.t_ns
        new.append(event)
    return new, head
