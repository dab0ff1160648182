"""The runner: walks a plan and records each request before it is performed, its reply before the next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from protocols.canonical import Json, canonical
from protocols.events import Event, Log, World
from protocols.plan import Plan, Trial
from protocols.requests import Ask, Instruct, Reply, Request, Rest, Samples
from protocols.tasks import TASKS, Outcome, Ratings, Steps, WentBack


def run(plan: Plan, world: World, log: Log, header: Mapping[str, Any]) -> None:
    """Run the session from its first event to its last; `header` is the body of the first.

    Interrupted at any point, the log holds an exact prefix of the session. A reply that does not answer its request
    is not recorded (ReplyError): the session can be gone on with at that request.
    """
    record = _Recorder(world, log)
    record.note("session_started", header)
    if plan.study.instructions is not None:
        record.perform(Instruct("instructions"))
    _walk(plan, record)
    record.note("session_ended", {"trials": len(plan.trials)})


@dataclass
class _Recorder:
    """Numbers and times what happens, and puts it on record."""

    world: World
    log: Log
    trial: Trial | None = None
    seq: int = 0

    def note(self, kind: str, body: Json, samples: tuple[Samples, ...] = ()) -> None:
        number, attempt = (None, None) if self.trial is None else (self.trial.number, self.trial.attempt)
        self.log.append(Event(self.seq, self.world.now(), kind, canonical(body), number, attempt, samples))
        self.seq += 1

    def perform(self, request: Request) -> Reply:
        self.note("request", request.body())
        reply = self.world.perform(request)
        if isinstance(request, Ask):
            request.demand_answer(reply)
        self.note("reply", reply.value, reply.samples)
        return reply


@dataclass
class _Progress:
    """How far the participant is: answers given, attempts made, and the furthest trial reached."""

    answers: dict[int, Mapping[str, float]] = field(default_factory=dict)
    attempts: dict[int, int] = field(default_factory=dict)
    furthest: int = -1

    def meet(self, trial: Trial) -> Trial:
        self.attempts[trial.number] = self.attempts.get(trial.number, 0) + 1
        return replace(trial, attempt=self.attempts[trial.number], previous=self.answers.get(trial.number))


def _walk(plan: Plan, record: _Recorder) -> None:
    progress, position = _Progress(), 0
    while position < len(plan.trials):
        trial = plan.trials[position]
        if trial.rest_before and position > progress.furthest:
            _rest(plan, position, record)
        progress.furthest = max(progress.furthest, position)
        outcome = _attempt(plan.study.task, progress.meet(trial), record)
        if isinstance(outcome, Ratings):
            progress.answers[trial.number] = outcome.values
        position += -1 if isinstance(outcome, WentBack) else 1


def _rest(plan: Plan, position: int, record: _Recorder) -> None:
    counted = [trial for trial in plan.trials if not trial.practice]
    practice = len(plan.trials) - len(counted)
    record.perform(Rest(position - practice, len(counted)))


def _attempt(task: str, trial: Trial, record: _Recorder) -> Outcome:
    record.trial = trial
    record.note("trial_started", {"stimulus": trial.stimulus.id, "block": trial.block})
    outcome = _interact(TASKS[task](trial), record)
    record.note("trial_ended", {"as": "left" if isinstance(outcome, WentBack) else "answered"})
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
