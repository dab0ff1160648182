"""A hand's speed and force as they may be believed: what no hand does is not passed on."""

from __future__ import annotations

ABSURD_MM_S, ABSURD_N = 5000.0, 100.0
"""No hand strokes so fast or presses so hard: such a number comes from a broken sensor."""
HELD_STEPS = 50
"""So many milliseconds the last good values stand in; then the hand counts as away."""


class Sense:
    """Passes speed and force on; holds the last good ones where a number is none or absurd, rest where that lasts."""

    __slots__ = ("_bad", "_force", "_speed", "held")

    def __init__(self) -> None:
        """Nothing touches yet."""
        self._speed = self._force = 0.0
        self._bad = 0
        self.held = 0

    def take(self, speed_mm_s: float, force_N: float) -> tuple[float, float]:
        """Return both as they may be used; `held` counts the steps at which they were not as they came."""
        if -ABSURD_MM_S < speed_mm_s < ABSURD_MM_S and -ABSURD_N < force_N < ABSURD_N:
            self._speed, self._force, self._bad = float(speed_mm_s), float(force_N), 0
            return self._speed, self._force
        self.held += 1
        self._bad += 1
        if self._bad > HELD_STEPS:
            return 0.0, 0.0
        return self._speed, self._force
