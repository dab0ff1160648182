"""Limits of force profiles: of profiles that are generated, and of profiles that a door may play.

NumPy is imported only where a profile is computed: the settings of a rig read their defaults here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG, grid_angle_deg, motion_end

if TYPE_CHECKING:
    from palpate.signals.arrays import Array

LIMIT_N = 60.0
"""Greatest force of a generated profile; the study's own profiles reach 44.5 N."""
STEEPEST_N_DEG = 60.0
"""Steepest change of a generated profile: 6 N between two points; the study's own doors break away with up to 8.7 N."""
HANDLE_RADIUS_M = 0.9
"""Distance from the hinge to the handle where nobody measured it; force times distance is torque."""
TORQUE_NM = 60.0
"""The greatest torque of a profile at the hinge, unless the rig says otherwise."""
SLOPE_NM_DEG = 100.0
"""The greatest change of torque over angle from one point to the next, unless the rig says otherwise."""
LEAST_OPENING_DEG = 5.0
"""A door that opens less than this is refused."""


class UnplayableProfile(ValueError):
    """A profile that a door must not play; the message says where it exceeds a limit and by how much."""


def hardest() -> tuple[float, ...]:
    """Return the profile at the limits of generated profiles: up and down between them as steeply as allowed."""
    step, length = STEEPEST_N_DEG / POINTS_PER_DEG, round(2 * LIMIT_N * POINTS_PER_DEG / STEEPEST_N_DEG)
    return tuple(LIMIT_N - step * abs(place % (2 * length) - length) for place in range(POINTS))


def bounded(force_N: Array, limit_N: float = LIMIT_N, steepest_N_deg: float = STEEPEST_N_DEG) -> Array:
    """Return the profile within `limit_N` and no steeper than `steepest_N_deg`; steeper parts follow at that slope.

    Takes one profile, in newtons at every tenth of a degree, and returns a new one.
    """
    import numpy as np

    step = steepest_N_deg / POINTS_PER_DEG
    within = np.clip(force_N, -limit_N, limit_N)
    steep = (np.abs(np.diff(within)) > step).tolist()
    limited: list[float] = within[:1].tolist()
    follows = False
    for force, too_steep in zip(within[1:].tolist(), steep, strict=True):
        last = limited[-1]
        allowed = min(max(force, last - step), last + step) if too_steep or follows else force
        follows = allowed != force
        limited.append(allowed)
    return np.array(limited)


def bounded_profiles(force_N: Array) -> Array:
    """Return profiles (n, 621) in newtons within the limits. Raises DoorDataError for a row that is not a profile."""
    import numpy as np

    from palpate.signals.doors.features import as_profile

    return np.array([bounded(as_profile(profile)) for profile in force_N])


def torque_profile(
    force_N: Sequence[float],
    handle_radius_m: float = HANDLE_RADIUS_M,
    torque_Nm: float = TORQUE_NM,
    slope_Nm_deg: float = SLOPE_NM_DEG,
    what: str = "the profile",
) -> tuple[tuple[float, ...], float]:
    """Return the torques (621) in N m that make these forces at the handle, and where the motion ends, in degrees.

    `force_N` has 621 points. The zeros after the end of the motion are not forces: the last torque is held there
    instead.

    Raises:
        UnplayableProfile: not 621 finite points, no motion, or values beyond `torque_Nm` or `slope_Nm_deg`.
    """
    if len(force_N) != POINTS:
        raise UnplayableProfile(f"{what}: {len(force_N)} points found, {POINTS} expected")
    for index, force in enumerate(force_N):
        if not math.isfinite(force):
            raise UnplayableProfile(
                f"{what}: the force at {grid_angle_deg(index):g} degrees is {force}, not a finite number"
            )
    end = motion_end(tuple(force_N))
    end_deg = grid_angle_deg(end)
    if end_deg < LEAST_OPENING_DEG:
        raise UnplayableProfile(f"{what}: no force beyond {end_deg:g} degrees: a door that does not open")
    torques = [force * handle_radius_m for force in force_N[: end + 1]]
    for index, torque in enumerate(torques):
        if abs(torque) > torque_Nm:
            at = grid_angle_deg(index)
            raise UnplayableProfile(
                f"{what}: {torque:.1f} N m at {at:g} degrees, at most {torque_Nm:g} N m are allowed"
            )
    for index, (before, after) in enumerate(pairwise(torques)):
        slope = abs(after - before) * POINTS_PER_DEG
        if slope > slope_Nm_deg:
            at = grid_angle_deg(index)
            raise UnplayableProfile(
                f"{what}: {slope:.1f} N m/deg from {at:g} degrees on, at most {slope_Nm_deg:g} are allowed"
            )
    return (*torques, *[torques[-1]] * (POINTS - 1 - end)), end_deg


def refusal(force_N: Array) -> str | None:
    """Return why a door with the default limits would refuse to play a profile (621,), or None if it plays it."""
    import numpy as np

    try:
        torque_profile(np.asarray(force_N, dtype=np.float64).tolist())
    except UnplayableProfile as why:
        return str(why)
    return None
