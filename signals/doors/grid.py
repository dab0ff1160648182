"""The common angular grid of every door profile, in one place (thesis 5.3.1.2)."""

from __future__ import annotations

MAX_ANGLE_DEG = 62
"""The angle at which every opening is cut off."""
POINTS_PER_DEG = 10
"""Points in each one-degree subset."""
POINTS = MAX_ANGLE_DEG * POINTS_PER_DEG + 1
"""621: the start at 0 degrees and 62 subsets of 10."""
FORCE_DECIMALS = 4
"""Decimals of a force in a file; far below any door's noise and far above rounding differences between machines."""
STUDY_SEED = 5341
"""Seed of the study's own drawn variants: the thesis section that they come from."""


class DoorDataError(ValueError):
    """A door recording, profile or parameter that cannot be used; the message says where and what to do."""


def grid_angle_deg(index: int) -> float:
    """Return the angle of one grid point, in degrees, correctly rounded (3 -> 0.3)."""
    return index / POINTS_PER_DEG


def motion_end(force_N: list[float] | tuple[float, ...]) -> int:
    """Return the index of the last point before the zero padding of a door that opens less than 62 degrees.

    Return 0 for a profile that is zero throughout.
    """
    end = len(force_N) - 1
    while end > 0 and force_N[end] == 0:
        end -= 1
    return end
