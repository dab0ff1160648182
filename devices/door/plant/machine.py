"""The door machine: plant, sensors and the 1 kHz control together, one millisecond at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, tau
from random import Random
from typing import Literal

from palpate.devices.door.plant.control import Asked, Cascade
from palpate.devices.door.plant.dynamics import Dynamics
from palpate.devices.door.plant.hand import Hand, human
from palpate.devices.door.plant.parameters import DEFAULT, TICK_S, Parameters
from palpate.devices.door.plant.rendering import STEP_RAD, Passage, Rendered
from palpate.signals.doors.grid import POINTS

Mode = Literal["off", "hold", "play"]
TICK_US = round(TICK_S * 1e6)


@dataclass(frozen=True, slots=True)
class Tick:
    """One millisecond as the machine's sensors have it; `torque_Nm` is the hand's, positive opening."""

    t_us: int
    angle_rad: float
    velocity_rad_s: float
    torque_Nm: float
    brake_A: float
    commanded_Nm: float
    motor_Nm: float


class Machine:
    """A door simulator that does not know it is simulated.

    `off`: motor without torque, brake fully on. `hold`: motor on, the arm stays where it was. `play`: the handle feels
    the profile that was loaded. The hand's clock starts when `play` begins; before, the hand rests where it begins.
    """

    def __init__(self, parameters: Parameters = DEFAULT, hand: Hand | None = None) -> None:
        self.parameters = parameters
        self.hand = human() if hand is None else hand
        self.dynamics = Dynamics(parameters)
        self.sensing = Sensing(parameters, self.dynamics.angle_rad)
        self.cascade = Cascade(parameters)
        self.handle_Nm = 0.0
        self._ticks, self._began = 0, -1
        self._mode: Mode = "off"
        self.load([0.0] * POINTS, (POINTS - 1) * STEP_RAD)

    @property
    def mode(self) -> Mode:
        """What the machine does."""
        return self._mode

    @mode.setter
    def mode(self, mode: Mode) -> None:
        if mode != self._mode:
            self.cascade.reset(self.sensing.angle_rad)
            if mode == "play":
                self.cascade.begin(self.rendered, self.sensing.angle_rad, self.sensing.torque_Nm)
                self._began = self._ticks
        self._mode = mode

    def load(self, torque_Nm: Sequence[float], end_rad: float) -> None:
        """Take 621 torques against opening, over 0 to 62 degrees; a stop is rendered at `end_rad`.

        What stands in the profile behind the end is padding and never rendered: the last value holds.

        Raises:
            PlantError: another number of torques, one that is not finite, or an end outside the profile.
        """
        self.rendered = Rendered(torque_Nm, end_rad, self.parameters.control.end_stiffness_Nm_rad)

    def change(self, torque_Nm: Sequence[float]) -> None:
        """Pass over to another profile with the same stop; the torque never steps. Raises PlantError as `load`."""
        self.rendered = Passage(self.rendered, torque_Nm)

    def step(self) -> Tick:
        """One millisecond: read the sensors, ask motor and brake, let the plant move."""
        sensing, dynamics = self.sensing, self.dynamics
        if isinstance(self.rendered, Passage):
            self.rendered = self.rendered.after_tick()
        asked = self._control()
        hand_s = (self._ticks - self._began) * TICK_S if self._began >= 0 else 0.0
        dynamics.advance(asked.motor_Nm, asked.brake_A, self.hand, hand_s)
        self.handle_Nm = dynamics.hand_torque()
        self._ticks += 1
        self.cascade.follow(asked.brake_A)
        sensing.read(dynamics.angle_rad, self.handle_Nm, asked.motor_Nm + sensing.torque_Nm)
        return Tick(
            self._ticks * TICK_US, sensing.angle_rad, sensing.speed_rad_s, sensing.torque_Nm, dynamics.drives.coil_A,
            asked.commanded_Nm, dynamics.drives.motor_Nm,
        )  # fmt: skip

    def _control(self) -> Asked:
        sensing = self.sensing
        if self._mode == "play":
            return self.cascade.play(self.rendered, sensing.angle_rad, sensing.speed_rad_s, sensing.torque_Nm)
        if self._mode == "hold":
            return self.cascade.hold(sensing.angle_rad, sensing.speed_rad_s)
        return Asked(0.0, self.parameters.brake.current_limit_A, 0.0)


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
