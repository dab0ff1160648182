"""Mechanical detents: bells of energy over the angle, whose slope is the torque."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

from palpate.devices.door.plant.parameters import Detent


def torque_and_slope(detents: Sequence[Detent], angle_rad: float) -> tuple[float, float]:
    """What the detents hold against the opening direction, in N m, and its derivative over the angle."""
    torque = slope = 0.0
    for one in detents:
        away = (angle_rad - one.angle_rad) / one.width_rad
        bell = one.energy_J / one.width_rad * exp(-0.5 * away * away)
        torque -= bell * away
        slope -= bell * (1.0 - away * away) / one.width_rad
    return torque, slope


def stiffest(detents: Sequence[Detent]) -> float:
    """An upper bound of their stiffness, in N m/rad."""
    return sum(abs(one.energy_J) / one.width_rad**2 for one in detents)
