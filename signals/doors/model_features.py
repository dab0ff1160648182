"""Engineered features that models of door perception learn from: peaks, intervals, slopes, plateaus, energy.

Thesis 5.3.4.1 and Figure 5.6; energy is ours. Every one is defined for every finite profile;
`docs/reference/model-files.md` has the table.
A model's card holds their names: a feature never changes its meaning without a new name.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from palpate.protocols.did_you_mean import nearest
from palpate.signals.arrays import Array
from palpate.signals.doors.features import Landmarks, as_profile, columns, landmarks_and_peaks, plateau_of
from palpate.signals.doors.grid import POINTS_PER_DEG, DoorDataError
from palpate.signals.doors.profiles import demand_force

FEATURES = (
    "first_peak_N", "first_peak_deg", "peak_count", "initial_force_N", "mean_force_N", "max_force_N", "min_force_N",
    "drop_N", "end_slope_N_deg", "roughness_N", "opening_deg",
    "major_peak_count", "peak_2_N", "peak_2_deg", "peak_3_N", "peak_3_deg", "valley_1_N", "valley_1_deg", "valley_2_N",
    "valley_2_deg", "interval_1_deg", "interval_2_deg", "start_N", "end_N", "force_sd_N",
    "rise_N_deg", "rise_deg", "fall_N_deg", "fall_deg", "slope_rms_N_deg", "flat_share", "travel_N",
    "flat_deg", "flat_N", "plateau_deg", "plateau_N",
    "work_J_m", "work_pulled_J_m", "work_returned_J_m", "work_0_20_J_m", "work_20_40_J_m", "work_40_62_J_m",
)  # fmt: skip
"""Their names, in order: the columns of the stimulus table, peaks and valleys, slopes, plateaus, energy."""
PEAKS, VALLEYS = 3, 2
"""Number of major peaks and valleys that have columns of their own."""
FLAT_N_DEG = 1.0
"""Greatest change of force per degree along a flat stretch."""
PARTS_DEG = ((0, 20), (20, 40), (40, 62))
"""The parts of the opening whose work has features of its own."""


def features(force_N: Array, names: Sequence[str] | None = None) -> Array:
    """Return the engineered features (n, features) of profiles (n, 621) in newtons, or (features,) of one (621,).

    `names` selects and orders them; by default all of FEATURES are returned.

    Raises:
        DoorDataError: a row that is not a profile (621 finite forces within 1e9 N), or an unknown feature.
    """
    given = np.asarray(force_N, dtype=np.float64)
    chosen = FEATURES if names is None else tuple(names)
    if unknown := [name for name in chosen if name not in FEATURES]:
        raise DoorDataError(f"{unknown[0]!r} is not a feature of a profile; {nearest(unknown[0], FEATURES)}")
    if given.ndim == 1:
        return _row(given, "profile", chosen)
    if given.ndim != 2:
        raise DoorDataError(f"profiles: an array of (n, 621) is expected, found one of shape {given.shape}.")
    rows = [_row(row, f"profile {number}", chosen) for number, row in enumerate(given, start=1)]
    return np.array(rows).reshape(len(given), len(chosen))


def all_features(force_N: Array) -> dict[str, float]:
    """Return the engineered features of one profile (621,), by name. Raises DoorDataError as `features` does."""
    return _features_of(_checked(force_N, "profile"))


def _features_of(profile: Array) -> dict[str, float]:
    marks, peaks = landmarks_and_peaks(profile)
    moving = profile[: marks.end + 1]
    # N/deg between points a degree apart; of a shorter motion, over all of it.
    span = min(POINTS_PER_DEG, len(moving) - 1)
    slope = (moving[span:] - moving[:-span]) * (POINTS_PER_DEG / span) if span else np.zeros(1)
    return {
        **columns(profile, marks, peaks),
        **_extremes(moving, marks),
        **_slopes(moving, slope),
        **_plateaus(profile, moving, slope, marks),
        **_work(profile),
    }


def _extremes(moving: Array, marks: Landmarks) -> dict[str, float]:
    """Return the major peaks and valleys; missing ones are placed at the end of the motion."""
    peaks = [*marks.peaks, *[marks.end] * PEAKS][:PEAKS]
    valleys = [*marks.valleys, *[marks.end] * VALLEYS][:VALLEYS]
    values = {"major_peak_count": float(len(marks.peaks))}
    for number, place in enumerate(peaks[1:], start=2):
        values |= {f"peak_{number}_N": float(moving[place]), f"peak_{number}_deg": place / POINTS_PER_DEG}
    for number, place in enumerate(valleys, start=1):
        values |= {f"valley_{number}_N": float(moving[place]), f"valley_{number}_deg": place / POINTS_PER_DEG}
    for number, (before, after) in enumerate(pairwise(peaks), start=1):
        values[f"interval_{number}_deg"] = (after - before) / POINTS_PER_DEG
    return values | {"start_N": float(moving[0]), "end_N": float(moving[-1]), "force_sd_N": float(moving.std())}


def _slopes(moving: Array, slope: Array) -> dict[str, float]:
    """Return features of the change of force over one degree: steepest rise and fall, their angles, and the RMS."""
    rise, fall = int(np.argmax(slope)), int(np.argmin(slope))
    return {
        "rise_N_deg": max(float(slope[rise]), 0.0),
        "rise_deg": rise / POINTS_PER_DEG if slope[rise] > 0 else 0.0,
        "fall_N_deg": max(float(-slope[fall]), 0.0),
        "fall_deg": fall / POINTS_PER_DEG if slope[fall] < 0 else 0.0,
        "slope_rms_N_deg": float(np.sqrt(np.mean(slope**2))),
        "flat_share": float(np.mean(np.abs(slope) <= FLAT_N_DEG)),
        "travel_N": float(np.abs(np.diff(moving)).sum()),
    }


def _plateaus(profile: Array, moving: Array, slope: Array, marks: Landmarks) -> dict[str, float]:
    """Return the longest flat stretch and the plateau after the second major peak; missing ones have length 0.

    The level of a missing flat stretch is the mean force; that of a missing plateau is midway between peak and valley.
    """
    # The longest run of flat points, the first of equals.
    edges = np.diff((np.abs(slope) <= FLAT_N_DEG).astype(np.int8), prepend=0, append=0)
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    length, level = 0, moving
    if starts.size:
        best = int(np.argmax(ends - starts))
        length = int(ends[best] - starts[best])
        level = moving[int(starts[best]) : int(ends[best]) + POINTS_PER_DEG]
    values = {"flat_deg": length / POINTS_PER_DEG, "flat_N": float(level.mean())}
    plateau = plateau_of(profile, marks)
    if plateau is None:
        top, bottom = (marks.peaks[1], marks.valleys[1]) if len(marks.peaks) > 1 else (marks.end, marks.end)
        return {**values, "plateau_deg": 0.0, "plateau_N": float(moving[top] + moving[bottom]) / 2}
    first, last = plateau
    return {
        **values,
        "plateau_deg": (last - first) / POINTS_PER_DEG,
        "plateau_N": float(profile[first : last + 1].mean()),
    }


def _work(profile: Array) -> dict[str, float]:
    """Return the work over the grid and its parts in J per metre of handle radius: force integrated over radians."""
    width = np.radians(1 / POINTS_PER_DEG)
    pieces = (profile[1:] + profile[:-1]) / 2 * width
    values = {
        "work_J_m": float(pieces.sum()),
        "work_pulled_J_m": float(pieces[pieces > 0].sum()),
        "work_returned_J_m": float(-pieces[pieces < 0].sum()),
    }
    for low, high in PARTS_DEG:
        part = pieces[low * POINTS_PER_DEG : high * POINTS_PER_DEG]
        values[f"work_{low}_{high}_J_m"] = float(part.sum())
    return values


def _row(profile: Array, where: str, names: Sequence[str]) -> Array:
    values = _features_of(_checked(profile, where))
    return np.array([values[name] for name in names])


def _checked(force_N: Array, where: str) -> Array:
    profile = as_profile(force_N, where)
    demand_force(profile, where)
    return profile
