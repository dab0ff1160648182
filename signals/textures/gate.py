"""Silence where the hand rests, without a click: the thresholds of thesis 4.5.3 with a smooth begin and stop."""

from __future__ import annotations

import math

SLOWEST_MM_S, FAINTEST_N = 10.0, 0.15
RAMP = 8
"""Milliseconds from silence to full, and back, along a raised cosine."""
GAINS = tuple(0.5 - 0.5 * math.cos(math.pi * step / RAMP) for step in range(RAMP + 1))


class Gate:
    """Opens while speed and force are above their thresholds. `place` is how far it is open, 0 to RAMP."""

    __slots__ = ("place",)

    def __init__(self) -> None:
        """Closed."""
        self.place = 0

    def move(self, speed_mm_s: float, force_N: float) -> bool:
        """Return one millisecond on; whether the hand touches and moves."""
        if speed_mm_s > SLOWEST_MM_S and force_N > FAINTEST_N:
            if self.place < RAMP:
                self.place += 1
            return True
        if self.place:
            self.place -= 1
        return False
