"""What the monitor says of one session: where it stands, how long it will last, how it was answered."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from statistics import median
from typing import Any

from palpate.analysis.monitoring.course import Course
from palpate.analysis.monitoring.following import Followed
from palpate.analysis.monitoring.raters import Rated
from palpate.protocols.blinding import hider
from palpate.protocols.events import NS
from palpate.protocols.study import Study

LEAST_TRIALS = 3
"""Trials that must be behind the participant before the time left is estimated."""


@dataclass(frozen=True)
class Note:
    """Something that the experimenter did: seconds of session time, and the wall clock where it ran by that."""

    at_s: float
    at: float | None
    trial: int | None
    do: str
    text: str


@dataclass(frozen=True)
class Session:
    """A session as the monitor shows it. Times of day are seconds since 1970, None where they are not known."""

    file: str
    study: str
    title: str
    digest: str
    participant: str
    group: str | None
    row: int
    number: int
    simulated: bool
    status: str
    paused: bool
    withdrawn: bool
    trials_done: int
    trials_planned: int
    elapsed_s: float
    left_s: float | None
    last_event_age_s: float | None
    started_at: float | None
    ended_at: float | None
    sittings: int
    lacks_wal: bool
    notes: tuple[Note, ...]
    rated: Rated | None

    @property
    def over(self) -> bool:
        """Whether nothing more will come."""
        return self.status not in {"running", "interrupted"}


def status_of(followed: Followed, is_held: bool) -> str:
    """complete, aborted, declined or ineligible as the session itself says; else running or interrupted."""
    return followed.course.ended or ("running" if is_held else "interrupted")


def session_of(
    followed: Followed, status: str, digest: str, rated: Rated | None, withdrawn: bool, now: float, study: Study
) -> Session:
    """The session at the time `now` (seconds since 1970); what its study keeps blind is left out of devices' faults."""
    course, header = followed.course, followed.course.header
    simulated = header["rig"]["kind"] == "simulated"
    age = None if course.ended else max(0.0, now - followed.state.changed_at)
    since = age if age is not None and status == "running" and not simulated else 0.0
    return Session(
        file=followed.path.name,
        study=header["study"]["study"],
        title=header["study"].get("title") or header["study"]["study"],
        digest=digest,
        participant=header["participant"],
        group=header["group"],
        row=header["row"],
        number=header["session"],
        simulated=simulated,
        status=status,
        paused=course.paused,
        withdrawn=withdrawn,
        trials_done=course.done,
        trials_planned=header["trials"],
        elapsed_s=course.seconds + since,
        left_s=_left(course, status),
        last_event_age_s=age,
        started_at=_when(followed.sittings[0].value),
        ended_at=_when(followed.sittings[-1].value) if course.ended and followed.laid_down else None,
        sittings=sum(sitting.kind == "opened" for sitting in followed.sittings),
        lacks_wal=followed.lacks_wal and status != "running",
        notes=tuple(_notes(followed, simulated, hider(study))),
        rated=rated,
    )


def _left(course: Course, status: str) -> float | None:
    """Seconds to go: the participant's own median from trial to trial, for every trial that is left."""
    if status not in {"running", "interrupted"} or len(course.pace_ns) < LEAST_TRIALS:
        return None
    to_go: int = course.header["trials"] - course.done
    return median(course.pace_ns) / NS * to_go


def _notes(followed: Followed, simulated: bool, hide: Callable[[str], str]) -> Iterator[Note]:
    for aside in followed.course.asides:
        at = None if simulated else _wall_time(followed, aside.n, aside.t_ns)
        text = hide(aside.text) if aside.do == "fault" else aside.text
        yield Note(aside.t_ns / NS, at, aside.trial, aside.do, text)


def _wall_time(followed: Followed, n: int, t_ns: int) -> float | None:
    """The time of day of an event: the session's clock went on from the sitting that the event belongs to."""
    opened = [sitting for sitting in followed.sittings if sitting.kind == "opened" and sitting.events <= n]
    if not opened or (begun := _when(opened[-1].value)) is None:
        return None
    return begun + (t_ns - followed.course.times_ns[opened[-1].events - 1]) / NS


def _when(body: Any) -> float | None:
    try:
        at: float = datetime.fromisoformat(body["at"]).timestamp()
    except (KeyError, TypeError, ValueError):
        return None
    return at
