"""The bump in a switch's down-stroke: how far and how steeply the force falls (linear, tactile, clicky)."""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array

FROM, TO = 0.05, 0.9
"""The part of the travel that counts, without the first contact and the bottom."""
NAMES = ("greatest fall, gf", "steepest fall, gf in 1 % of the travel", "place of the greatest fall, share of travel")


def bump(force_gf: Array) -> Array:
    """Return the features named in NAMES, (n, 3), of curves (n, 621); 0 where the force never falls."""
    points = force_gf.shape[1]
    inside = force_gf[:, int(FROM * points) : int(TO * points)]
    below = np.maximum.accumulate(inside, axis=1) - inside
    step = points // 100
    steepest = np.max(inside[:, :-step] - inside[:, step:], axis=1)
    return np.column_stack([below.max(axis=1), np.maximum(steepest, 0.0), FROM + below.argmax(axis=1) / points])
