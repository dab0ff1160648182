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


def slider_rating(trial: Trial) -> Steps:
    """Feel the stimulus, then rate it on every attribute (thesis 3.3.3, 5.3.4.2).

    Asked again to revise, the participant sees the former answers and does not feel the stimulus again.
    """
    if trial.previous is None:
        yield Present(trial)
    return _outcome((yield Ask("sliders", trial)))


TASKS: Mapping[str, Task] = {"slider_rating": slider_rating}


def _outcome(reply: Reply) -> Outcome:
    """What a reply to a rating form means; the runner has made sure that it answers the form."""
    return WentBack() if reply.value.get("go") == "back" else Ratings(reply.value["answers"])
