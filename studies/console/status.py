"""The status of a session, as the console shows it: folded from its events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from palpate.devices.samples import TELLING
from palpate.protocols.blinding import hider
from palpate.protocols.events import ANSWERED, NS, STOPPED, Event
from palpate.protocols.plan import Plan
from palpate.protocols.session_state import Pause, SessionState, active_ns
from palpate.protocols.trial import Trial

REMEMBERED = 6
"""How many of the last remarks stay on the status."""


@dataclass(frozen=True)
class Remark:
    """Something the experimenter did or wrote, and when."""

    t_ns: int
    text: str


@dataclass(frozen=True)
class SessionStatus:
    """The session so far.

    `passed_over` are the trials that do not come, because their tracks ended. `trial` is the number of the trial under
    way, `coming_place` the place of the next in the plan.

    `doing` is the body of the request under way and `since_ns` its time. `done` are the trials with an answer or a
    recording that counts; `pause` is the one that the session is in.
    """

    plan: Plan
    header: Mapping[str, Any] = field(default_factory=dict)
    t_ns: int = 0
    trial: int | None = None
    attempt: int = 1
    coming_place: int = 0
    done: frozenset[int] = frozenset()
    passed_over: frozenset[int] = frozenset()
    doing: Mapping[str, Any] | None = None
    since_ns: int = 0
    pauses: tuple[Pause, ...] = ()
    pause: Pause | None = None
    first_trial_ns: int | None = None
    last_done_ns: int = 0
    remarks: tuple[Remark, ...] = ()
    ended: str | None = None

    @property
    def paused(self) -> bool:
        """Whether the session is paused."""
        return self.pause is not None

    @property
    def total(self) -> int:
        """How many trials the plan has, without those that are passed over."""
        return len(self.plan.trials) - len(self.passed_over)

    @property
    def has_tracks(self) -> bool:
        """Whether procedures choose levels, and may end their tracks before the last trial of the plan."""
        return bool(self.plan.study.procedure)

    @property
    def has_blocks(self) -> bool:
        """Whether there are blocks that can be repeated."""
        return self.has_tracks or self.plan.study.order.blocks is not None

    def current(self) -> Trial | None:
        """Return the trial under way."""
        return None if self.trial is None else self.plan.trials[self.trial - 1]

    def coming(self, count: int = 2) -> tuple[Trial, ...]:
        """Return the trials that come next, without the one under way."""
        return self.plan.trials[self.coming_place : self.coming_place + count]

    def doing_s(self, t_ns: int) -> float:
        """Return how many seconds the present request has taken, without pauses."""
        return max(0.0, (active_ns(self.pauses, t_ns) - active_ns(self.pauses, self.since_ns)) / NS)

    def left_s(self, t_ns: int) -> float | None:
        """Return how many seconds the remaining trials will take at the pace so far; None before the first is done.

        Everything between the first trial's start and the end of the last one done counts (rests, going back,
        repeats), but no pause. What has passed since is taken off.
        """
        if self.first_trial_ns is None or not self.done:
            return None
        first, last, now = (active_ns(self.pauses, t) for t in (self.first_trial_ns, self.last_done_ns, t_ns))
        pace_ns, waiting = (last - first) / len(self.done), self.total - len(self.done)
        left = max(0.0, pace_ns * waiting - min(now - last, pace_ns))
        return 0.0 if self.ended is not None else left / NS


def status_of(plan: Plan, state: SessionState, ends: Sequence[Remark] = ()) -> SessionStatus:
    """Return the status of a session now, a copy that does not change with the state; `ends` are those of tracks."""
    remarks = sorted([*(_remark(plan, state, event) for event in state.asides), *ends], key=lambda one: one.t_ns)
    attempts, current = state.attempts, state.current
    under_way = attempts and (current is not None or state.ended is not None)
    done_ns = [attempt.done_ns for attempt in attempts if attempt.done_ns is not None]
    return SessionStatus(
        plan,
        header=state.header,
        t_ns=state.t_ns,
        trial=None if current is None else current.trial,
        attempt=attempts[-1].number if attempts else 1,
        coming_place=attempts[-1].trial if under_way else state.next_trial - 1,
        done=frozenset(attempt.trial for attempt in attempts if attempt.valid),
        passed_over=_passed_over(plan, state),
        doing=None if state.request is None else state.request.value,
        since_ns=0 if state.request is None else state.request.t_ns,
        pauses=tuple(state.pauses),
        pause=state.pause,
        first_trial_ns=attempts[0].started_ns if attempts else None,
        last_done_ns=done_ns[-1] if done_ns else 0,
        remarks=tuple(remarks[-REMEMBERED:]),
        ended=state.ended,
    )


def hides_level(plan: Plan, trial: Trial) -> bool:
    """Return whether the console does not show the level of a trial, because its column is blind."""
    grids = () if trial.track is None else trial.track.procedure.grids
    return any(grid.column in plan.study.blind for grid in grids)


def track_end(plan: Plan, state: SessionState, event: Event) -> Remark | None:
    """Return a remark that a track has ended, why, and what is known of its threshold; None for any other event.

    `state` is that before the event.
    """
    request, trial = state.request, None if event.trial is None else plan.trials[event.trial - 1]
    if trial is None or trial.track is None or trial.practice:
        return None
    name = trial.track.name
    track = "a track" if plan.study.blind else f"track {name}"
    if event.kind == "reply" and request is not None and request.value["do"] == "choose" and "stop" in event.value:
        known = "" if hides_level(plan, trial) else event.value.get("estimate", {}).get("text", "")
        text = "; ".join(filter(None, (str(event.value["why"]), known)))
        return Remark(event.t_ns, f"{track} ended: {hider(plan.study, TELLING)(text)}")
    if event.kind == "trial_ended" and event.value["as"] == ANSWERED:
        members = (other.number for other in reversed(plan.trials) if other.track is not None)
        last = next(n for n in members if (of := plan.trials[n - 1].track) is not None and of.name == name)
        if last == trial.number:
            return Remark(event.t_ns, f"{track} ended: all its trials are done")
    return None


def _passed_over(plan: Plan, state: SessionState) -> frozenset[int]:
    """Return the trials of tracks that have ended, where they were not answered; none if the study has no tracks."""
    if not plan.study.procedure:
        return frozenset()
    tracks = {trial.number: trial.track.name for trial in plan.trials if trial.track is not None}
    ended = {
        tracks[number]
        for number, trial in state.trials.items()
        if trial.attempts[-1].ended_as == STOPPED and not trial.attempts[-1].withdrawn
    }
    return frozenset(
        number
        for number, name in tracks.items()
        if name in ended and (number not in state.trials or state.trials[number].counting is None)
    )


def _remark(plan: Plan, state: SessionState, event: Event) -> Remark:
    body = event.value
    if event.kind == "fault":
        device, message = body["device"], hider(plan.study, TELLING)(str(body["message"]))
        return Remark(event.t_ns, f"{device} went safe: {message.removeprefix(f'{device}: ')}")
    by_participant = body.get("by") == "participant"
    match body["do"]:
        case "note":
            text = str(body.get("text", ""))
        case "abort":
            text = f"aborted: {body['text']}" if body.get("text") else "aborted"
        case "repeat":
            first = state.repeated_by(event)[0]
            text = f"{'the block from ' if body.get('which') == 'block' else ''}trial {first} is repeated"
        case "instructed":
            text = "the instructions were shown again"
        case "pause":
            text = "the participant rests" if by_participant else "paused"
        case _:
            text = "the participant goes on" if by_participant else "went on"
    return Remark(event.t_ns, text)
