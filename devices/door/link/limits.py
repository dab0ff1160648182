"""What may be sent to the door simulator: torque, slope and reach of a profile, checked before anything is sent."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

from pydantic import Field

from palpate.devices.door.link.messages import Profile
from palpate.devices.rig.settings import Strict
from palpate.devices.signals import DeviceError
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG, grid_angle_deg, motion_end

LEAST_OPENING_DEG = 5.0
HANDLE_RADIUS_M = 0.9
"""From the hinge to the handle, where nobody measured it: a force times it is a torque."""


class ProfileRefused(DeviceError):
    """A profile that this door must not play."""


class Limits(Strict):
    """The rig's limits; the device's own limits hold beside them.

    torque_Nm: of the profile, at the hinge; slope_Nm_deg: from one point of it to the next; speed_deg_s: the device
    must itself stop at this speed or a lower one.
    """

    torque_Nm: Annotated[float, Field(gt=0, le=200)] = 60.0
    slope_Nm_deg: Annotated[float, Field(gt=0, le=1000)] = 100.0
    speed_deg_s: Annotated[float, Field(gt=0, le=720)] = 180.0


def profile_for_door(
    force_N: Sequence[float], handle_radius_m: float, limits: Limits, what: str = "profile"
) -> Profile:
    """The torques that make these forces at the handle, and where the motion ends.

    `force_N` has 621 points; the zeros after the motion's end are no forces: the last value is held there instead, and
    the device's stop stands at the end, so that no step is ever rendered.

    Raises:
        ProfileRefused: not 621 finite points, no motion, or beyond a limit; the message says where and by how much.
    """
    _require_points(force_N, what)
    end = motion_end(tuple(force_N))
    if grid_angle_deg(end) < LEAST_OPENING_DEG:
        raise ProfileRefused(f"{what}: no force beyond {grid_angle_deg(end):g} degrees: a door that does not open")
    torque = [force * handle_radius_m for force in force_N[: end + 1]]
    _require_limits(torque, limits, what)
    return Profile((*torque, *[torque[-1]] * (POINTS - 1 - end)), grid_angle_deg(end))


def change_for_door(
    force_N: Sequence[float], handle_radius_m: float, limits: Limits, end_deg: float, what: str = "profile"
) -> Profile:
    """The torques that a door with its stop at `end_deg` passes over to while it plays.

    A motion that ends before the stop holds its last torque up to it; one that goes on behind it is never felt there.
    Raises ProfileRefused as `profile_for_door`.
    """
    return Profile(profile_for_door(force_N, handle_radius_m, limits, what).torque_Nm, end_deg)


def _require_points(force_N: Sequence[float], what: str) -> None:
    if len(force_N) != POINTS:
        raise ProfileRefused(f"{what}: {len(force_N)} points found, {POINTS} expected")
    for index, force in enumerate(force_N):
        if not math.isfinite(force):
            raise ProfileRefused(
                f"{what}: the force at {grid_angle_deg(index):g} degrees is {force}, not a finite number"
            )


def _require_limits(torque_Nm: Sequence[float], limits: Limits, what: str) -> None:
    for index, torque in enumerate(torque_Nm):
        if abs(torque) > limits.torque_Nm:
            at, most = grid_angle_deg(index), limits.torque_Nm
            raise ProfileRefused(f"{what}: {torque:.1f} N m at {at:g} degrees, at most {most:g} N m are allowed")
    for index, (before, after) in enumerate(pairwise(torque_Nm)):
        slope = abs(after - before) * POINTS_PER_DEG
        if slope > limits.slope_Nm_deg:
            at, most = grid_angle_deg(index), limits.slope_Nm_deg
            raise ProfileRefused(f"{what}: {slope:.1f} N m/deg from {at:g} degrees on, at most {most:g} are allowed")
