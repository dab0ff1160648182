"""External torques on the arm during one control period: motor, brake, hand and detents."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

from palpate.devices.door.plant.hand import NOBODY, Hand
from palpate.devices.door.plant.parameters import Detent, Parameters


class Drives:
    """Motor torque, brake torque and the hand's path between two commands, exactly as the held commands produce them.

    The motor's torque and the coil's current approach their commands exponentially, so both are known at every instant
    of a period; the powder follows the current with play (hysteresis), which for a monotone current is a single clamp.
    """

    __slots__ = (
        "_brake", "_coil_rate", "_hold_A", "_hold_Nm", "_idle", "_limit_A", "_limit_Nm", "_motor_rate", "_path",
        "_start_s", "coil_A", "damping", "dry_Nm", "holds", "motor_Nm", "powder_A", "stiffness", "torque_Nm", "until",
    )  # fmt: skip

    def __init__(self, parameters: Parameters) -> None:
        self._brake = parameters.brake
        self._limit_Nm, self._limit_A = parameters.motor.torque_limit_Nm, parameters.brake.current_limit_A
        self._motor_rate, self._coil_rate = -1.0 / parameters.motor.lag_s, -1.0 / parameters.brake.lag_s
        self.dry_Nm = parameters.arm.coulomb_Nm + parameters.brake.drag_Nm
        self.motor_Nm = self.coil_A = self.powder_A = self.until = 0.0
        self.begin(0.0, 0.0, NOBODY, 0.0)

    def begin(self, motor_Nm: float, brake_A: float, hand: Hand, start_s: float) -> None:
        """Begin a period at `start_s` of the hand's clock; both commands are held until the next."""
        self._hold_Nm = min(max(motor_Nm, -self._limit_Nm), self._limit_Nm)
        self._hold_A = min(max(brake_A, 0.0), self._limit_A)
        self._idle = self._hold_A == 0.0 and self.coil_A == 0.0 and self.powder_A <= 0.0
        self._path, self._start_s = hand.path, start_s
        self.stiffness, self.damping, self.torque_Nm = hand.stiffness_Nm_rad, hand.damping_Nm_s_rad, hand.torque_Nm
        self.holds = hand is not NOBODY

    def motor(self, t: float) -> float:
        """Return the motor torque in N m, t seconds into the period."""
        return self._hold_Nm + (self.motor_Nm - self._hold_Nm) * exp(self._motor_rate * t)

    def coil(self, t: float) -> float:
        """Return the coil current in A, t seconds into the period."""
        return self._hold_A + (self.coil_A - self._hold_A) * exp(self._coil_rate * t)

    def friction(self, t: float) -> float:
        """Return the dry friction while sliding: bearing, the brake's drag, and its powder's share of the current."""
        if self._idle:
            return self.dry_Nm
        brake = self._brake
        return self.dry_Nm + min(max(brake.gain_Nm_A * self._powder(self.coil(t)), 0.0), brake.limit_Nm)

    def _powder(self, coil_A: float) -> float:
        """Return the powder's state at the coil current `coil_A`, after the play."""
        play = self._brake.play_A
        if self.powder_A < coil_A - play:
            return coil_A - play
        return coil_A + play if self.powder_A > coil_A + play else self.powder_A

    def hand(self, t: float, origin: float) -> float:
        """Return the hand's torque on an arm at rest at `origin`; stiffness and damping act on deviations from it."""
        angle, speed = self._path(self._start_s + t)
        return self.torque_Nm + self.stiffness * (angle - origin) + self.damping * speed

    def end(self, t: float) -> None:
        """End the period after t seconds, keeping the state of lags and play."""
        coil = self.coil(t)
        self.motor_Nm = self.motor(t)
        self.powder_A = self._powder(coil)
        self.coil_A, self.until = coil, t


def torque_and_slope(detents: Sequence[Detent], angle_rad: float) -> tuple[float, float]:
    """Return the detents' torque against the opening direction, in N m, and its derivative over the angle."""
    torque = slope = 0.0
    for one in detents:
        away = (angle_rad - one.angle_rad) / one.width_rad
        bell = one.energy_J / one.width_rad * exp(-0.5 * away * away)
        torque -= bell * away
        slope -= bell * (1.0 - away * away) / one.width_rad
    return torque, slope


def stiffest(detents: Sequence[Detent]) -> float:
    """Return an upper bound of the detents' stiffness, in N m/rad."""
    return sum(abs(detent.energy_J) / detent.width_rad**2 for detent in detents)
