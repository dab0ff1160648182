"""What stands on the console's board: where the session is, folded from its events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.devices.samples import TELLING
from palpate.protocols.blinding import hider
from palpate.protocols.events import NS, Event
from palpate.protocols.plan import Plan, Trial

REMEMBERED = 6
"""How many of the last remarks stay on the board."""


@dataclass(frozen=True)
class Remark:
    """Something the experimenter did or wrote, and when."""

    t_ns: int
    text: str


@dataclass(frozen=True)
class Board:
    """The session so far. `trial` is the number of the trial under way; `position` the place in the plan last met.

    `doing` is the body of the request under way and `since_ns` its time, moved on by pauses. `resting`: it is the
    participant who paused.
    """

    plan: Plan
    header: Mapping[str, Any] = field(default_factory=dict)
    t_ns: int = 0
    trial: int | None = None
    attempt: int = 1
    position: int = -1
    done: frozenset[int] = frozenset()
    doing: Mapping[str, Any] | None = None
    since_ns: int = 0
    paused_at_ns: int | None = None
    resting: bool = False
    paused_ns: int = 0
    first_trial_ns: int | None = None
    last_end_ns: int = 0
    remarks: tuple[Remark, ...] = ()
    ended: str | None = None

    @property
    def paused(self) -> bool:
        """Whether the session is paused."""
        return self.paused_at_ns is not None

    @property
    def total(self) -> int:
        """How many trials the plan has."""
        return len(self.plan.trials)

    def current(self) -> Trial | None:
        """The trial under way."""
        return self.plan.trials[self.position] if self.trial is not None else None

    def coming(self, count: int = 2) -> tuple[Trial, ...]:
        """The trials after the present place in the plan."""
        return self.plan.trials[self.position + 1 : self.position + 1 + count]

    def active_ns(self, t_ns: int) -> int:
        """Session time without the pauses."""
        return (t_ns if self.paused_at_ns is None else self.paused_at_ns) - self.paused_ns

    def doing_s(self, t_ns: int) -> float:
        """Seconds that the present request has taken, without pauses."""
        return max(0.0, (self.active_ns(t_ns) - self.since_ns) / NS)

    def left_s(self, t_ns: int) -> float | None:
        """Seconds that the remaining trials will take at the pace so far; None before the first has ended.

        Everything between the first trial's start and the last one's end counts (rests, going back, repeats), but
        no pause. What of the present trial has passed is taken off.
        """
        if self.first_trial_ns is None or not self.done:
            return None
        pace_ns = (self.last_end_ns - self.first_trial_ns) / len(self.done)
        passed = min(self.active_ns(t_ns) - self.last_end_ns, pace_ns)
        left = max(0.0, pace_ns * (self.total - len(self.done)) - passed)
        return 0.0 if self.ended is not None else left / NS


def after(board: Board, event: Event) -> Board:
    """The board once the event is on record."""
    change = _CHANGES.get(event.kind)
    now = replace(board, t_ns=event.t_ns)
    return now if change is None else change(now, event)


def _started(board: Board, event: Event) -> Board:
    return replace(board, header=event.value)


def _trial_started(board: Board, event: Event) -> Board:
    active = board.active_ns(event.t_ns)
    place = next((n for n, trial in enumerate(board.plan.trials) if trial.number == event.trial), board.position)
    return replace(
        board,
        trial=event.trial,
        attempt=event.attempt or 1,
        position=place,
        first_trial_ns=active if board.first_trial_ns is None else board.first_trial_ns,
    )


def _request(board: Board, event: Event) -> Board:
    return replace(board, doing=event.value, since_ns=board.active_ns(event.t_ns))


def _reply(board: Board, _event: Event) -> Board:
    return replace(board, doing=None)


def _trial_ended(board: Board, event: Event) -> Board:
    over = replace(board, trial=None, doing=None)
    if event.value["as"] not in {"answered", "captured"} or event.trial is None:
        return over
    return replace(over, done=board.done | {event.trial}, last_end_ns=board.active_ns(event.t_ns))


def _experimenter(board: Board, event: Event) -> Board:
    what = event.value
    remark = Remark(event.t_ns, _told(what, board))
    noted = replace(board, remarks=(*board.remarks, remark)[-REMEMBERED:])
    match what["do"]:
        case "pause" if not board.paused:
            return replace(noted, paused_at_ns=event.t_ns, resting=what.get("by") == "participant")
        case "go_on" if board.paused_at_ns is not None:
            return replace(
                noted, paused_at_ns=None, resting=False, paused_ns=board.paused_ns + event.t_ns - board.paused_at_ns
            )
        case "repeat":
            return replace(noted, done=board.done - {_repeated(board, what)})
        case _:
            return noted


def _repeated(board: Board, what: Mapping[str, Any]) -> int:
    """The number of the trial whose answers are given up."""
    back = 1 if what.get("which") == "last" and board.position > 0 else 0
    return board.plan.trials[board.position - back].number


def _told(what: Mapping[str, Any], board: Board) -> str:
    match what["do"]:
        case "note":
            return str(what.get("text", ""))
        case "abort":
            return f"aborted: {what['text']}" if what.get("text") else "aborted"
        case "repeat":
            return f"trial {_repeated(board, what)} is repeated"
        case "pause":
            return "the participant rests" if what.get("by") == "participant" else "paused"
        case _:
            return "the participant goes on" if what.get("by") == "participant" else "went on"


def _ended(board: Board, event: Event) -> Board:
    return replace(board, ended=event.ended_as, trial=None, doing=None, paused_at_ns=None)


def _fault(board: Board, event: Event) -> Board:
    study = board.plan.study
    device, message = event.value["device"], hider(study, TELLING)(str(event.value["message"]))
    remark = Remark(event.t_ns, f"{device} went safe: {message.removeprefix(f'{device}: ')}")
    return replace(board, doing=None, remarks=(*board.remarks, remark)[-REMEMBERED:])


_CHANGES = {
    "session_started": _started,
    "trial_started": _trial_started,
    "request": _request,
    "reply": _reply,
    "trial_ended": _trial_ended,
    "experimenter": _experimenter,
    "fault": _fault,
    "session_ended": _ended,
}
