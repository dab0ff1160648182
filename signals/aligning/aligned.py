"""Put one stream on a grid: whole stretches by a method, short gaps bridged and marked, long gaps left empty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.signals.aligning.methods import SAME_S, Method
from palpate.signals.aligning.refusals import AlignError, demand_grid, demand_samples, demand_times
from palpate.signals.arrays import Array, Mask

LONGEST_GAP_S = 0.02
"""Half a period of 25 Hz, the fastest hand movement (thesis 3.4.1); the movement in a longer gap is unknown."""
MOST_POINTS = 1e8
LACKS = 0.5
"""Samples further apart than one step plus this share of a step have a gap between them."""


@dataclass(frozen=True)
class Hole:
    """Missing samples between two that exist, `seconds` more than a step apart."""

    after_s: float
    before_s: float
    seconds: float
    bridged: bool


@dataclass(frozen=True)
class Aligned:
    """Values (m, channels) on the grid, NaN where unknown; `bridged` (m,) marks grid points within a short gap.

    `not_finite` samples were not finite and count as missing. `empty` is the number of grid points without a value.
    """

    values: Array
    bridged: Mask
    holes: tuple[Hole, ...]
    not_finite: int

    @property
    def empty(self) -> int:
        """Return the number of grid points without a value."""
        return int(np.isnan(self.values[:, 0]).sum())


def align(
    times_s: Array, values: Array, grid_s: Array, method: Method, *, rate_hz: float, grid_hz: float,
    longest_gap_s: float = LONGEST_GAP_S,
) -> Aligned:  # fmt: skip
    """Resample values (n, channels), taken at times (n,) at about `rate_hz`, onto a grid (m,) of `grid_hz`.

    Nothing is extrapolated: before the first sample, after the last and in gaps longer than `longest_gap_s` the grid
    stays NaN. A sample with a channel that is not finite counts as missing.

    Raises:
        AlignError: no samples, a single one, times that are not finite, stand, come twice or out of order; less than
            two samples that are numbers; what the method cannot take.
    """
    demand_samples(times_s, values)
    demand_times(times_s)
    demand_grid(grid_s, grid_hz)
    if not (np.isfinite(rate_hz) and rate_hz > 0 and longest_gap_s >= 0):
        raise AlignError(f"a rate of {rate_hz} Hz and a longest gap of {longest_gap_s} s: positive numbers are needed")
    sound = np.isfinite(values).all(axis=1)
    if sound.sum() < 2:
        raise AlignError(f"{int(sound.sum())} of {len(values)} samples are finite numbers: two or more are needed")
    times_s, values = times_s[sound], values[sound]
    holes: list[Hole] = []
    for place in np.flatnonzero(np.diff(times_s) > (1 + LACKS) * (1 / rate_hz)):
        after_s, before_s = float(times_s[place]), float(times_s[place + 1])
        seconds = before_s - after_s - 1 / rate_hz
        holes.append(Hole(after_s, before_s, seconds, seconds <= longest_gap_s + SAME_S))
    aligned = np.full((len(grid_s), values.shape[1]), np.nan)
    # The first and last sample of each stretch between long holes.
    cuts = np.searchsorted(times_s, [hole.before_s for hole in holes if not hole.bridged])
    for first, last in zip([0, *cuts], [*(cuts - 1), len(times_s) - 1], strict=True):
        inside = slice(*np.searchsorted(grid_s, [times_s[first] - SAME_S, times_s[last] + SAME_S]))
        if last > first and inside.stop > inside.start:
            part = slice(first, last + 1)
            aligned[inside] = method.run(times_s[part], values[part], grid_s[inside], rate_hz, grid_hz)
    bridged = np.zeros(len(grid_s), dtype=bool)
    for hole in holes:
        if hole.bridged:
            first, last = np.searchsorted(grid_s, [hole.after_s + SAME_S, hole.before_s - SAME_S])
            bridged[first:last] = True
    return Aligned(aligned, bridged, tuple(holes), int((~sound).sum()))


def grid_points(start_s: float, end_s: float, grid_hz: float) -> Array:
    """Return the times of a grid between start and end, as whole numbers of steps since the session began.

    All exports of a session share these times. Raises AlignError for fewer than two points, or more than fit into
    memory.
    """
    if not (np.isfinite([start_s, end_s, grid_hz]).all() and grid_hz > 0):
        raise AlignError(f"a grid of {grid_hz} Hz from {start_s} to {end_s} s: finite numbers are needed")
    first, last = np.ceil((start_s - SAME_S) * grid_hz), np.floor((end_s + SAME_S) * grid_hz)
    if last - first < 1:
        raise AlignError(f"from {start_s:.3f} to {end_s:.3f} s there are less than two points at {grid_hz:g} Hz")
    if last - first > MOST_POINTS:
        raise AlignError(f"a grid of {last - first:.3g} points: at most {MOST_POINTS:.3g} are computed; lower the rate")
    return np.arange(first, last + 1) / grid_hz
