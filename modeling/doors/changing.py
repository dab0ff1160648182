"""Five small changes of a force profile (thesis 5.5.1): what a training variant differs in from its stimulus.

All but the amplitude keep the force at 0 degrees, and all keep the zeros behind the motion of a door that opens less
far. `amount` is in the unit of the change's own entry in `training_variants.KINDS`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS_PER_DEG

Change = Callable[[Array, float, np.random.Generator], Array]

RAMP_DEG = 5.0
"""Over the first and last so many degrees of the motion, a shift grows from nothing and goes back to nothing."""
SMOOTHED_DEG = 20.0
"""How long a stretch is smoothed; at its ends, over a quarter of it each, the smoothed turns into the original."""
SPIKE_DEG = 1.0
"""Width of a spike at its foot."""


def noise(force_N: Array, amount: float, draw: np.random.Generator) -> Array:
    """White Gaussian noise of SD `amount`, in newtons, at every point."""
    end = motion_end(force_N)
    changed = force_N.copy()
    changed[1 : end + 1] += amount * draw.standard_normal(end)
    return changed


def shift(force_N: Array, amount: float, _draw: np.random.Generator) -> Array:
    """Everything `amount` degrees later (below 0: earlier), except the two ends of the motion, which stay."""
    end = motion_end(force_N)
    place = np.arange(end + 1) / POINTS_PER_DEG
    ramp = min(RAMP_DEG, place[-1] / 2)
    if ramp == 0:
        return force_N.copy()
    share = np.minimum(1.0, np.minimum(place, place[-1] - place) / ramp)
    # farther than the ramp is long, two angles would change their order
    moved = place + float(np.clip(amount, -0.9 * ramp, 0.9 * ramp)) * share
    changed = force_N.copy()
    changed[: end + 1] = np.interp(place, moved, force_N[: end + 1])
    return changed


def smoothing(force_N: Array, amount: float, draw: np.random.Generator) -> Array:
    """A moving average of `amount` degrees along a stretch of 20 degrees that is drawn."""
    end = motion_end(force_N)
    points = 2 * round(amount * POINTS_PER_DEG / 2) + 1
    moving = force_N[: end + 1]
    padded = np.pad(moving, points // 2, mode="edge")
    average = np.convolve(padded, np.full(points, 1 / points), mode="valid")
    middle = draw.uniform(0.0, 1.0) * end / POINTS_PER_DEG
    away = np.abs(np.arange(end + 1) / POINTS_PER_DEG - middle) / (SMOOTHED_DEG / 2)
    share = np.clip(2 * (1 - away), 0.0, 1.0)
    share[0] = 0.0
    changed = force_N.copy()
    changed[: end + 1] = moving + share * (average - moving)
    return changed


def amplitude(force_N: Array, amount: float, _draw: np.random.Generator) -> Array:
    """Every force `amount` percent greater."""
    return force_N * (1 + amount / 100)


def spike(force_N: Array, amount: float, draw: np.random.Generator) -> Array:
    """A bump of `amount` newtons and 1 degree (a raised cosine), at an angle that is drawn."""
    end = motion_end(force_N)
    reach = SPIKE_DEG / 2
    middle = draw.uniform(reach, max(reach, end / POINTS_PER_DEG - reach))
    away = np.abs(np.arange(end + 1) / POINTS_PER_DEG - middle) / reach
    changed = force_N.copy()
    changed[: end + 1] += np.where(away < 1, amount / 2 * (1 + np.cos(np.pi * away)), 0.0)
    return changed


def motion_end(force_N: Array) -> int:
    """The last point before the zeros of a door that opens less than 62 degrees; the last of all where all are 0."""
    moving = np.flatnonzero(force_N)
    return int(moving[-1]) if moving.size else len(force_N) - 1
