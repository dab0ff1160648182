"""Signals of a tool's contact with one texture, filtered at 1 kHz, with axes still apart (thesis 3.4.1)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.one_axis import dft321

RATE_HZ = 1000.0
TRIM_S = 2.5
"""Seconds removed at both ends of an exploration, where the tool is put down and lifted."""
BAND_HZ = (20.0, 500.0)
"""The band of acceleration; at 1 kHz the upper edge is at half the rate and is left out (palpate.signals.filters)."""
SEGMENT_S = 0.5
SEGMENT = round(SEGMENT_S * RATE_HZ)
"""Samples of a segment; the remainder of a stretch is unused."""
CONTACT_N = 0.15
"""Least mean normal force of a segment with contact: below, the tool was lifted or only brushed the surface.

Force sensors of tools drift by a few hundredths of a newton; explorations press with 0.2 N and more.
"""


class FeatureError(ValueError):
    """Signals without features; the message says where, what is wrong and what is expected."""


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples at 1 kHz: acceleration (n, axes) in m/s^2, speed (n,) in mm/s, force (n,) in N.

    Acceleration is band-passed and free of gravity, speed and force are low-passed. `first` is the number of its first
    sample since the exploration began. Raises FeatureError where lengths differ or there is no axis, and on numbers
    that are not finite.
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
        """Return the samples [start, stop)."""
        part = slice(start, stop)
        return Stretch(self.axes[part], self.speed_mm_s[part], self.force_N[part], self.first + start)


@dataclass(frozen=True)
class Touch:
    """All recordings of one texture, in stretches with gaps between them. `where` names it in messages."""

    where: str
    stretches: tuple[Stretch, ...]

    @property
    def seconds(self) -> float:
        """The duration of all stretches together."""
        return sum(len(stretch.axes) for stretch in self.stretches) / RATE_HZ


@dataclass(frozen=True)
class Segments:
    """Acceleration on one axis in m/s^2, speed in mm/s and force in N, each (segments, 500)."""

    vibration: Array
    speed_mm_s: Array
    force_N: Array

    def only(self, chosen: NDArray[np.bool_]) -> Segments:
        """Return the segments chosen by a mask (segments,)."""
        return Segments(self.vibration[chosen], self.speed_mm_s[chosen], self.force_N[chosen])


def contact(touch: Touch) -> NDArray[np.bool_]:
    """Return whether the tool was in contact in each segment, (segments,), in the order of `segments`.

    The criterion is a mean force of at least `CONTACT_N`. Raises FeatureError if it never was.
    """
    mean_N = np.array([part.force_N.mean() for stretch in touch.stretches for part in _cut(stretch)])
    pressed = mean_N >= CONTACT_N
    if mean_N.size and not pressed.any():
        raise FeatureError(
            f"{touch.where}: no contact in any of {mean_N.size} segments: the mean normal force is {mean_N.max():.2g} N"
            f" at most, {CONTACT_N:g} N is expected; was the force sensor connected, its unit N, its zero right?"
        )
    return pressed


def segments(touch: Touch) -> Segments:
    """Return the segments of every stretch, one after another, none across a gap.

    DFT321 processes one segment at a time: its spectrum is exactly the root of the summed spectra of the axes, and its
    energy stays in the segment. Raises FeatureError where no stretch is as long as a segment.
    """
    parts = [part for stretch in touch.stretches for part in _cut(stretch)]
    if not parts:
        longest = max((len(part.axes) for part in touch.stretches), default=0) / RATE_HZ
        raise FeatureError(
            f"{touch.where}: the longest stretch is {longest:.3g} s; a segment takes {SEGMENT_S:g} s: record longer, or"
            " trim less"
        )
    return Segments(
        np.stack([dft321(part.axes) for part in parts]),
        np.stack([part.speed_mm_s for part in parts]),
        np.stack([part.force_N for part in parts]),
    )


def _cut(stretch: Stretch) -> Iterator[Stretch]:
    for start in range(0, len(stretch.axes) - SEGMENT + 1, SEGMENT):
        yield stretch.cut(start, start + SEGMENT)
