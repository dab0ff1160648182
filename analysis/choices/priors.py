"""Priors of a psychometric function's parameters, as psignifit 4 chooses them (Schütt et al. 2016, 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.analysis.statistics.doubles import Floats

BETA = 10.0


@dataclass(frozen=True)
class Tested:
    """What the priors are made from: the lowest and highest level tested, and the smallest step between two."""

    low: float
    high: float
    step: float

    @property
    def range(self) -> float:
        """From the lowest to the highest level."""
        return self.high - self.low


def tested(levels: Floats) -> Tested:
    """The levels' range and smallest step."""
    return Tested(float(levels.min()), float(levels.max()), float(np.diff(np.sort(levels)).min()))


def threshold_prior(place: Floats, of: Tested) -> Floats:
    """Even over the levels tested, falling as a cosine to 0 half a range beyond them."""
    beyond = np.maximum(of.low - place, place - of.high) / (of.range / 2)
    return np.where(beyond <= 0, 1.0, np.where(beyond < 1, (1 + np.cos(np.pi * np.minimum(beyond, 1))) / 2, 0.0))


def width_prior(width: Floats, of: Tested) -> Floats:
    """Even from two steps to the range (x.95 - x.05), rising from one step, falling to 0 at three ranges."""
    rise = np.clip((width - of.step) / of.step, 0, 1)
    fall = np.clip((width - of.range) / (2 * of.range), 0, 1)
    result: Floats = (1 - np.cos(np.pi * rise)) / 2 * (1 + np.cos(np.pi * fall)) / 2
    return result


def rate_prior(rate: Floats) -> Floats:
    """Beta(1, 10): of the guess rate (where it is estimated), the lapse rate and the overdispersion eta."""
    result: Floats = BETA * (1 - rate) ** (BETA - 1)
    return result
