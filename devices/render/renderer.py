"""Switch textures without a click: the old voice and the new one sound together for a moment."""

from __future__ import annotations

import math

from palpate.signals.textures.voice import Voice

CROSS_MS = 20
MOST_CHANGE = 1 / CROSS_MS
"""Greatest change of the volume per millisecond."""
OLD = tuple(math.cos(math.pi * step / (2 * CROSS_MS)) for step in range(CROSS_MS + 1))
NEW = tuple(math.sin(math.pi * step / (2 * CROSS_MS)) for step in range(CROSS_MS + 1))
"""Gains of equal power: the two voices are independent, so their squares add."""


class Renderer:
    """A player of one voice that can switch to another one within 20 ms.

    Any thread may request a switch; one thread steps it. A voice is made (read, checked, built) before it is handed
    over, so that the step never waits. Of several requests within 20 ms the last one is played.
    """

    def __init__(self, voice: Voice | None = None) -> None:
        """Begin with this voice, or with silence."""
        self._now = self._queued = voice
        self._old: Voice | None = None
        self._place = CROSS_MS
        self.switches = 0
        self._gain = self._wanted = 1.0

    @property
    def voice(self) -> Voice | None:
        """Return the voice that is played, or will be as soon as the current switch has ended."""
        return self._queued

    def switch(self, voice: Voice | None) -> None:
        """Change to another voice, or to silence."""
        self._queued = voice

    def volume(self, gain: float) -> None:
        """Set the volume, 0 to 1, which is reached without a click."""
        if math.isfinite(gain):
            self._wanted = min(max(gain, 0.0), 1.0)

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2."""
        sample = self._next(speed_mm_s, force_N)
        gain, target = self._gain, self._wanted
        if gain != target:
            self._gain = gain = min(target, gain + MOST_CHANGE) if target > gain else max(target, gain - MOST_CHANGE)
        return sample if gain == 1.0 else gain * sample

    def _next(self, speed_mm_s: float, force_N: float) -> float:
        if self._queued is not self._now and self._place == CROSS_MS:
            self._old, self._now, self._place = self._now, self._queued, 0
            self.switches += 1
            if self._now is not None:
                self._now.join()
        now = self._now
        sample = 0.0 if now is None else now.step(speed_mm_s, force_N)
        if self._place == CROSS_MS:
            return sample
        return self._mixed(sample, speed_mm_s, force_N)

    def _mixed(self, sample: float, speed_mm_s: float, force_N: float) -> float:
        self._place += 1
        old, now, place = self._old, self._now, self._place
        before = 0.0 if old is None else old.step(speed_mm_s, force_N)
        if place == CROSS_MS:
            self._old = None
            if old is not None:
                old.begin()
        most = max(0.0 if voice is None else voice.peak for voice in (old, now))
        return max(-most, min(most, NEW[place] * sample + OLD[place] * before))
