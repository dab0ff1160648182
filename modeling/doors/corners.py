"""Wishes at the ends of the sliders: every one must come to a door that plays, or to the nearest that does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from palpate.modeling.doors.data import TOP
from palpate.modeling.doors.methods import Fitted
from palpate.modeling.doors.plausibility import Plausibility, judged_all
from palpate.signals.arrays import Array

MIDDLE = TOP / 2
TOLERANCE = 10.0
"""A wish can be had where every attribute comes within this of it: what people just notice (thesis 5.5.4.1)."""
LOW, HIGH = 10.0, 90.0
"""Where thesis 5.7.1 sets one slider, the others in the middle."""


@dataclass(frozen=True)
class Extreme:
    """An extreme wish (attributes,), what the forward model says of its profile, and the profile's plausibility.

    `nearest` are the ratings of the profile that was made instead, within 0..100: the nearest that the model found.
    """

    wish: Array
    nearest: Array
    plausibility: Plausibility

    @property
    def had(self) -> bool:
        """Whether every attribute comes within TOLERANCE of the wish."""
        return bool(np.all(np.abs(self.nearest - self.wish) <= TOLERANCE))


def corners(attributes: int) -> Array:
    """All 2^attributes wishes of 0 and 100, (2^attributes, attributes)."""
    return np.array(list(product((0.0, TOP), repeat=attributes)))


def singles(attributes: int, low: float = 0.0, high: float = TOP) -> Array:
    """Every slider alone at `low` and at `high`, the others in the middle, (2 attributes, attributes)."""
    wishes = np.full((2 * attributes, attributes), MIDDLE)
    for slider in range(attributes):
        wishes[2 * slider : 2 * slider + 2, slider] = low, high
    return wishes


def extremes(inverse: Fitted, wishes: Array, forward: Fitted, measured_N: Array) -> tuple[Extreme, ...]:
    """What a model of the inverse makes of extreme wishes (n, attributes), judged beside measured profiles."""
    made = inverse.predict(wishes)
    felt = np.clip(forward.predict(made), 0.0, TOP)
    judgements = judged_all(made, measured_N)
    return tuple(Extreme(*each) for each in zip(wishes, felt, judgements, strict=True))


def unplayable(found: Sequence[Extreme]) -> int:
    """How many came to a profile that the door cannot play."""
    return sum(not each.plausibility.playable for each in found)
