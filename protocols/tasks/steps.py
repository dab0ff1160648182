"""The steps of a trial: generators that yield requests, receive replies and return the trial's outcome."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from palpate.protocols.complaints import Problem
from palpate.protocols.events import Ask, Present, Reply, Request
from palpate.protocols.forms import AnchorForm, Form
from palpate.protocols.strict import Strict
from palpate.protocols.study import Stimulus, Study
from palpate.protocols.trial import ParticipantRow, Trial


@dataclass(frozen=True)
class Answered:
    """The answers in the shape of the trial's form: one value per attribute, ticked words, or written words.

    In a track, `step` is the index of the level and whether the answer was a hit.
    """

    answers: Mapping[str, Any]
    step: tuple[int, bool] | None = None


@dataclass(frozen=True)
class Captured:
    """The outcome that the stimulus was recorded; the samples are stored with the reply."""


@dataclass(frozen=True)
class WentBack:
    """The outcome that the participant left the trial for the one before."""


@dataclass(frozen=True)
class Stopped:
    """The outcome that the trial's track needs no more trials."""


Outcome = Answered | Captured | WentBack | Stopped
Steps = Generator[Request, Reply, Outcome]


class TaskError(ValueError):
    """A trial without something that its task needs: the study was not checked."""


@dataclass(frozen=True)
class Task:
    """A kind of task: its keys of a study file, the form of its trials, and the steps of a trial.

    `description` is for exports, `summary` says in a few words what a trial asks or records. `keys` are the keys of the
    file that only tasks which name them may have, `required` those of them that must be there; `settings` is the schema
    of the key `settings`. `form` makes the form of every trial, from the study, the participant's row, the seed and the
    session's number; None: there is no form. `block_form` replaces it where a trial is about all stimuli of a block: it
    makes the form from the study and these stimuli, in the order in which they are felt. `answers` is the collected
    table that holds the answers. `forward_only` tasks do not allow going back. `device` names the need that the task
    requires, `makes` says that stimuli are made from wishes. `check` yields further problems of a study, `notes` what
    is no mistake and rarely meant.
    """

    description: str
    steps: Callable[[Trial], Steps]
    keys: tuple[str, ...] = ()
    required: tuple[str, ...] = ()
    form: Callable[[Study, ParticipantRow, int, int], Form | None] | None = None
    block_form: Callable[[Study, tuple[Stimulus, ...]], Form | None] | None = None
    settings: type[Strict] | None = None
    answers: str = "trials"
    summary: Callable[[Study], str] = lambda _study: "answers of its own"
    forward_only: bool = False
    makes: bool = False
    device: Callable[[Study], str | None] = lambda _study: None
    check: Callable[[Study], Iterator[Problem]] = lambda _study: iter(())
    notes: Callable[[Study], Iterator[str]] = lambda _study: iter(())

    @property
    def asks(self) -> bool:
        """Return whether a trial asks the participant anything; if not, devices record."""
        return self.form is not None or self.block_form is not None


def feel_and_answer(trial: Trial) -> Steps:
    """Feel the stimulus, then answer the trial's form (thesis 3.3.2, 3.3.3, 4.7.1, 5.3.3, 5.3.4.2, 5.7.1.2).

    With `trial.previous`, the answers of an earlier attempt, the form starts from them and the stimulus is not felt
    again.
    """
    if trial.previous is None:
        yield Present(trial)
    return outcome_of((yield Ask(form_of(trial), trial)))


def feel_anchor(trial: Trial) -> Steps:
    """Read what a reference stands for and feel it, as often as the participant likes (thesis 5.8.3)."""
    form, felt = form_of(trial), 0
    while (reply := (yield Ask(form, trial, {"felt": felt}))).value.get("go") == "try":
        felt += 1
        wish = form.wish if isinstance(form, AnchorForm) else None
        yield Present(replace(trial, attempt=felt), wish)
    return outcome_of(reply)


def outcome_of(reply: Reply) -> Outcome:
    """Return the outcome that a reply to a form means; the runner has checked that it answers the form."""
    return WentBack() if reply.value.get("go") == "back" else Answered(reply.value["answers"])


def form_of(trial: Trial) -> Form:
    """Return the trial's form. Raises TaskError if there is none."""
    if trial.form is None:
        raise TaskError(f"trial {trial.number}: nothing to ask")
    return trial.form
