"""The answers and times of a method for the held-out switches of one fold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array

Fitted = Callable[[Array], Array]
"""A function from scaled held-out curves to the method's answer."""


@dataclass(frozen=True)
class Outcome:
    """Answers and times; `answer`: restored curves (n, 621) in gf, or kinds (n,).

    Seconds of training, and per curve.
    """

    answer: Array
    training_s: float
    inference_s: float


def timed(fit: Callable[[], Fitted], held_out: Array, clock: Clock) -> Outcome:
    """Fit, then answer for the held-out rows in one batch."""
    began = clock()
    fitted = fit()
    between = clock()
    answer = fitted(held_out)
    return Outcome(answer, between - began, (clock() - between) / len(held_out))
