"""Tasks: generators that yield requests, receive replies and return the trial's outcome."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass

from protocols.plan import Trial
from protocols.requests import Ask, Present, Reply, Request


@dataclass(frozen=True)
class Ratings:
    """One value per attribute, by the attribute's name, in scale units."""

    values: Mapping[str, float]


@dataclass(frozen=True)
class WentBack:
    """The participant left the trial for the one before."""


Outcome = Ratings | WentBack
Steps = Generator[Request, Reply, Outcome]
Task = Callable[[Trial], Steps]


class ReplyError(ValueError):
    """A reply that does not answer its request: a fault of the presenter, never of the participant."""


def slider_rating(trial: Trial) -> Steps:
    """Feel the stimulus, then rate it on every attribute (thesis 3.3.3, 5.3.4.2).

    Asked again to revise, the participant sees the former answers and does not feel the stimulus again.
    """
    if trial.previous is None:
        yield Present(trial)
    return _outcome((yield Ask("sliders", trial)), trial)


TASKS: Mapping[str, Task] = {"slider_rating": slider_rating}


def _outcome(reply: Reply, trial: Trial) -> Outcome:
    if reply.value.get("go") == "back":
        if not trial.may_go_back:
            raise ReplyError(f"trial {trial.number}: the reply goes back, which this trial does not allow")
        return WentBack()
    answers = reply.value.get("answers")
    names = [attribute.name for attribute in trial.attributes]
    if not isinstance(answers, Mapping) or sorted(answers) != sorted(names):
        raise ReplyError(f"trial {trial.number}: answers to {names} expected, found {answers!r:.200}")
    for name, value in answers.items():
        if not trial.scale.holds(value):
            raise ReplyError(f"trial {trial.number}: {name} = {value!r} is not on the study's scale")
    return Ratings(answers)
