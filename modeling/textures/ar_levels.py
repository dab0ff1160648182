"""How loud a predictor runs: its innovations are set so that what it plays is as strong as what was recorded."""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array

PRIOR = 4.0
"""So many samples' worth of belief in the level that a point's own stretches have."""
STEPS = 50
ENOUGH = 1e-9
FURTHEST = 1.0
"""A Newton step changes no log SD by more."""


def levelled(log_sd: Array, shares: Array, squares: Array, gains: Array) -> Array:
    """The log SD of the innovations at each point (k,), from what the stretches gave.

    Where sample n, of the square `squares` (n,), has the shares (n, k) of the points and a predictor that makes white
    noise `gains` (n,) times as strong, its variance is gains exp(2 shares log_sd). The negative log likelihood of that,
    with the prior that nothing is to change, is convex in log_sd: Newton's method finds its one maximum.
    """
    powers = squares / gains
    found = log_sd.copy()
    for _ in range(STEPS):
        excess = powers * np.exp(-2 * np.clip(shares @ found, -300, 300))
        slope = shares.T @ (1 - excess) + PRIOR * (found - log_sd)
        bend = (shares * (2 * excess)[:, None]).T @ shares + PRIOR * np.eye(len(found))
        step = np.linalg.solve(bend, -slope)
        step *= min(1.0, FURTHEST / max(float(np.abs(step).max()), ENOUGH))
        found += step
        if np.abs(step).max() < ENOUGH:
            break
    return found
