"""What stands out in a door profile: peaks, valleys, cycles, the plateau, and the numbers of the stimulus table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.door.grid import POINTS, POINTS_PER_DEG, DoorDataError, motion_end

Array = NDArray[np.float64]

FELT_N = 1.0
"""Least prominence of a peak that is counted."""
MAJOR_SHARE = 0.15
"""Least prominence of a major peak, as a share of the profile's range of force."""
MAJOR_N = 3.0
"""Least prominence of a major peak, in newtons."""
PLATEAU_SLOPE_SHARE = 0.5
"""On a plateau the force falls at less than this share of the steepest fall before it and of that after it."""
SMOOTH_POINTS = 21
"""Length of the moving average that roughness is measured against: two degrees."""
END_DEG = 5
"""The last part of the motion, for the end slope."""
INITIAL_DEG = 5
"""The first part of the motion, for the initial force."""


@dataclass(frozen=True)
class Landmarks:
    """Grid indices of the major peaks and of the valley that ends each one's cycle."""

    peaks: tuple[int, ...]
    valleys: tuple[int, ...]
    end: int


def peaks_of(force_N: Array, least_N: float) -> list[int]:
    """Indices of the local maxima that stand out by at least `least_N`.

    A peak's prominence is its height over the higher of the two lowest points between it and higher ground (or
    the profile's end) on either side; of a flat top, the middle counts; the two ends are never peaks.
    """
    return [top for top in _tops(force_N) if _prominence(force_N, top) >= least_N]


def landmarks(force_N: Array) -> Landmarks:
    """Find the major peaks and valleys of the part before the zero padding."""
    end = motion_end(tuple(force_N.tolist()))
    moving = force_N[: end + 1]
    peaks = peaks_of(moving, max(MAJOR_N, MAJOR_SHARE * float(np.ptp(moving))))
    ends = [*peaks[1:], end + 1]
    valleys = [peak + int(np.argmin(moving[peak:stop])) for peak, stop in zip(peaks, ends, strict=False)]
    return Landmarks(tuple(peaks), tuple(valleys), end)


def require_cycles(force_N: Array, count: int, purpose: str) -> Landmarks:
    """The landmarks of a profile that has at least `count` cycles, or a refusal that names the purpose."""
    found = landmarks(force_N)
    if len(found.peaks) < count:
        at = ", ".join(f"{peak / POINTS_PER_DEG:.1f}" for peak in found.peaks) or "none"
        raise DoorDataError(f"{purpose} needs {count} major peaks; this profile has {len(found.peaks)} (at {at} deg).")
    return found


def plateau_after_second_peak(force_N: Array, purpose: str) -> tuple[int, int]:
    """First and last grid index of the plateau on the way from the second peak to its valley.

    It is where the descent slows down between two steep parts. Raises DoorDataError where the force falls from
    the second peak in one go.
    """
    found = require_cycles(force_N, 2, purpose)
    top, bottom = found.peaks[1], found.valleys[1]
    fall = _smooth(-np.diff(force_N[top : bottom + 1]), POINTS_PER_DEG)
    steep = np.minimum(np.maximum.accumulate(fall), np.maximum.accumulate(fall[::-1])[::-1])
    slow = (steep > 0) & (fall < PLATEAU_SLOPE_SHARE * steep)
    if not slow.any():
        raise DoorDataError(f"{purpose} needs a plateau after the second peak; here the force falls in one go.")
    first = last = int(np.argmax(np.where(slow, steep - fall, -np.inf)))
    while slow[first - 1]:
        first -= 1
    while slow[last + 1]:
        last += 1
    return top + first, top + last + 1


def describe(force_N: Array) -> dict[str, float]:
    """The numeric columns of the stimulus table; see docs/reference/doors.md for each one's definition."""
    found = landmarks(force_N)
    moving = force_N[: found.end + 1]
    felt = peaks_of(moving, FELT_N)
    first = found.peaks[0] if found.peaks else int(np.argmax(moving))
    return {
        "first_peak_N": float(moving[first]),
        "first_peak_deg": first / POINTS_PER_DEG,
        "peak_count": float(len(felt)),
        "initial_force_N": float(moving[: INITIAL_DEG * POINTS_PER_DEG + 1].mean()),
        "mean_force_N": float(moving.mean()),
        "max_force_N": float(moving.max()),
        "min_force_N": float(moving.min()),
        "drop_N": _largest_drop(moving, felt),
        "end_slope_N_deg": _slope(moving[-(END_DEG * POINTS_PER_DEG + 1) :]),
        "roughness_N": _roughness(moving),
        "opening_deg": found.end / POINTS_PER_DEG,
    }


def as_profile(force_N: Array | tuple[float, ...] | list[float], where: str = "profile") -> Array:
    """The profile as a float array, or a refusal when it does not have 621 finite points."""
    profile = np.asarray(force_N, dtype=np.float64)
    if profile.shape != (POINTS,):
        raise DoorDataError(f"{where}: {POINTS} points expected, found an array of shape {profile.shape}.")
    bad = np.flatnonzero(~np.isfinite(profile))
    if bad.size:
        raise DoorDataError(f"{where}: the force at {bad[0] / POINTS_PER_DEG} deg is {profile[bad[0]]}.")
    return profile


def _tops(force_N: Array) -> list[int]:
    """Middles of all runs of equal values with lower values on both sides."""
    starts = np.flatnonzero(np.r_[True, np.diff(force_N) != 0])
    values = force_N[starts]
    inner = np.arange(1, len(starts) - 1)
    tops = inner[(values[inner] > values[inner - 1]) & (values[inner] > values[inner + 1])]
    return [int(starts[run] + starts[run + 1] - 1) // 2 for run in tops]


def _prominence(force_N: Array, top: int) -> float:
    height = force_N[top]
    higher = np.flatnonzero(force_N > height)
    left = higher[higher < top].max(initial=-1) + 1
    right = higher[higher > top].min(initial=len(force_N))
    return float(height - max(force_N[left : top + 1].min(), force_N[top:right].min()))


def _largest_drop(moving: Array, felt: list[int]) -> float:
    """Largest fall from a counted peak to the lowest point before the next one (0 without a peak)."""
    ends = [*felt[1:], len(moving)]
    return max((float(moving[a] - moving[a:b].min()) for a, b in zip(felt, ends, strict=False)), default=0.0)


def _slope(force_N: Array) -> float:
    """Least-squares slope in newtons per degree (0 for a single point)."""
    if len(force_N) < 2:
        return 0.0
    angle = np.arange(len(force_N)) / POINTS_PER_DEG
    angle -= angle.mean()
    return float(angle @ force_N / (angle @ angle))


def _roughness(moving: Array) -> float:
    """Root mean square of what a two-degree moving average leaves, without the first and last degree."""
    detail = (moving - _smooth(moving, SMOOTH_POINTS))[POINTS_PER_DEG:-POINTS_PER_DEG]
    return float(np.sqrt(np.mean(detail**2))) if detail.size else 0.0


def _smooth(values: Array, points: int) -> Array:
    """Centred moving average; near the ends the end value stands in for what is missing."""
    points = points | 1
    padded = np.pad(values, points // 2, mode="edge")
    return np.convolve(padded, np.full(points, 1 / points), mode="valid")
