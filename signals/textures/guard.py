"""Watch a running model, and restart it with a short cross-fade when it leaves its bounds."""

from __future__ import annotations

import math
from typing import Protocol

from palpate.signals.textures.gate import GAINS, RAMP
from palpate.signals.textures.range import Range


class Sounding(Protocol):
    """A model that runs on its own output from a beginning."""

    def begin(self) -> None:
        """Forget the past: the next step is the first of a touch."""

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2; NaN where the model has no answer."""


MEMORY_MS = 16
"""Time constant of the level and of the mean."""
KEEP = math.exp(-1 / MEMORY_MS)
QUIET = 0.01
"""Below this share of the training's level a model counts as dead; it is counted, not restarted (a texture may be
faint).
"""
MOST, WELL = 4, 1000
"""A model that is restarted more often, without so many good steps in between, is paused."""
PAUSE, LONGEST = 40, 5
"""Milliseconds of silence before the next try, doubled each time up to five times."""


class Guard:
    """A wrapper of a model that makes every sample finite and within the peak.

    The model is restarted for an answer that is not finite or beyond the peak, a level above `loud`, or a mean beyond
    `off`. For the record, `restarts` counts restarts, `quiet` steps of a silent model, `muted` steps of silence before
    a model is tried again.
    """

    def __init__(self, inner: Sounding, bounds: Range, level: float) -> None:
        """Take the guarded model; `level` is the RMS of the training part."""
        self.inner = inner
        self.restarts = self.quiet = self.muted = 0
        self._loud, self._off, self._peak = bounds.loud**2, bounds.off, bounds.peak
        self._faint = (QUIET * level) ** 2
        self._level = level
        self.begin()

    def begin(self) -> None:
        """Begin a touch."""
        self.inner.begin()
        self._settle()
        self._last = self._tail = 0.0
        self._fade = RAMP
        self._recent = self._well = self._pause = self._pauses = 0

    def _settle(self) -> None:
        self._square, self._mean = self._level**2, 0.0

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2."""
        if self._pause:
            return self._silent()
        sample = self.inner.step(speed_mm_s, force_N)
        if not self._sound(sample):
            sample = self._anew(speed_mm_s, force_N)
        self._last = sample = self._faded(sample)
        return sample

    def _sound(self, sample: float) -> bool:
        """Update the level and the mean, and return whether the model is within its bounds."""
        if not -self._peak <= sample <= self._peak:  # also where it is no number
            return False
        self._square += (1 - KEEP) * (sample * sample - self._square)
        self._mean += (1 - KEEP) * (sample - self._mean)
        self.quiet += self._square < self._faint
        self._well += 1
        if self._well == WELL:
            self._recent = self._pauses = 0
        return self._square <= self._loud and -self._off <= self._mean <= self._off

    def _anew(self, speed_mm_s: float, force_N: float) -> float:
        """Restart the model, and return its first sample; what was played last fades out meanwhile."""
        self.restarts += 1
        self._recent, self._well = self._recent + 1, 0
        self._tail, self._fade = self._last, 0
        if self._recent > MOST:
            self._pause = PAUSE << min(self._pauses, LONGEST)
            self._pauses += 1
        self._settle()
        self.inner.begin()
        sample = self.inner.step(speed_mm_s, force_N)
        return sample if -self._peak <= sample <= self._peak else 0.0

    def _silent(self) -> float:
        """Return one sample of a pause, at whose end the model begins anew."""
        self._pause -= 1
        self.muted += 1
        self._last = sample = self._faded(0.0)
        if not self._pause:
            self._recent, self._tail, self._fade = 0, 0.0, 0
            self._settle()
            self.inner.begin()
        return sample

    def _faded(self, sample: float) -> float:
        if self._fade == RAMP:
            return sample
        self._fade += 1
        gain = GAINS[self._fade]
        return gain * sample + (1 - gain) * self._tail
