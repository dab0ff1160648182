"""The monitor's view of one session: its state, the time left, and how it was answered."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from statistics import median
from typing import Any

from palpate.analysis.monitoring.following import Followed
from palpate.analysis.monitoring.raters import Rated
from palpate.protocols.blinding import hider
from palpate.protocols.events import ANSWERED, CAPTURED, NS
from palpate.protocols.session_state import SessionState
from palpate.protocols.study import Study

LEAST_TRIALS = 3
"""Number of completed trials before the time left is estimated."""


@dataclass(frozen=True)
class Note:
    """Something that the experimenter did: seconds of session time, and the wall clock if known."""

    at_s: float
    at: float | None
    trial: int | None
    do: str
    text: str


@dataclass(frozen=True)
class Session:
    """A session as the monitor shows it. Times of day are seconds since 1970, None if unknown."""

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
        """Whether the session has ended."""
        return self.status not in {"running", "interrupted"}


def status_of(followed: Followed, is_held: bool) -> str:
    """Return the session's own end (complete, aborted, declined, ineligible), else running or interrupted."""
    return followed.session.ended or ("running" if is_held else "interrupted")


def session_of(
    followed: Followed, status: str, digest: str, rated: Rated | None, withdrawn: bool, now: float, study: Study
) -> Session:
    """Return the session at the time `now` (seconds since 1970); devices' faults omit what its study keeps blind."""
    state, header = followed.session, followed.session.header
    done = len(state.counting)
    simulated = header["rig"]["kind"] == "simulated"
    age = None if state.ended else max(0.0, now - followed.file.changed_at)
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
        paused=state.pause is not None,
        withdrawn=withdrawn,
        trials_done=done,
        trials_planned=header["trials"],
        elapsed_s=state.t_ns / NS + since,
        left_s=_left(state, status, done),
        last_event_age_s=age,
        started_at=_when(followed.run_notes[0].value),
        ended_at=_when(followed.run_notes[-1].value) if state.ended and followed.laid_down else None,
        sittings=sum(note.kind == "opened" for note in followed.run_notes),
        lacks_wal=followed.lacks_wal and status != "running",
        notes=tuple(_notes(followed, simulated, hider(study))),
        rated=rated,
    )


def _left(state: SessionState, status: str, done: int) -> float | None:
    """Return the seconds left: the participant's own median from trial to trial, times the remaining trials."""
    # How long each attempt that ended well took, from the end of the one before or, of the first, from its start.
    paces_ns = []
    since_ns = state.attempts[0].started_ns if state.attempts else 0
    for attempt in state.attempts:
        if attempt.ended_ns is not None:
            if attempt.ended_as in (ANSWERED, CAPTURED):
                paces_ns.append(attempt.ended_ns - since_ns)
            since_ns = attempt.ended_ns
    if status not in {"running", "interrupted"} or len(paces_ns) < LEAST_TRIALS:
        return None
    to_go: int = state.header["trials"] - done
    return median(paces_ns) / NS * to_go


def _notes(followed: Followed, simulated: bool, hide: Callable[[str], str]) -> Iterator[Note]:
    for event in followed.session.asides:
        # The session's clock went on from the run that the event belongs to.
        opened = [note for note in followed.run_notes if note.kind == "opened" and note.events <= event.seq]
        start = None if simulated or not opened else _when(opened[-1].value)
        at = None if start is None else start + (event.t_ns - followed.times_ns[opened[-1].events - 1]) / NS
        body = event.value
        if event.kind == "fault":
            do, text = "fault", hide(f"{body.get('device')}: {body.get('message')}")
        else:
            by = "by the participant" if body.get("by") == "participant" else ""
            do, text = str(body.get("do", "")), str(body.get("text") or "") or by
        yield Note(event.t_ns / NS, at, event.trial, do, text)


def _when(body: Any) -> float | None:
    try:
        at: float = datetime.fromisoformat(body["at"]).timestamp()
    except (KeyError, TypeError, ValueError):
        return None
    return at
