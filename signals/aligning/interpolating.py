"""Values between samples from the samples beside them: hold, nearest, linear, PCHIP and cubic spline.

All take times (n,), values (n, channels) and the times wanted (m,), which lie within the first and the last time, and
give values (m, channels). None of them filters: what lies above half the grid's rate is folded down.
"""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array

SAME_S = 1e-9
"""Times closer than this are one time: far below any sensor's step, far above the rounding of session times."""


def hold(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Return the last sample at or before: causal, late by half a sample's step on average."""
    before = np.searchsorted(times_s, grid_s + SAME_S, side="right") - 1
    return np.asarray(values[np.maximum(before, 0)])


def nearest(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Return the sample closest in time; of two that are as close, the earlier."""
    after = np.clip(np.searchsorted(times_s, grid_s), 1, len(times_s) - 1)
    earlier = grid_s - times_s[after - 1] <= times_s[after] - grid_s
    return np.asarray(values[np.where(earlier, after - 1, after)])


def linear(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Return the straight line between the two samples around."""
    return np.stack([np.interp(grid_s, times_s, channel) for channel in values.T], axis=1)


def pchip(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Interpolate by piecewise cubic Hermite polynomials, monotone where the samples are (Fritsch and Butland 1984)."""
    from scipy.interpolate import PchipInterpolator

    return np.asarray(PchipInterpolator(times_s, values, axis=0)(_inside(times_s, grid_s)))


def cubic(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Interpolate by a cubic spline with continuous curvature, not-a-knot at its ends."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(times_s, values, axis=0)(_inside(times_s, grid_s)))


def _inside(times_s: Array, grid_s: Array) -> Array:
    """Rounding must not make a polynomial reach beyond its samples."""
    return np.clip(grid_s, times_s[0], times_s[-1])
