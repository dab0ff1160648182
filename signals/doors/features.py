"""Features of a door profile: peaks, valleys, cycles, the plateau, and the numbers of the stimulus table.

What models learn from is in `model_features`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG, DoorDataError, motion_end

COUNTED_N = 1.0
"""Least prominence of a counted peak, in newtons."""
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
    """Return the indices of the local maxima that stand out by at least `least_N`.

    A peak's prominence is its height over the higher of the two lowest points between it and higher ground (or
    the profile's end) on either side; of a flat top, the middle counts; the two ends are never peaks.
    """
    return [top for top, prominence in _tops(force_N) if prominence >= least_N]


def landmarks(force_N: Array) -> Landmarks:
    """Find the major peaks and valleys of the part before the zero padding."""
    return landmarks_and_peaks(force_N)[0]


def landmarks_and_peaks(force_N: Array) -> tuple[Landmarks, list[int]]:
    """Return the landmarks, and the grid indices of all peaks that stand out by at least COUNTED_N."""
    end = motion_end(tuple(force_N.tolist()))
    moving = force_N[: end + 1]
    tops = _tops(moving)
    major_N = max(MAJOR_N, MAJOR_SHARE * float(np.ptp(moving)))
    peaks = [top for top, prominence in tops if prominence >= major_N]
    ends = [*peaks[1:], end + 1]
    valleys = [peak + int(np.argmin(moving[peak:stop])) for peak, stop in zip(peaks, ends, strict=False)]
    marks = Landmarks(tuple(peaks), tuple(valleys), end)
    return marks, [top for top, prominence in tops if prominence >= COUNTED_N]


def require_cycles(force_N: Array, count: int, purpose: str) -> Landmarks:
    """Return the landmarks of a profile with at least `count` cycles. Raises DoorDataError that names the purpose."""
    marks = landmarks(force_N)
    if len(marks.peaks) < count:
        at = ", ".join(f"{peak / POINTS_PER_DEG:.1f}" for peak in marks.peaks) or "none"
        raise DoorDataError(f"{purpose} needs {count} major peaks; this profile has {len(marks.peaks)} (at {at} deg).")
    return marks


def plateau_after_second_peak(force_N: Array, purpose: str) -> tuple[int, int]:
    """Return the first and last grid index of the plateau on the way from the second peak to its valley.

    The plateau is where the descent slows down between two steep parts. Raises DoorDataError where the force falls from
    the second peak without slowing down.
    """
    plateau = plateau_of(force_N, require_cycles(force_N, 2, purpose))
    if plateau is None:
        raise DoorDataError(f"{purpose} needs a plateau after the second peak; here the force falls in one go.")
    return plateau


def plateau_of(force_N: Array, marks: Landmarks) -> tuple[int, int] | None:
    """Return the plateau as `plateau_after_second_peak` defines it, or None where there is none."""
    if len(marks.peaks) < 2:
        return None
    top, bottom = marks.peaks[1], marks.valleys[1]
    fall = _smooth(-np.diff(force_N[top : bottom + 1]), POINTS_PER_DEG)
    steep = np.minimum(np.maximum.accumulate(fall), np.maximum.accumulate(fall[::-1])[::-1])
    slow = (steep > 0) & (fall < PLATEAU_SLOPE_SHARE * steep)
    if not slow.any():
        return None
    first = last = int(np.argmax(np.where(slow, steep - fall, -np.inf)))
    while slow[first - 1]:
        first -= 1
    while slow[last + 1]:
        last += 1
    return top + first, top + last + 1


def describe(force_N: Array) -> dict[str, float]:
    """Return the numeric columns of the stimulus table; see docs/reference/doors.md for each one's definition."""
    return columns(force_N, *landmarks_and_peaks(force_N))


def columns(force_N: Array, marks: Landmarks, felt_peaks: list[int]) -> dict[str, float]:
    """Return the numeric columns as `describe` does, for a profile whose landmarks and counted peaks are known."""
    moving = force_N[: marks.end + 1]
    first = marks.peaks[0] if marks.peaks else int(np.argmax(moving))
    # The largest fall from a counted peak to the lowest point before the next one (0 without a peak).
    stretches = zip(felt_peaks, [*felt_peaks[1:], len(moving)], strict=False)
    drop_N = max((float(moving[a] - moving[a:b].min()) for a, b in stretches), default=0.0)
    # Roughness is what a two-degree moving average leaves, without the first and last degree.
    detail = (moving - _smooth(moving, SMOOTH_POINTS))[POINTS_PER_DEG:-POINTS_PER_DEG]
    # The end slope is the least-squares one in newtons per degree (0 for a single point).
    ending = moving[-(END_DEG * POINTS_PER_DEG + 1) :]
    angle = np.arange(len(ending)) / POINTS_PER_DEG
    angle -= angle.mean()
    return {
        "first_peak_N": float(moving[first]),
        "first_peak_deg": first / POINTS_PER_DEG,
        "peak_count": float(len(felt_peaks)),
        "initial_force_N": float(moving[: INITIAL_DEG * POINTS_PER_DEG + 1].mean()),
        "mean_force_N": float(moving.mean()),
        "max_force_N": float(moving.max()),
        "min_force_N": float(moving.min()),
        "drop_N": drop_N,
        "end_slope_N_deg": float(angle @ ending / (angle @ angle)) if len(ending) > 1 else 0.0,
        "roughness_N": float(np.sqrt(np.mean(detail**2))) if detail.size else 0.0,
        "opening_deg": marks.end / POINTS_PER_DEG,
    }


def as_profile(force_N: Array | tuple[float, ...] | list[float], where: str = "profile") -> Array:
    """Return the profile as a float array. Raises DoorDataError unless it has 621 finite points."""
    profile = np.asarray(force_N, dtype=np.float64)
    if profile.shape != (POINTS,):
        raise DoorDataError(f"{where}: {POINTS} points expected, found an array of shape {profile.shape}.")
    bad = np.flatnonzero(~np.isfinite(profile))
    if bad.size:
        raise DoorDataError(f"{where}: the force at {bad[0] / POINTS_PER_DEG} deg is {profile[bad[0]]}.")
    return profile


def _tops(force_N: Array) -> list[tuple[int, float]]:
    """Return the middle and the prominence of every run of equal values with lower values on both sides, in order."""
    starts = np.flatnonzero(np.diff(force_N, prepend=np.nan) != 0)
    values = force_N[starts]
    inner = np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] > values[2:])) + 1
    tops = ((starts[inner] + starts[inner + 1] - 1) // 2).tolist()
    heights, lowest = force_N[tops].tolist(), np.minimum.reduceat(force_N, [0, *tops]).tolist()
    left = _lowest_before(heights, lowest)
    right = _lowest_before(heights[::-1], lowest[::-1])[::-1]
    low = [max(pair) for pair in zip(left, right, strict=True)]
    return [(top, height - base) for top, height, base in zip(tops, heights, low, strict=True)]


def _lowest_before(heights: list[float], lowest: list[float]) -> list[float]:
    """Return the lowest value between each top and the higher ground before it, or the profile's end.

    `lowest` holds the lowest value between each top and the top before it. A stack keeps the tops that no later top has
    reached yet, so each is pushed and popped once.
    """
    open_tops: list[tuple[float, float]] = []
    lowest_before = []
    for height, low in zip(heights, lowest, strict=False):
        while open_tops and open_tops[-1][0] <= height:
            low = min(low, open_tops.pop()[1])  # noqa: PLW2901 - the lowest so far
        open_tops.append((height, low))
        lowest_before.append(low)
    return lowest_before


def _smooth(values: Array, points: int) -> Array:
    """Return the centred moving average; near the ends the end value replaces missing points."""
    points = points | 1
    padded = np.pad(values, points // 2, mode="edge")
    return np.convolve(padded, np.full(points, 1 / points), mode="valid")
