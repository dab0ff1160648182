"""Errors of a method on a sine, by running it: the error in the pass band, the leak from the stop band."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from palpate.signals.aligning.aligned import align, grid_points
from palpate.signals.aligning.methods import METHODS
from palpate.signals.arrays import Array

HAND_HZ = 25.0
"""Force and speed are low-passed here (thesis 3.4.1, 4.3.3): what a hand does lies below."""
OFF = 1.0061
"""The stream's clock is off the grid's, so that all phases between samples come up."""
MARGIN_S = 1.0


@lru_cache(maxsize=256)
def sine_error(method: str, rate_hz: float, grid_hz: float, at_hz: float = HAND_HZ) -> float:
    """Return the RMS error relative to the sine's RMS, over all phases, away from edges; 1 where the stream cannot hold
    it.

    No signal with its power below `at_hz` has a larger one: for pchip, which is not linear, that is no theorem.
    """
    if at_hz >= rate_hz / 2:
        return 1.0
    aligned, grid_s = _through(method, rate_hz, grid_hz, at_hz)
    return _rms(aligned - _turning(grid_s, at_hz))


@lru_cache(maxsize=256)
def leak(method: str, rate_hz: float, grid_hz: float) -> float | None:
    """Return what is left of a sine a tenth above half the grid's rate, folded down: 0 none, 1 all.

    None where the stream cannot hold such a sine.
    """
    at_hz = 1.1 * grid_hz / 2
    if at_hz >= rate_hz / 2:
        return None
    return _rms(_through(method, rate_hz, grid_hz, at_hz)[0])


def _through(method: str, rate_hz: float, grid_hz: float, at_hz: float) -> tuple[Array, Array]:
    """Return the sine and cosine sampled and aligned, and the grid, both without what lies near the edges."""
    seconds = 2 * MARGIN_S + max(2.0, 400 / rate_hz)
    times_s = np.arange(int(seconds * rate_hz)) / (rate_hz * OFF)
    grid_s = grid_points(MARGIN_S, times_s[-1] - MARGIN_S, grid_hz)
    aligned = align(times_s, _turning(times_s, at_hz), grid_s, METHODS[method], rate_hz=rate_hz * OFF, grid_hz=grid_hz)
    return aligned.values, grid_s


def _turning(times_s: Array, at_hz: float) -> Array:
    angle = 2 * np.pi * at_hz * times_s
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _rms(pairs: Array) -> float:
    """Return the RMS of a sine and its cosine together: 1 for the sine itself."""
    return float(np.sqrt((pairs**2).sum(axis=1).mean()))
