"""What the machine's sensors give, and the speed that it makes of them."""

from __future__ import annotations

from math import pi, tau
from random import Random

from palpate.devices.door.plant.parameters import TICK_S, Parameters


class Sensing:
    """An encoder that counts whole steps, a torque sensor with noise and a converter, an observer for the speed."""

    __slots__ = (
        "_bias", "_gains", "_inertia", "_noise", "_random", "_step_Nm", "_turn", "angle_rad", "speed_rad_s",
        "torque_Nm",
    )  # fmt: skip

    def __init__(self, parameters: Parameters, angle_rad: float) -> None:
        sensors = parameters.sensors
        self._turn = tau / sensors.counts_per_turn
        self._noise, self._step_Nm, self._random = sensors.torque_noise_Nm, sensors.torque_step_Nm, Random(sensors.seed)
        rate = 2 * pi * parameters.control.observer_Hz
        self._gains = (3 * rate * TICK_S, 3 * rate**2 * TICK_S, rate**3 * TICK_S)
        self._inertia = parameters.arm.inertia_kg_m2
        self.angle_rad, self.speed_rad_s, self.torque_Nm = self._counted(angle_rad), 0.0, 0.0
        self._bias = 0.0

    def read(self, angle_rad: float, torque_Nm: float, known_Nm: float) -> None:
        """Take a reading; `known_Nm` is what motor and hand are known to do, for the observer.

        The observer (Luenberger 1964) predicts angle and speed over the period from that torque and corrects both, and
        the rest that it does not know (friction, a stop), by what the encoder says: the speed has no lag of a filter.
        """
        rate = known_Nm / self._inertia + self._bias
        ahead = self.angle_rad + TICK_S * (self.speed_rad_s + 0.5 * TICK_S * rate)
        missed = self._counted(angle_rad) - ahead
        self.angle_rad = ahead + self._gains[0] * missed
        self.speed_rad_s += TICK_S * rate + self._gains[1] * missed
        self._bias += self._gains[2] * missed
        noisy = torque_Nm + (self._random.gauss(0.0, self._noise) if self._noise else 0.0)
        self.torque_Nm = round(noisy / self._step_Nm) * self._step_Nm if self._step_Nm else noisy

    def _counted(self, angle_rad: float) -> float:
        return round(angle_rad / self._turn) * self._turn
