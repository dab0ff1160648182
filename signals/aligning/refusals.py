"""Checks of samples, times and grids before they are aligned."""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array


class AlignError(ValueError):
    """Samples, times or a grid that no method can align; the message says where and what is expected."""


def demand_times(times_s: Array) -> None:
    """Raise AlignError unless there are two or more finite times, each after the one before."""
    if times_s.ndim != 1:
        raise AlignError(f"the times have shape {times_s.shape}: one time for each sample is expected")
    if times_s.size == 0:
        raise AlignError("there are no samples")
    bad = np.flatnonzero(~np.isfinite(times_s))
    if bad.size:
        raise AlignError(f"sample {bad[0] + 1} is timed {times_s[bad[0]]}: a finite number of seconds is needed")
    if times_s.size == 1:
        raise AlignError("there is one sample: two or more are needed to align by")
    wrong = np.flatnonzero(np.diff(times_s) <= 0)
    if wrong.size:
        place = int(wrong[0])
        one, other = times_s[place], times_s[place + 1]
        if times_s.min() == times_s.max():
            raise AlignError(f"all {times_s.size} samples are timed {one:g} s: a clock that has stopped says nothing")
        how = "the same time twice" if one == other else "out of order"
        pair = f"samples {place + 1} and {place + 2} are timed {one:.9g} s and {other:.9g} s"
        raise AlignError(f"{pair}: {how}; times must rise")


def demand_samples(times_s: Array, values: Array) -> None:
    """Raise AlignError unless there is one row of values for each time."""
    if values.ndim != 2 or values.shape[0] != times_s.shape[0] or values.shape[1] == 0:
        raise AlignError(f"values of shape {values.shape} for {times_s.shape[0]} times: rows of channels are expected")


def demand_grid(grid_s: Array, grid_hz: float) -> None:
    """Raise AlignError unless the grid's points are finite and rise, and its rate is positive."""
    if not (np.isfinite(grid_hz) and grid_hz > 0):
        raise AlignError(f"a grid of {grid_hz} Hz: a positive rate is needed")
    if grid_s.ndim != 1 or not np.isfinite(grid_s).all() or (np.diff(grid_s) <= 0).any():
        raise AlignError("the grid's times must be finite and rise")
