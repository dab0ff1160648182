"""From a recording to the 621 points of a door profile (thesis 5.3.1.1 and 5.3.1.2).

"Downsampled and truncated to 10 points" is implemented as follows: only rows that advance the opening are kept, the
force between them is linear over the angle, and each grid point is the mean of that line over its tenth of a degree
(the point at 0 degrees is the line's value there). So neither the opening speed nor the sampling rate matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from palpate.signals.arrays import Array
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, POINTS_PER_DEG, DoorDataError, grid_angle_deg

LEAST_OPENING_DEG = 2.0
"""A recording that covers less of the grid than this is refused."""
LARGEST_GAP_DEG = 2.0
"""Widest gap between rows that is bridged by a straight line."""
GREATEST_N = 1e9
"""Greatest force of a door; squares of smaller numbers stay far from overflow."""
SAME_ANGLE_DEG = 1e-9
"""Angles closer than this are one angle: far below any encoder's step, far above rounding."""


@dataclass(frozen=True)
class NormalisedProfile:
    """The 621 forces, and how they were obtained."""

    force_N: Array
    rows: int
    backward_rows: int
    rows_after_opening: int
    padded_points: int
    widest_gap_deg: float
    zero_deg: float


def normalise(
    angle_deg: ArrayLike, force_N: ArrayLike, *, zero: bool = False, largest_gap_deg: float = LARGEST_GAP_DEG
) -> NormalisedProfile:
    """Resample an opening to 621 points over 0 to 62 degrees, zero-padded where the door does not reach.

    Only the opening counts: rows after the largest angle was first reached are left out, and so are rows behind the
    largest angle so far (backlash, a hand that gives way); rows at one angle are averaged. With `zero`, rows before the
    first motion are left out and the angle there becomes 0.

    Raises:
        DoorDataError: unequal lengths, a value that is not finite (with its row, counted from 1), a force beyond
            1e9 N, less than 2 degrees of opening, or a gap wider than `largest_gap_deg`.
    """
    angle, force = _checked(angle_deg, force_N)
    demand_force(force, "the recording")
    rows = len(angle)
    start_deg = 0.0
    if zero:
        # Cut off the rest before the door leaves its first angle for good, and count the angle from there.
        top = int(np.argmax(angle))
        leaves = int(np.flatnonzero(angle[: top + 1] <= angle[0])[-1])
        zero_deg = float(np.median(angle[: leaves + 1]))
        angle, force, start_deg = angle[leaves:] - zero_deg, force[leaves:], zero_deg
    last = int(np.argmax(angle)) + 1
    after = len(angle) - last
    angle, force = angle[:last], force[:last]
    ahead = angle >= np.maximum.accumulate(angle)
    backward = int((~ahead).sum())
    angle, force = _one_force_per_angle(angle[ahead], force[ahead])
    _refuse_short(angle)
    # The widest stretch without rows on the way from 0 to the largest angle; it may be bridged up to a limit.
    inside = np.r_[0.0, angle[(angle > 0) & (angle <= MAX_ANGLE_DEG)], min(angle[-1], MAX_ANGLE_DEG)]
    gaps = np.diff(inside)
    widest = int(np.argmax(gaps))
    if gaps[widest] > largest_gap_deg:
        raise DoorDataError(
            f"No rows between {inside[widest]:.2f} and {inside[widest + 1]:.2f} degrees: a gap of {gaps[widest]:.2f} "
            f"is wider than the {largest_gap_deg:g} degrees that are bridged. Record this part again, or use --zero "
            "when the recording does not start at 0."
        )
    gap = float(gaps[widest])
    profile, padded = _resample(angle, force)
    return NormalisedProfile(profile, rows, backward, after, padded, gap, start_deg)


def demand_force(force_N: Array, where: str) -> None:
    """Raise DoorDataError for a number that is not a plausible force of a door."""
    if (most := float(np.abs(force_N).max())) > GREATEST_N:
        raise DoorDataError(f"{where}: a force of {most:g} N; a door's is at most {GREATEST_N:g}.")


def upsample_angle(
    force_time_s: ArrayLike, force_N: ArrayLike, angle_time_s: ArrayLike, angle_deg: ArrayLike
) -> tuple[Array, Array]:
    """Bring a slower angle recording to the force's rate, linear between its rows (thesis 5.3.1.1).

    Returns angle and force at the force's times that both recordings cover; nothing is extrapolated.

    Raises:
        DoorDataError: times that do not rise, or recordings that share less than two force rows.
    """
    force_time, force = _checked(force_time_s, force_N, "force time")
    angle_time, angle = _checked(angle_time_s, angle_deg, "angle time", "angle")
    for name, times in (("force", force_time), ("angle", angle_time)):
        wrong = np.flatnonzero(np.diff(times) <= 0)
        if wrong.size:
            row = int(wrong[0]) + 2
            raise DoorDataError(f"The {name} recording's time does not rise at row {row}: {times[row - 1]:g} s.")
    shared = (force_time >= angle_time[0]) & (force_time <= angle_time[-1])
    if shared.sum() < 2:
        raise DoorDataError(
            f"The recordings do not overlap: force from {force_time[0]:g} to {force_time[-1]:g} s, "
            f"angle from {angle_time[0]:g} to {angle_time[-1]:g} s. Do both clocks start together?"
        )
    return np.interp(force_time[shared], angle_time, angle), force[shared]


def _checked(first: ArrayLike, second: ArrayLike, name: str = "angle", other: str = "force") -> tuple[Array, Array]:
    pair = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if pair[0].ndim != 1 or pair[0].shape != pair[1].shape:
        raise DoorDataError(f"{name} has shape {pair[0].shape} and {other} {pair[1].shape}: one value each a row.")
    if not pair[0].size:
        raise DoorDataError("The recording has no rows.")
    for word, values in ((name, pair[0]), (other, pair[1])):
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise DoorDataError(f"Row {bad[0] + 1}: the {word} is {values[bad[0]]}, a finite number is needed.")
    return pair


def _one_force_per_angle(angle: Array, force: Array) -> tuple[Array, Array]:
    """Average rows at equal angles (a door at rest, an encoder's step), so that the angles rise strictly."""
    groups = np.cumsum(np.r_[0, np.diff(angle) > SAME_ANGLE_DEG])
    counts = np.bincount(groups)
    starts = np.r_[0, np.cumsum(counts)[:-1]]
    return angle[starts], np.bincount(groups, weights=force) / counts


def _refuse_short(angle: Array) -> None:
    covered = min(angle[-1], MAX_ANGLE_DEG) - max(angle[0], 0.0)
    if covered >= LEAST_OPENING_DEG:
        return
    raise DoorDataError(
        f"The opening runs from {angle[0]:.3f} to {angle[-1]:.3f}: less than {LEAST_OPENING_DEG:g} degrees of it lie "
        f"between 0 and {MAX_ANGLE_DEG}. Is the angle in radians (--radians), offset (--zero), or falling while "
        "the door opens?"
    )


def _resample(angle: Array, force: Array) -> tuple[Array, int]:
    """Return the means of the linearly interpolated force over each tenth of a degree, and the number of padded
    points.
    """
    grid = np.array([grid_angle_deg(index) for index in range(POINTS)])
    reached = int(np.searchsorted(grid, angle[-1] + SAME_ANGLE_DEG, side="right"))
    half = 0.5 / POINTS_PER_DEG
    low = grid[1:reached] - half
    high = np.minimum(grid[1:reached] + half, angle[-1])
    # The integral of the straight-line force from the first angle to each upper limit; the first force holds before.
    upper = np.r_[low, high]
    areas = np.r_[0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(angle))]
    before = np.clip(np.searchsorted(angle, upper, side="right") - 1, 0, len(angle) - 1)
    rest = upper - angle[before]
    area = np.asarray(areas[before] + 0.5 * rest * (force[before] + np.interp(upper, angle, force)))
    means = (area[len(low) :] - area[: len(low)]) / (high - low)
    profile = np.zeros(POINTS)
    profile[:reached] = np.r_[np.interp(0.0, angle, force), means]
    return profile, POINTS - reached
