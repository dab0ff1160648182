"""Tasks: generators that yield requests, receive replies and return the trial's outcome."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from palpate.protocols.forms import AnchorForm, Form
from palpate.protocols.plan import Recording, Trial
from palpate.protocols.requests import Ask, Present, Reply, Request, Sense


@dataclass(frozen=True)
class Answered:
    """The answers as the trial's form shapes them: one value per attribute, words ticked, words written."""

    answers: Mapping[str, Any]


@dataclass(frozen=True)
class Captured:
    """The stimulus was recorded; the samples lie beside the reply."""


@dataclass(frozen=True)
class WentBack:
    """The participant left the trial for the one before."""


Outcome = Answered | Captured | WentBack
Steps = Generator[Request, Reply, Outcome]
Task = Callable[[Trial], Steps]


class TaskError(ValueError):
    """A trial that lacks what its task needs: the study was not checked."""


def feel_and_answer(trial: Trial) -> Steps:
    """Feel the stimulus, then answer the trial's form (thesis 3.3.2, 3.3.3, 4.7.1, 5.3.3, 5.3.4.2, 5.7.1.2).

    Asked again to revise, the participant sees the former answers and does not feel the stimulus again.
    """
    if trial.previous is None:
        yield Present(trial)
    return _outcome((yield Ask(_form_of(trial), trial)))


def authoring(trial: Trial) -> Steps:
    """Set sliders, feel what is made from them, as often as wished; the last setting stands (thesis 5.7.2.1).

    Where the form is live, the sliders were moved while it was felt: the next form starts from where they were left.
    """
    former: Mapping[str, Any] | None = None
    while True:
        reply = yield Ask(_form_of(trial), trial, former)
        if reply.value.get("go") != "try":
            return _outcome(reply)
        former = reply.value["answers"]
        felt = yield Present(trial, wish=former)
        former = felt.value.get("left_at", former)


def capture(trial: Trial) -> Steps:
    """Mount the stimulus, then record it while it is explored (thesis 3.4.1, 4.3.3, 5.3.1.1)."""
    yield Present(trial)
    recording = _recording_of(trial)
    yield Sense(recording.device, recording.seconds, trial)
    return Captured()


def feel_anchor(trial: Trial) -> Steps:
    """Read what a reference stands for and feel it, as often as wished (thesis 5.8.3)."""
    form, felt = _form_of(trial), 0
    while (reply := (yield Ask(form, trial, {"felt": felt}))).value.get("go") == "try":
        felt += 1
        wish = form.wish if isinstance(form, AnchorForm) else None
        yield Present(replace(trial, attempt=felt), wish)
    return _outcome(reply)


TASKS: Mapping[str, Task] = {
    "slider_rating": feel_and_answer,
    "matching": feel_and_answer,
    "similarity": feel_and_answer,
    "adjective_selection": feel_and_answer,
    "free_lexicon": feel_and_answer,
    "authoring": authoring,
    "capture": capture,
}


def _outcome(reply: Reply) -> Outcome:
    """What a reply to a form means; the runner has made sure that it answers the form."""
    return WentBack() if reply.value.get("go") == "back" else Answered(reply.value["answers"])


def _form_of(trial: Trial) -> Form:
    if trial.form is None:
        raise TaskError(f"trial {trial.number}: nothing to ask")
    return trial.form


def _recording_of(trial: Trial) -> Recording:
    if trial.recording is None:
        raise TaskError(f"trial {trial.number}: nothing to record")
    return trial.recording
