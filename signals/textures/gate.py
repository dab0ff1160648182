"""Mute a texture without a click while the hand rests, and check the hand's speed and force.

The thresholds are those of thesis 4.5.3, with a smooth onset and end; implausible speeds and forces are not passed on.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from palpate.signals.arrays import Array

SLOWEST_MM_S, FAINTEST_N = 10.0, 0.15
"""Slower or lighter than this is no touch (thesis 4.5.3)."""
RAMP = 8
"""Milliseconds from silence to full level, and back, along a raised cosine."""
GAINS = tuple(0.5 - 0.5 * math.cos(math.pi * step / RAMP) for step in range(RAMP + 1))


def sounds(speed: Array, force: Array) -> NDArray[np.bool_]:
    """Return where a hand (n,) in mm/s and N moves and presses enough for the renderer to sound."""
    return (speed > SLOWEST_MM_S) & (force > FAINTEST_N)


class Gate:
    """A gate that opens while speed and force are above their thresholds. `place` is how far it is open, 0 to RAMP."""

    __slots__ = ("place",)

    def __init__(self) -> None:
        """Begin closed."""
        self.place = 0

    def move(self, speed_mm_s: float, force_N: float) -> bool:
        """Go one millisecond on, and return whether the hand touches and moves."""
        if speed_mm_s > SLOWEST_MM_S and force_N > FAINTEST_N:
            if self.place < RAMP:
                self.place += 1
            return True
        if self.place:
            self.place -= 1
        return False


ABSURD_MM_S, ABSURD_N = 5000.0, 100.0
"""Speeds and forces beyond these come from a broken sensor."""
HELD_STEPS = 50
"""Milliseconds for which the last good values are used; then the hand counts as at rest."""


class Sense:
    """A filter for speed and force: it holds the last good values for a while, then rest, where a number is
    implausible.
    """

    __slots__ = ("_bad", "_force", "_speed", "held")

    def __init__(self) -> None:
        """Begin without a touch."""
        self._speed = self._force = 0.0
        self._bad = 0
        self.held = 0

    def take(self, speed_mm_s: float, force_N: float) -> tuple[float, float]:
        """Return speed and force for use; `held` counts the steps at which they were replaced."""
        if -ABSURD_MM_S < speed_mm_s < ABSURD_MM_S and -ABSURD_N < force_N < ABSURD_N:
            self._speed, self._force, self._bad = float(speed_mm_s), float(force_N), 0
            return self._speed, self._force
        self.held += 1
        self._bad += 1
        if self._bad > HELD_STEPS:
            return 0.0, 0.0
        return self._speed, self._force
