"""Limits of profiles that are sent to the door simulator: torque, slope and reach, checked before sending."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from palpate.devices.device import DeviceError
from palpate.devices.door.link.messages import Profile
from palpate.protocols.strict import Strict
from palpate.signals.doors.limits import SLOPE_NM_DEG, TORQUE_NM, UnplayableProfile, torque_profile


class ProfileRefused(DeviceError):
    """A profile that this door must not play."""


class Limits(Strict):
    """The rig's limits, which apply in addition to the device's own.

    torque_Nm: of the profile, at the hinge; slope_Nm_deg: from one point to the next; speed_deg_s: the device must
    itself stop at this speed or a lower one.
    """

    torque_Nm: Annotated[float, Field(gt=0, le=200)] = TORQUE_NM
    slope_Nm_deg: Annotated[float, Field(gt=0, le=1000)] = SLOPE_NM_DEG
    speed_deg_s: Annotated[float, Field(gt=0, le=720)] = 180.0


def profile_for_door(
    force_N: Sequence[float], handle_radius_m: float, limits: Limits, what: str = "profile"
) -> Profile:
    """Return the torques that make these forces at the handle, and where the motion ends.

    `force_N` has 621 points. The zeros after the end of the motion are not forces: the last value is held there
    instead, and the device's stop is at the end, so that no step is ever rendered.

    Raises:
        ProfileRefused: not 621 finite points, no motion, or beyond a limit; the message says where and by how much.
    """
    try:
        return Profile(*torque_profile(force_N, handle_radius_m, limits.torque_Nm, limits.slope_Nm_deg, what))
    except UnplayableProfile as why:
        raise ProfileRefused(str(why)) from None


def change_for_door(
    force_N: Sequence[float], handle_radius_m: float, limits: Limits, end_deg: float, what: str = "profile"
) -> Profile:
    """Return the torques for a change while the door plays, with its stop at `end_deg`.

    If the motion ends before the stop, its last torque is held up to it; the part of a longer motion behind the stop is
    never felt. Raises ProfileRefused as `profile_for_door`.
    """
    return Profile(profile_for_door(force_N, handle_radius_m, limits, what).torque_Nm, end_deg)
