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
    STOPPED,
    Aside,
    Ask,
    Choose,
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
from palpate.protocols.plan import Plan, block_page
from palpate.protocols.tasks import TASKS, Answered, Captured, Outcome, Steps, Stopped, WentBack, feel_anchor
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


_ENDS: Mapping[type, str] = {Answered: ANSWERED, Captured: CAPTURED, WentBack: LEFT, Stopped: STOPPED}


class _Aborted(Exception):
    """Raised when the experimenter ends the session for good."""


class _Repeat(Exception):
    """Raised to repeat a trial, by the experimenter (`repeated`) or after a fault (`faulted`).

    `which` is this trial, the last one before it, or the block under way from its first trial.
    """

    def __init__(self, ended_as: str, which: str = "this") -> None:
        super().__init__()
        self.ended_as, self.which = ended_as, which


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
        if isinstance(request, Ask | Choose):
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
        repeats = what == "repeat" and which in {"this", "last", "block"} and self.trial is not None
        if what not in {"note", "pause", "go_on", "abort", "instructed"} and not repeats:
            raise ReplyError(f"the experimenter's {what!r} is unknown, or not to be done here")
        self.note("experimenter", aside.value)
        if what == "abort":
            raise _Aborted
        if what == "repeat":
            raise _Repeat(REPEATED, str(which))


@dataclass
class _Progress:
    """The participant's progress, by the numbers of trials: answers given, attempts made, the furthest place reached.

    `steps` are the answers that tracks go by, `stopped` the tracks that need no more trials, `passed` the trials at
    which that was said.
    """

    answers: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    attempts: dict[int, int] = field(default_factory=dict)
    furthest: int = -1
    steps: dict[int, tuple[int, bool]] = field(default_factory=dict)
    stopped: set[str] = field(default_factory=set)
    passed: set[int] = field(default_factory=set)

    def begin(self, plan: Plan, position: int) -> Trial:
        """Return the trial at a place of the plan with the attempt's number and what was answered before."""
        trial = plan.trials[position]
        self.attempts[trial.number] = self.attempts.get(trial.number, 0) + 1
        self.passed.discard(trial.number)
        attempted = replace(trial, attempt=self.attempts[trial.number], previous=self.answers.get(trial.number))
        if trial.track is None:
            return attempted
        name, steps = trial.track.name, self.steps
        before = (t for t in plan.trials[:position] if t.track is not None and t.track.name == name)
        return replace(attempted, previous=None, past=tuple(steps[t.number] for t in before if t.number in steps))

    def withdraw(self, trial: Trial) -> None:
        """Forget a trial's answer; its track goes on."""
        self.answers.pop(trial.number, None)
        self.steps.pop(trial.number, None)
        if trial.track is not None:
            self.stopped.discard(trial.track.name)

    def first_repeated(self, plan: Plan, position: int, which: str) -> int:
        """Return the place from which on trials are repeated; places that were passed over do not count."""
        answered = self.attempts.keys() - self.passed
        started = [place for place in range(position) if plan.trials[place].number in answered]
        if which == "last":
            return started[-1] if started else position
        first = position
        for place in reversed(started if which == "block" else []):
            if plan.trials[place].block != plan.trials[position].block:
                break
            first = place
        return first


def _walk(plan: Plan, record: _Recorder) -> None:
    progress, position, rest = _Progress(), 0, False
    while position < len(plan.trials):
        trial = plan.trials[position]
        new = position > progress.furthest
        progress.furthest = max(progress.furthest, position)
        rest = rest or (new and trial.rest_before)
        if trial.track is not None and trial.track.name in progress.stopped:
            position += 1
            continue
        if new:
            if rest:
                practice = sum(trial.practice for trial in plan.trials)
                record.perform(Rest(position - practice, len(plan.trials) - practice))
                rest = False
            if (page := _page_before(plan, position, progress)) is not None:
                record.perform(Instruct(page))
            for anchor in plan.anchors.get(position, ()):
                _feel(anchor, record)
        position = _one_trial(plan, position, progress, record)


def _page_before(plan: Plan, position: int, progress: _Progress) -> str | None:
    """Return the page that is shown before the first trial of a block; None if its block has none, or goes on."""
    blocks, name = plan.study.order.blocks, plan.trials[position].block
    if blocks is None or name not in blocks.instructions:
        return None
    started = [trial.block for trial in plan.trials[:position] if trial.number in progress.attempts]
    return None if started and started[-1] == name else block_page(name)


def _one_trial(plan: Plan, position: int, progress: _Progress, record: _Recorder) -> int:
    """Run one attempt at the trial, and return the place of the plan to go to."""
    trial = plan.trials[position]
    try:
        outcome = _attempt(plan.study.task, progress.begin(plan, position), record)
    except _Repeat as repeat:
        if repeat.ended_as == FAULTED:
            if record.tried is not None:
                progress.answers[trial.number] = record.tried  # the form starts from what was set
            return position
        first = progress.first_repeated(plan, position, repeat.which)
        for repeated in plan.trials[first : position + 1] if repeat.which == "block" else [plan.trials[first]]:
            progress.withdraw(repeated)
        if repeat.which == "block":
            progress.furthest = first - 1
        return first
    if isinstance(outcome, Stopped) and trial.track is not None:
        progress.stopped.add(trial.track.name)
        progress.passed.add(trial.number)
    if isinstance(outcome, Answered):
        progress.answers[trial.number] = outcome.answers
        if outcome.step is not None:
            progress.steps[trial.number] = outcome.step
    return max(0, position - 1) if isinstance(outcome, WentBack) else position + 1


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
    record.note("trial_ended", {"as": _ENDS[type(outcome)]})
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
