"""Errors of a method on a sine, measured by running it: the error in the pass band, the leak from the stop band."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from palpate.signals.aligning.aligned import align, grid_points
from palpate.signals.aligning.methods import METHODS
from palpate.signals.arrays import Array

HAND_HZ = 25.0
"""The edge at which force and speed are low-passed (thesis 3.4.1, 4.3.3); hand movement lies below it."""
OFF = 1.0061
"""Ratio of the stream's clock to the grid's, so that all phases between samples occur."""
MARGIN_S = 1.0


@lru_cache(maxsize=256)
def sine_error(method: str, rate_hz: float, grid_hz: float, at_hz: float = HAND_HZ) -> float:
    """Return the RMS error relative to the sine's RMS, over all phases and away from the edges.

    It is 1 where the stream cannot represent the sine. No signal with its power below `at_hz` has a larger error; for
    PCHIP, which is not linear, this is not proven.
    """
    if at_hz >= rate_hz / 2:
        return 1.0
    aligned, grid_s = _through(method, rate_hz, grid_hz, at_hz)
    return _rms(aligned - _turning(grid_s, at_hz))


@lru_cache(maxsize=256)
def leak(method: str, rate_hz: float, grid_hz: float) -> float | None:
    """Return how much of a sine a tenth above half the grid's rate is folded down: 0 nothing, 1 all of it.

    Return None where the stream cannot represent such a sine.
    """
    at_hz = 1.1 * grid_hz / 2
    if at_hz >= rate_hz / 2:
        return None
    return _rms(_through(method, rate_hz, grid_hz, at_hz)[0])


def _through(method: str, rate_hz: float, grid_hz: float, at_hz: float) -> tuple[Array, Array]:
    """Return the sine and the cosine after sampling and aligning, and the grid, without the parts near the edges."""
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
