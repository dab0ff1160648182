"""The simulated hand: a spring and a damper between the handle and a point that moves along a path.

A stiff hand on a path of constant speed pulls at that speed whatever the door does; a soft hand on a minimum-jerk path
(Flash and Hogan 1985) pulls like a person.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

Path = Callable[[float], tuple[float, float]]
"""From time in seconds to the hand's target for the arm: angle (rad) and speed (rad/s)."""


@dataclass(frozen=True)
class Hand:
    """A hand at the handle; `torque_Nm` is added, and beyond `grip_Nm` the hand slips off for that millisecond."""

    path: Path
    stiffness_Nm_rad: float
    damping_Nm_s_rad: float
    torque_Nm: float = 0.0
    grip_Nm: float = math.inf


def _nowhere(_t_s: float) -> tuple[float, float]:
    return 0.0, 0.0


NOBODY = Hand(_nowhere, 0.0, 0.0)
"""No hand at the door."""


def push(torque_Nm: float) -> Hand:
    """Return a hand with a constant torque on the arm, whatever it does."""
    return Hand(_nowhere, 0.0, 0.0, torque_Nm)


def impedance(angle_rad: float, stiffness_Nm_rad: float, damping_Nm_s_rad: float) -> Hand:
    """Return a hand that holds the arm at an angle."""
    return Hand(lambda _t_s: (angle_rad, 0.0), stiffness_Nm_rad, damping_Nm_s_rad)


def constant_velocity(
    speed_rad_s: float,
    to_rad: float,
    start_s: float = 0.1,
    rise_s: float = 0.2,
    stiffness_Nm_rad: float = 2000.0,
    damping_Nm_s_rad: float = 40.0,
) -> Hand:
    """Return a stiff pull that speeds up to `speed_rad_s` within `rise_s`, and stops at `to_rad` within `rise_s`."""
    moving = max(to_rad / speed_rad_s, rise_s)
    pace = to_rad / moving

    def path(t_s: float) -> tuple[float, float]:
        t = t_s - start_s
        before, after = _ramp(t, rise_s), _ramp(t - moving, rise_s)
        return pace * (before[0] - after[0]), pace * (before[1] - after[1])

    return Hand(path, stiffness_Nm_rad, damping_Nm_s_rad)


def _ramp(t_s: float, rise_s: float) -> tuple[float, float]:
    """Return a speed that rises linearly from 0 to 1 over `rise_s`, and the distance."""
    if t_s <= 0.0:
        return 0.0, 0.0
    if t_s < rise_s:
        return t_s * t_s / (2 * rise_s), t_s / rise_s
    return t_s - rise_s / 2, 1.0


def human(
    to_rad: float = math.radians(62),
    opening_s: float = 2.5,
    start_s: float = 0.3,
    stay_s: float | None = None,
    stiffness_Nm_rad: float = 400.0,
    damping_Nm_s_rad: float = 20.0,
) -> Hand:
    """Return a person's pull: minimum jerk to `to_rad` through the arm's own stiffness and damping.

    With `stay_s` the hand brings the door back as it opened it, that long after it was open. The arm's impedance at the
    handle is similar to what Tsuji et al. (1995) measured: some hundreds of N/m, some tens of N s/m.
    """
    back = math.inf if stay_s is None else start_s + opening_s + stay_s

    def path(t_s: float) -> tuple[float, float]:
        if t_s >= back:
            place, speed = minimum_jerk((t_s - back) / opening_s)
            place, speed = 1.0 - place, -speed
        else:
            place, speed = minimum_jerk((t_s - start_s) / opening_s)
        return to_rad * place, to_rad * speed / opening_s

    return Hand(path, stiffness_Nm_rad, damping_Nm_s_rad, grip_Nm=250.0)


def minimum_jerk(share: float) -> tuple[float, float]:
    """Return the share of the distance after a share of the time, and its derivative."""
    if share <= 0.0:
        return 0.0, 0.0
    if share >= 1.0:
        return 1.0, 0.0
    rest = 1.0 - share
    return share**3 * (10 + share * (6 * share - 15)), 30 * (share * rest) ** 2
