"""The state of a session, computed from its events: the outcome of each trial, the attempt that counts, open requests.

The runner writes the events and all readers take the state from here: collected tables, console, monitor, streams. The
runner itself does not, so that its own state can be compared with this one (a test does, after every event of random
sessions). Trials are numbered from 1 in the order of the plan, as `compile_plan` numbers them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from palpate.protocols.events import ANSWERED, CAPTURED, LEFT, REPEATED, STOPPED, Event


class Answer(NamedTuple):
    """An answered form; a form that was left, or a setting that was only tried, is not an answer.

    `seq` and `t_ns` are the number and the time of the reply, `request` is the number of the request. `values`: item
    -> value, or kind of words -> words.
    """

    seq: int
    t_ns: int
    trial: int | None
    attempt: int | None
    request: int
    form: str
    items: Sequence[str]
    values: Mapping[str, Any]


@dataclass
class Attempt:
    """An attempt at a trial: its events have the numbers `first` to `last`, None while it lasts.

    `form_shown_ns` is when its form was first shown, in session time. `withdrawn`: the experimenter has repeated the
    trial since, and the result of this attempt does not count.
    """

    trial: int
    number: int
    stimulus: str
    first: int
    started_ns: int
    form_shown_ns: int | None = None
    answer: Answer | None = None
    last: int | None = None
    ended_ns: int | None = None
    ended_as: str | None = None
    withdrawn: bool = False
    block: str = ""

    @property
    def done_ns(self) -> int | None:
        """Return when it got its answer or recording; None if it did not."""
        if self.answer is not None:
            return self.answer.t_ns
        return self.ended_ns if self.ended_as == CAPTURED else None

    @property
    def valid(self) -> bool:
        """Return whether it got an answer or a recording that was not withdrawn."""
        return not self.withdrawn and self.done_ns is not None


@dataclass
class TrialState:
    """The state of a trial: its attempts in their order, at least one."""

    attempts: list[Attempt] = field(default_factory=list)

    @property
    def counting(self) -> Attempt | None:
        """Return the attempt that counts: the last valid one."""
        for attempt in reversed(self.attempts):
            if attempt.valid:
                return attempt
        return None

    @property
    def answer(self) -> Answer | None:
        """Return the answer that counts."""
        counting = self.counting
        return None if counting is None else counting.answer

    @property
    def status(self) -> str:
        """Return started, answered, captured, left, stopped, repeated or faulted; after the last two the trial is
        repeated.
        """
        last = self.attempts[-1]
        if last.ended_as is None:
            return "started"
        if last.withdrawn:
            return REPEATED
        return last.ended_as if self.answer is None else ANSWERED


@dataclass(frozen=True)
class Pause:
    """A pause of the session, by the experimenter or by a participant who rests; `ended_ns` is None while it lasts."""

    started_ns: int
    by_participant: bool
    ended_ns: int | None = None


@dataclass
class SessionState:
    """The state of a session so far; `apply` updates it with the next event.

    attempts: all, in the order in which they started. answers: all answered forms, also those outside trials. asides:
    the events of the experimenter's actions, and of faults. current: the attempt under way. request: the open request.
    next_trial: the number of the trial under way or, if none is, of the next one (one past the last if none is left).
    Of other events only the numbers are kept: a monitor has thousands of states.
    """

    header: Mapping[str, Any] = field(default_factory=dict)
    t_ns: int = 0
    trials: dict[int, TrialState] = field(default_factory=dict)
    attempts: list[Attempt] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)
    asides: list[Event] = field(default_factory=list)
    pauses: list[Pause] = field(default_factory=list)
    current: Attempt | None = None
    request: Event | None = None
    next_trial: int = 1
    ended: str | None = None

    @property
    def counting(self) -> list[Attempt]:
        """Return the attempt that counts of each trial that has one, in the order in which the trials started."""
        counting = [attempt for trial in self.trials.values() if (attempt := trial.counting) is not None]
        return sorted(counting, key=lambda attempt: attempt.first)

    @property
    def pause(self) -> Pause | None:
        """Return the current pause, None if the session is not paused."""
        last = self.pauses[-1] if self.pauses and self.ended is None else None
        return last if last is not None and last.ended_ns is None else None

    def counts(self, answer: Answer) -> bool:
        """Return whether this answer is the one of its trial that counts; outside trials every answer counts."""
        return answer.trial is None or self.trials[answer.trial].answer is answer

    def repeated_by(self, event: Event) -> list[int]:
        """Return the trials that the experimenter repeats: the one under way, the last one before it, or the block so
        far.
        """
        number, which = event.trial or 1, event.value.get("which")
        states = self.trials.items()
        started = sorted(n for n, state in states if n < number and state.attempts[-1].ended_as != STOPPED)
        if which == "last":
            return started[-1:] or [number]
        if which != "block" or number not in self.trials:
            return [number]
        blocks = {trial: state.attempts[-1].block for trial, state in self.trials.items()}
        start = next((n for n in reversed(range(len(started))) if blocks[started[n]] != blocks[number]), -1)
        return [*started[start + 1 :], number]

    def apply(self, event: Event) -> None:
        """Apply the next event, one that `palpate.protocols.event_shapes` accepts after those before it."""
        self.t_ns = event.t_ns
        match event.kind:
            case "request":
                self.request, current = event, self.current
                if current is not None and current.form_shown_ns is None and event.value["do"] == "ask":
                    current.form_shown_ns = event.t_ns
            case "reply":
                self._reply(event)
            case "trial_started":
                number = event.trial or 0
                value = event.value
                self.current = Attempt(
                    number, event.attempt or 0, value["stimulus"], event.seq, event.t_ns, block=value["block"]
                )
                self.request, self.next_trial = None, number
                self.attempts.append(self.current)
                self.trials.setdefault(number, TrialState()).attempts.append(self.current)
            case "trial_ended":
                self._end(event)
            case "experimenter":
                self._experimenter(event)
            case "fault":
                self.asides.append(event)
                self.request = None
            case "session_started":
                self.header = event.value
            case "session_ended":
                self.ended, self.current, self.request = event.ended_as, None, None

    def _reply(self, event: Event) -> None:
        request, reply, self.request = self.request, event.value, None
        if request is None or request.value["do"] != "ask" or "answers" not in reply or reply.get("go") is not None:
            return
        form, items = request.value["form"], request.value["items"]
        answer = Answer(event.seq, event.t_ns, event.trial, event.attempt, request.seq, form, items, reply["answers"])
        self.answers.append(answer)
        if self.current is not None:
            self.current.answer = answer

    def _end(self, event: Event) -> None:
        current, self.current, self.request = self.current, None, None
        if current is None:
            return
        current.last, current.ended_ns, current.ended_as = event.seq, event.t_ns, str(event.value["as"])
        if current.ended_as in (ANSWERED, CAPTURED, STOPPED):
            self.next_trial = current.trial + 1
        elif current.ended_as == LEFT:
            self.next_trial = max(1, current.trial - 1)

    def _experimenter(self, event: Event) -> None:
        self.asides.append(event)
        match event.value["do"]:
            case "pause" if self.pause is None:
                self.pauses.append(Pause(event.t_ns, event.value.get("by") == "participant"))
            case "go_on" if self.pause is not None:
                self.pauses[-1] = replace(self.pause, ended_ns=event.t_ns)
            case "abort":
                self.request = None
            case "repeat" if event.trial is not None:
                repeated = self.repeated_by(event)
                self.request, self.next_trial = None, repeated[0]
                for number in repeated:
                    for attempt in self.trials[number].attempts if number in self.trials else ():
                        attempt.withdrawn = True


def fold(events: Iterable[Event]) -> SessionState:
    """Return the state after these events."""
    state = SessionState()
    for event in events:
        state.apply(event)
    return state


def active_ns(pauses: Sequence[Pause], t_ns: int) -> int:
    """Return a session time minus the pauses that began before it."""
    if not pauses:
        return t_ns
    ends = [(pause.started_ns, t_ns if pause.ended_ns is None else min(pause.ended_ns, t_ns)) for pause in pauses]
    return t_ns - sum(end - start for start, end in ends if start < t_ns)
