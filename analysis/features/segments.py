"""Half seconds of touch, each on one axis by its own spectrum (thesis 3.4.1)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.features.touch import RATE_HZ, FeatureError, Stretch, Touch
from palpate.signals.arrays import Array
from palpate.signals.one_axis import dft321

SEGMENT_S = 0.5
SEGMENT = round(SEGMENT_S * RATE_HZ)
"""Samples of a segment; what is left over at the end of a stretch is in none."""
CONTACT_N = 0.15
"""A segment whose mean normal force is below this was not felt: the tool was lifted, or only brushed the surface. Force
sensors of tools drift by a few hundredths of a newton; explorations press with 0.2 N and more."""


@dataclass(frozen=True)
class Segments:
    """Acceleration on one axis in m/s^2, speed in mm/s and force in N, each (segments, 500)."""

    vibration: Array
    speed_mm_s: Array
    force_N: Array

    def only(self, chosen: NDArray[np.bool_]) -> Segments:
        """Those chosen by a mask (segments,)."""
        return Segments(self.vibration[chosen], self.speed_mm_s[chosen], self.force_N[chosen])


def contact(touch: Touch) -> NDArray[np.bool_]:
    """Whether the tool was in contact during each segment: (segments,), in the order of `segments`.

    Raises FeatureError where it never was, for `CONTACT_N` on the mean of a segment.
    """
    mean_N = np.array([each.force_N.mean() for stretch in touch.stretches for each in _cut(stretch)])
    pressed = mean_N >= CONTACT_N
    if mean_N.size and not pressed.any():
        raise FeatureError(
            f"{touch.where}: no contact in any of {mean_N.size} segments: the mean normal force is {mean_N.max():.2g} N"
            f" at most, {CONTACT_N:g} N is expected; was the force sensor connected, its unit N, its zero right?"
        )
    return pressed


def segments(touch: Touch) -> Segments:
    """The segments of every stretch, one after another, none over a hole.

    DFT321 sees one segment at a time: its spectrum is exactly the root of the summed spectra of the axes, and its
    energy stays in the segment. Raises FeatureError where no stretch is as long as a segment.
    """
    found = [each for stretch in touch.stretches for each in _cut(stretch)]
    if not found:
        longest = max((len(each.axes) for each in touch.stretches), default=0) / RATE_HZ
        raise FeatureError(
            f"{touch.where}: the longest stretch is {longest:.3g} s; a segment takes {SEGMENT_S:g} s: record longer, or"
            " trim less"
        )
    return Segments(
        np.stack([dft321(each.axes) for each in found]),
        np.stack([each.speed_mm_s for each in found]),
        np.stack([each.force_N for each in found]),
    )


def _cut(stretch: Stretch) -> Iterator[Stretch]:
    for start in range(0, len(stretch.axes) - SEGMENT + 1, SEGMENT):
        yield stretch.cut(start, start + SEGMENT)
