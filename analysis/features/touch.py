"""What a tool felt of one texture, filtered and at 1 kHz, its axes still apart (thesis 3.4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.signals.arrays import Array

RATE_HZ = 1000.0
TRIM_S = 2.5
"""Taken off both ends of an exploration: the tool is put down and lifted there."""
BAND_HZ = (20.0, 500.0)
"""Of acceleration; at 1 kHz the upper edge lies at half the rate and is left out (palpate.signals.filters)."""


class FeatureError(ValueError):
    """Signals that have no features: the message says where, what was found and what is expected."""


@dataclass(frozen=True)
class Stretch:
    """Samples that follow one another at 1 kHz: acceleration (n, axes) in m/s^2, speed (n,) in mm/s, force (n,) in N.

    Acceleration is band-passed and free of gravity, speed and force are low-passed. `first` is the number of its first
    sample since the exploration began. Raises FeatureError where lengths differ, where there is no axis, and on a
    number that is not finite.
    """

    axes: Array
    speed_mm_s: Array
    force_N: Array
    first: int = 0

    def __post_init__(self) -> None:
        n = len(self.axes)
        if self.axes.ndim != 2 or not self.axes.shape[1] or self.speed_mm_s.shape != (n,) or self.force_N.shape != (n,):
            shapes = f"{self.axes.shape}, {self.speed_mm_s.shape} and {self.force_N.shape}"
            raise FeatureError(
                f"acceleration, speed and force of shapes {shapes}: (n, axes), (n,) and (n,) are expected"
            )
        for what, values in (("acceleration", self.axes), ("speed", self.speed_mm_s), ("force", self.force_N)):
            bad = np.argwhere(~np.isfinite(values))
            if bad.size:
                raise FeatureError(
                    f"{what}, sample {int(bad[0][0]) + 1}, is {values[tuple(bad[0])]}: finite numbers only"
                )

    def cut(self, start: int, stop: int) -> Stretch:
        """Its samples [start, stop)."""
        kept = slice(start, stop)
        return Stretch(self.axes[kept], self.speed_mm_s[kept], self.force_N[kept], self.first + start)


@dataclass(frozen=True)
class Touch:
    """All that was felt of one texture, in stretches between which something lacks. `where` names it in messages."""

    where: str
    stretches: tuple[Stretch, ...]

    @property
    def seconds(self) -> float:
        """How long all stretches are together."""
        return sum(len(each.axes) for each in self.stretches) / RATE_HZ
