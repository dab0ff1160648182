"""What a made profile may be at most, and how one that is more comes within it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG

Array = NDArray[np.float64]

LIMIT_N = 60.0
"""No made profile has a force beyond this; the study's own profiles reach 44.5 N."""
STEEPEST_N_DEG = 60.0
"""Nor a steeper change: 6 N from one point to the next, where the study's own doors break away with up to 8.7 N."""


def hardest() -> tuple[float, ...]:
    """A profile at the bounds of what may be made: up and down between them as steeply as is allowed."""
    step, length = STEEPEST_N_DEG / POINTS_PER_DEG, round(2 * LIMIT_N * POINTS_PER_DEG / STEEPEST_N_DEG)
    return tuple(LIMIT_N - step * abs(place % (2 * length) - length) for place in range(POINTS))


def bounded(force_N: Array, limit_N: float = LIMIT_N, steepest_N_deg: float = STEEPEST_N_DEG) -> Array:
    """The profile within `limit_N`, and no steeper than `steepest_N_deg`: where it is, it follows as fast as it may.

    Takes one profile, a force in newtons at every tenth of a degree, and returns a new one.
    """
    step = steepest_N_deg / POINTS_PER_DEG
    within = np.clip(force_N, -limit_N, limit_N)
    steep = (np.abs(np.diff(within)) > step).tolist()
    made: list[float] = within[:1].tolist()
    follows = False
    for wanted, too_steep in zip(within[1:].tolist(), steep, strict=True):
        last = made[-1]
        reached = min(max(wanted, last - step), last + step) if too_steep or follows else wanted
        follows = reached != wanted
        made.append(reached)
    return np.array(made)
