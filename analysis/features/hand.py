"""How the hand moved in a segment: six numbers (thesis 3.4.1)."""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array

STATISTICS = ("speed min", "speed max", "speed mean", "force min", "force max", "force mean")


def hand(speed_mm_s: Array, force_N: Array) -> Array:
    """Speed in mm/s and normal force in N of segments (s, n) to `STATISTICS` (s, 6)."""
    columns = [way(each, axis=1) for each in (speed_mm_s, force_N) for way in (np.min, np.max, np.mean)]
    return np.stack(columns, axis=1)
