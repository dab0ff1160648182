"""The torque to render at the handle, over the angle: the profile, and a stop at either end of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from palpate.devices.door.plant.parameters import PlantError
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS

STEP_RAD = math.radians(MAX_ANGLE_DEG) / (POINTS - 1)
PASSAGE_TICKS = 50
"""Least number of 1 ms ticks for a passage from one profile to another: one period of 20 Hz."""
FASTEST_NM_S = 200.0
"""Greatest rate of change of the torque on a resting arm during a passage."""


class Rendered:
    """A profile as torque over angle, with a spring behind its end and another before its start."""

    __slots__ = ("_last", "_torque", "end_rad", "stiffness")

    def __init__(self, torque_Nm: Sequence[float], end_rad: float, stiffness_Nm_rad: float) -> None:
        if len(torque_Nm) != POINTS:
            raise PlantError(f"A profile for the door machine has {POINTS} torques, this one has {len(torque_Nm)}.")
        wrong = next((i for i, value in enumerate(torque_Nm) if not math.isfinite(value)), None)
        if wrong is not None:
            raise PlantError(
                f"A profile for the door machine: torque {wrong} is {torque_Nm[wrong]}, a finite number is needed."
            )
        if not 0 < end_rad <= math.radians(MAX_ANGLE_DEG) + 1e-9:
            raise PlantError(
                f"The end of a profile is {end_rad} rad: above 0 and up to {MAX_ANGLE_DEG} degrees is needed."
            )
        self.end_rad, self.stiffness = end_rad, stiffness_Nm_rad
        self._last = min(int(end_rad / STEP_RAD + 1e-9), POINTS - 1)
        # What stands behind the end is padding; holding the last value keeps a step out of the handle.
        held = [float(torque_Nm[self._last])] * (POINTS - 1 - self._last)
        self._torque = tuple(map(float, torque_Nm[: self._last + 1])) + tuple(held)

    def at(self, angle_rad: float) -> float:
        """Return the torque against the opening direction, in N m."""
        if angle_rad <= 0.0:
            return self._torque[0] + self.stiffness * angle_rad
        place = angle_rad / STEP_RAD
        if place >= POINTS - 1:
            torque = self._torque[-1]
        else:
            index = int(place)
            low = self._torque[index]
            torque = low + (place - index) * (self._torque[index + 1] - low)
        return torque + self.stiffness * (angle_rad - self.end_rad) if angle_rad > self.end_rad else torque

    def torques(self) -> tuple[float, ...]:
        """Return the profile's torques, without the stops."""
        return self._torque

    def least(self, from_rad: float, to_rad: float) -> float:
        """Return the smallest torque of the profile between two angles."""
        first = min(max(int(from_rad / STEP_RAD), 0), POINTS - 1)
        last = min(max(int(to_rad / STEP_RAD) + 1, first), POINTS - 1)
        return min(self._torque[first : last + 1])


class Passage(Rendered):
    """A transition between two profiles with the same stop: at every tick a mixture, so within the limits of both.

    It takes at least PASSAGE_TICKS, and longer if needed to keep the change of every angle's torque below FASTEST_NM_S.
    """

    __slots__ = ("_before", "_share", "_step")

    def __init__(self, before: Rendered, torque_Nm: Sequence[float]) -> None:
        super().__init__(torque_Nm, before.end_rad, before.stiffness)
        self._before = before.mixed() if isinstance(before, Passage) else before
        furthest = max(abs(new - old) for new, old in zip(self._torque, self._before.torques(), strict=True))
        self._step = 1.0 / max(PASSAGE_TICKS, math.ceil(1000 * furthest / FASTEST_NM_S))
        self._share = 0.0

    def after_tick(self) -> Rendered:
        """Return the passage one tick later, or the new profile if the passage is over."""
        self._share += self._step
        return self if self._share < 1.0 else Rendered(self._torque, self.end_rad, self.stiffness)

    def at(self, angle_rad: float) -> float:
        """Return the torque against the opening direction, in N m."""
        old, new = self._before.at(angle_rad), super().at(angle_rad)
        return old + self._share * (new - old)

    def least(self, from_rad: float, to_rad: float) -> float:
        """Return a lower bound of the mixture's torque between two angles."""
        old, new = self._before.least(from_rad, to_rad), super().least(from_rad, to_rad)
        return old + self._share * (new - old)

    def mixed(self) -> Rendered:
        """Return the current mixture as a profile."""
        pairs = zip(self._before.torques(), self._torque, strict=True)
        torque = [old + self._share * (new - old) for old, new in pairs]
        return Rendered(torque, self.end_rad, self.stiffness)
