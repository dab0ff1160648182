"""Global min-max scaling of forces and ratings to 0..100, kept with the model (thesis 5.5.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.modeling.doors.data import DoorData, ModelDataError
from palpate.signals.arrays import Array

TOP = 100.0


@dataclass(frozen=True)
class Scaling:
    """What 0 and 100 are: forces in newtons, ratings on the study's scale. One range for all stimuli and attributes."""

    force_N: tuple[float, float]
    rating: tuple[float, float]

    def force_up(self, force_N: Array) -> Array:
        """Newtons to 0..100; beyond the range, beyond 0..100."""
        return _up(force_N, self.force_N)

    def force_down(self, scaled: Array) -> Array:
        """0..100 to newtons."""
        return _down(scaled, self.force_N)

    def rating_up(self, rating: Array) -> Array:
        """The study's scale to 0..100."""
        return _up(rating, self.rating)

    def rating_down(self, scaled: Array) -> Array:
        """0..100 to the study's scale."""
        return _down(scaled, self.rating)


def scaling_of(data: DoorData) -> Scaling:
    """The scaling of a whole data set. Raises ModelDataError where all forces or all ratings are equal."""
    return Scaling(_range(data.force_N, "forces"), _range(data.rating, "ratings"))


def _range(values: Array, what: str) -> tuple[float, float]:
    low, high = float(np.min(values)), float(np.max(values))
    if not low < high:
        raise ModelDataError(f"all {what} are {low:g}: there is nothing to learn from; at least two differ in a study.")
    return low, high


def _up(values: Array, ends: tuple[float, float]) -> Array:
    return (np.asarray(values, dtype=np.float64) - ends[0]) / (ends[1] - ends[0]) * TOP


def _down(values: Array, ends: tuple[float, float]) -> Array:
    return np.asarray(values, dtype=np.float64) / TOP * (ends[1] - ends[0]) + ends[0]
