"""The runner: it goes through a plan and records each request before it is performed, and its reply before the next.

A session is resumed or replayed by the same code, in a world of recorded replies (`Recorded`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.protocols.canonical import Json, canonical, difference
from palpate.protocols.events import (
    ANSWERED,
    CAPTURED,
    FAULTED,
    LEFT,
    REPEATED,
    Aside,
    Ask,
    Chunk,
    Confirm,
    Event,
    Fault,
    Instruct,
    Log,
    Reply,
    ReplyError,
    Request,
    Rest,
    Samples,
    World,
    WorldEvent,
)
from palpate.protocols.plan import Plan
from palpate.protocols.tasks import TASKS, Answered, Outcome, Steps, WentBack, feel_anchor
from palpate.protocols.trial import Trial

COMPLETE, DECLINED, INELIGIBLE, ABORTED = "complete", "declined", "ineligible", "aborted"


def run(plan: Plan, world: World, log: Log, header: Mapping[str, Any]) -> None:
    """Run the session from its first event to its last; `header` is the body of the first event.

    When it is interrupted, the log holds an exact prefix of the session. A reply that does not answer its request is
    not recorded (ReplyError): the session can be resumed at that request.
    """
    record = _Recorder(world, log)
    record.note("session_started", header)
    try:
        ended = _session(plan, record, header)
    except _Aborted:
        ended = ABORTED
    record.trial = None
    record.note("session_ended", {"trials": len(plan.trials)} | ({} if ended == COMPLETE else {"as": ended}))


def _session(plan: Plan, record: _Recorder, header: Mapping[str, Any]) -> str:
    if header.get("calibration") is not None:
        record.perform(Confirm("calibration"))
    for number, step in enumerate(plan.study.setup, start=1):
        record.perform(Confirm(f"setup {number}", step))
    for form in plan.opening:
        answers = record.perform(Ask(form)).value["answers"]
        if answers.get("agreed") is False:
            return DECLINED
        if answers.get("eligible") is False:
            return INELIGIBLE
    if plan.study.instructions is not None:
        record.perform(Instruct("instructions"))
    _walk(plan, record)
    for form in plan.closing:
        record.perform(Ask(form))
    return COMPLETE


class _Aborted(Exception):
    """Raised when the experimenter ends the session for good."""


class _Repeat(Exception):
    """Raised to repeat a trial, by the experimenter (`repeated`, this one or the last) or after a fault (`faulted`)."""

    def __init__(self, ended_as: str, last: bool = False) -> None:
        super().__init__()
        self.ended_as, self.last = ended_as, last


@dataclass
class _Recorder:
    """A recorder that numbers, times and writes the events of a session."""

    world: World
    log: Log
    trial: Trial | None = None
    in_anchor: bool = False
    seq: int = 0
    tried: Mapping[str, Any] | None = None
    """The last setting that was tried in this attempt."""

    def note(self, kind: str, body: Json, samples: tuple[Samples, ...] = ()) -> None:
        number, attempt = (None, None) if self.trial is None else (self.trial.number, self.trial.attempt)
        self.log.append(Event(self.seq, self.world.now(), kind, canonical(body), number, attempt, samples))
        self.seq += 1

    def perform(self, request: Request) -> Reply:
        self.note("request", request.body())
        while not isinstance(reply := self.world.perform(request), Reply):
            self.record_event(reply)
        if isinstance(request, Ask):
            request.demand_answer(reply)
        self.note("reply", reply.value, reply.samples)
        if reply.value.get("go") == "try":
            self.tried = reply.value["answers"]
        return reply

    def record_event(self, event: Aside | Chunk | Fault) -> None:
        """Record what comes before the reply; a repeat, an abort and a fault end the request without a reply."""
        match event:
            case Chunk():
                self.note("samples", event.value, event.samples)
            case Fault():
                self.record_fault(event)
            case Aside():
                self.record_aside(event)

    def record_fault(self, fault: Fault) -> None:
        """Record that a device failed. Raises ReplyError outside trials and references, where nothing can be
        repeated.
        """
        if self.trial is None and not self.in_anchor:
            raise ReplyError(f"a fault outside a trial: {fault.value.get('message')}")
        self.note("fault", fault.value)
        raise _Repeat(FAULTED)

    def record_aside(self, aside: Aside) -> None:
        """Record an action of the experimenter."""
        what, which = aside.value.get("do"), aside.value.get("which")
        repeats = what == "repeat" and which in {"this", "last"} and self.trial is not None
        if what not in {"note", "pause", "go_on", "abort"} and not repeats:
            raise ReplyError(f"the experimenter's {what!r} is unknown, or not to be done here")
        self.note("experimenter", aside.value)
        if what == "abort":
            raise _Aborted
        if what == "repeat":
            raise _Repeat(REPEATED, last=which == "last")


@dataclass
class _Progress:
    """The participant's progress: answers given, attempts made, and the furthest trial reached."""

    answers: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    attempts: dict[int, int] = field(default_factory=dict)
    furthest: int = -1

    def begin(self, trial: Trial) -> Trial:
        self.attempts[trial.number] = self.attempts.get(trial.number, 0) + 1
        return replace(trial, attempt=self.attempts[trial.number], previous=self.answers.get(trial.number))


def _walk(plan: Plan, record: _Recorder) -> None:
    progress, position = _Progress(), 0
    while position < len(plan.trials):
        trial = plan.trials[position]
        if position > progress.furthest:
            if trial.rest_before:
                practice = sum(trial.practice for trial in plan.trials)
                record.perform(Rest(position - practice, len(plan.trials) - practice))
            for anchor in plan.anchors.get(position, ()):
                _feel(anchor, record)
        progress.furthest = max(progress.furthest, position)
        position = max(0, position + _one_trial(plan, position, progress, record))


def _one_trial(plan: Plan, position: int, progress: _Progress, record: _Recorder) -> int:
    """Run one attempt at the trial, and return by how many places of the plan to move on."""
    trial = plan.trials[position]
    try:
        outcome = _attempt(plan.study.task, progress.begin(trial), record)
    except _Repeat as repeat:
        step = -1 if repeat.last and position > 0 else 0
        if repeat.ended_as == REPEATED:
            progress.answers.pop(plan.trials[position + step].number, None)
        elif record.tried is not None:
            progress.answers[trial.number] = record.tried  # a device failed: the form starts from what was set
        return step
    if isinstance(outcome, Answered):
        progress.answers[trial.number] = outcome.answers
    return -1 if isinstance(outcome, WentBack) else 1


def _feel(anchor: Trial, record: _Recorder) -> None:
    """Present a reference outside all trials, from the beginning again if a device fails."""
    record.in_anchor, felt = True, False
    while not felt:
        with suppress(_Repeat):
            _interact(feel_anchor(anchor), record)
            felt = True
    record.in_anchor = False


def _attempt(task: str, trial: Trial, record: _Recorder) -> Outcome:
    record.trial, record.tried = trial, None
    record.note("trial_started", {"stimulus": trial.stimulus.id, "block": trial.block})
    try:
        outcome = _interact(TASKS[task].steps(trial), record)
    except _Repeat as repeat:
        record.note("trial_ended", {"as": repeat.ended_as})
        record.trial = None
        raise
    ended_as = LEFT if isinstance(outcome, WentBack) else ANSWERED if isinstance(outcome, Answered) else CAPTURED
    record.note("trial_ended", {"as": ended_as})
    record.trial = None
    return outcome


def _interact(steps: Steps, record: _Recorder) -> Outcome:
    try:
        request = next(steps)
        while True:
            request = steps.send(record.perform(request))
    except StopIteration as end:
        outcome: Outcome = end.value
        return outcome


class Divergence(ValueError):
    """Raised when the code produces an event that differs from the recorded one."""


BROKEN_OFF = Fault({"device": "session", "what": "interrupted", "message": "the session was interrupted meanwhile"})


class EndOfRecord(Exception):
    """Raised at the end of a record without a world to continue in."""


@dataclass
class Recorded:
    """A recorded session as World and Log at once: replies and times are read from the record.

    Every event that the runner appends must equal the recorded one, byte for byte, else Divergence is raised. At the
    end of the record `world` and `log` take over; without them EndOfRecord is raised.
    """

    events: Sequence[Event]
    world: World | None = None
    log: Log | None = None
    position: int = 0
    recording: Request | None = None

    def now(self) -> int:
        """Return the recorded time of the next event, or the live time."""
        if self.position < len(self.events):
            return self.events[self.position].t_ns
        return self._live()[0].now()

    def perform(self, request: Request) -> WorldEvent:
        """Return the recorded outcome of the request, or perform it live past the end of the record.

        A recording that was cut off by the end of the record becomes a fault, so its trial is repeated.
        """
        if self.position == len(self.events):
            world, broken_off, self.recording = self._live()[0], self.recording is request, None
            return BROKEN_OFF if broken_off else world.perform(request)
        came = self.events[self.position]
        match came.kind:
            case "experimenter":
                return Aside(came.value)
            case "samples":
                self.recording = request
                return Chunk(came.value, came.samples)
            case "fault":
                return Fault(came.value)
            case "reply":
                return Reply(came.value, came.samples)
        raise Divergence(f"{came.place()}: a reply to {request.body()['do']!r} is expected there")

    def append(self, event: Event) -> None:
        """Compare the event with the record, or write it to the live log past the end of the record."""
        if self.position == len(self.events):
            self._live()[1].append(event)
            return
        demand_equal(self.events[self.position], event)
        self.position += 1

    def demand_end(self) -> None:
        """Raise Divergence if the session is over and the record holds more events."""
        if self.position < len(self.events):
            raise Divergence(f"{self.events[self.position].place()}: recorded, but the session is over before it")

    def _live(self) -> tuple[World, Log]:
        if self.world is None or self.log is None:
            raise EndOfRecord
        return self.world, self.log


def demand_equal(recorded: Event, now: Event) -> None:
    """Raise Divergence that names the event, the place in it and both values, unless the two are equal."""
    if recorded == now:
        return
    if recorded.kind != now.kind or recorded.trial != now.trial or recorded.attempt != now.attempt:
        raise Divergence(
            f"{recorded.place()}: the code now gives a {now.kind} of trial {now.trial}, attempt {now.attempt}"
        )
    text = difference(recorded.value, now.value) or f"recorded {recorded.body!r:.80}, now {now.body!r:.80}"
    raise Divergence(f"{recorded.place()}: {text}")
