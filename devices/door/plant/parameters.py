"""Parameters of the simulated door machine, each with its unit and the range in which it is meaningful."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

TICK_S = 1e-3
"""The control period: 1 kHz."""


class PlantError(ValueError):
    """A parameter, profile or command that the door machine cannot use; the message names it."""


@dataclass(frozen=True)
class Detent:
    """A mechanical notch (energy below 0) or crest (above 0): a bell of energy over the angle."""

    angle_rad: float
    energy_J: float
    width_rad: float

    def __post_init__(self) -> None:
        for one in fields(self):
            _within(f"detent.{one.name}", getattr(self, one.name))


@dataclass(frozen=True)
class Arm:
    """The arm with its bearing, end stops and detents.

    `stop_damping` is the stop's damper as a share of critical damping, 2 sqrt(stiffness inertia), of this arm.
    `stiction` is the torque to break away over the torque to keep sliding.
    """

    inertia_kg_m2: float = 0.25
    viscous_Nm_s_rad: float = 0.05
    coulomb_Nm: float = 0.4
    stiction: float = 1.25
    low_stop_rad: float = math.radians(-2)
    high_stop_rad: float = math.radians(66)
    stop_stiffness_Nm_rad: float = 2e4
    stop_damping: float = 0.2
    detents: tuple[Detent, ...] = ()


@dataclass(frozen=True)
class Motor:
    """A direct-drive motor: its torque follows the command with the electrical lag, within its limit."""

    torque_limit_Nm: float = 60.0
    lag_s: float = 5e-4


@dataclass(frozen=True)
class Brake:
    """A magnetic powder brake under open-loop current.

    The coil current follows the command with `lag_s`; the powder follows the current with `play_A` of play to either
    side (hysteresis); the torque is `gain_Nm_A` times the powder's current, up to `limit_Nm`, and `drag_Nm` always.
    """

    current_limit_A: float = 1.0
    gain_Nm_A: float = 40.0
    limit_Nm: float = 40.0
    drag_Nm: float = 0.15
    lag_s: float = 15e-3
    play_A: float = 0.01


@dataclass(frozen=True)
class Sensors:
    """The machine's sensors: an encoder that counts, a torque sensor with noise (SD) and its converter's step."""

    counts_per_turn: int = 1 << 20
    torque_noise_Nm: float = 0.02
    torque_step_Nm: float = 0.005
    seed: int = 53


@dataclass(frozen=True)
class Control:
    """Gains of the cascade: torque error -> PID -> velocity -> P -> motor torque.

    `lookahead_s` is how far ahead the profile is read for the motor's torque: the delay from an angle to the resulting
    torque; `error_lookahead_s` the same for the torque that the reading is compared with. The integral gain keeps the
    felt inertia the same at all frequencies: (1 + torque_p velocity_p) / inertia. `calming_Nm_s_rad` is the damping of
    a shaking arm. `brake_share` of the resistance ahead is left to the brake, in steps of `brake_step_Nm`.
    """

    torque_p: float = 0.55
    torque_i: float = 59.0
    torque_d: float = 5e-5
    velocity_p: float = 25.0
    observer_Hz: float = 40.0
    lookahead_s: float = 1.5e-3
    error_lookahead_s: float = 0.4e-3
    brake_share: float = 0.5
    brake_step_Nm: float = 4.0
    hold_1_s: float = 20.0
    end_stiffness_Nm_rad: float = 1500.0
    end_damping_Nm_s_rad: float = 4.0
    calming_Nm_s_rad: float = 3.0


@dataclass(frozen=True)
class Limits:
    """The machine's limits for its commands: a limit of the commanded speed, not of the real one.

    A hand that pushes hard moves the arm faster than `speed_rad_s`, against a braking motor; the firmware watches the
    real speed and makes the machine safe above its own, higher limit.
    """

    torque_Nm: float = 60.0
    speed_rad_s: float = 3.0


@dataclass(frozen=True)
class Parameters:
    """The parameters of a door machine."""

    arm: Arm = field(default_factory=Arm)
    motor: Motor = field(default_factory=Motor)
    brake: Brake = field(default_factory=Brake)
    sensors: Sensors = field(default_factory=Sensors)
    control: Control = field(default_factory=Control)
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        check(self)


RANGES: dict[str, tuple[float, float]] = {
    "detent.angle_rad": (-1, 3),
    "detent.energy_J": (-10, 10),
    "detent.width_rad": (1e-3, 1),
    "arm.inertia_kg_m2": (0.01, 20),
    "arm.viscous_Nm_s_rad": (0, 1000),
    "arm.coulomb_Nm": (0, 100),
    "arm.stiction": (1, 3),
    "arm.low_stop_rad": (-1, 0),
    "arm.high_stop_rad": (0.1, 3),
    "arm.stop_stiffness_Nm_rad": (1e2, 1e8),
    "arm.stop_damping": (0, 1),
    "motor.torque_limit_Nm": (0, 200),
    "motor.lag_s": (1e-5, 0.1),
    "brake.current_limit_A": (0, 10),
    "brake.gain_Nm_A": (0, 1000),
    "brake.limit_Nm": (0, 200),
    "brake.drag_Nm": (0, 10),
    "brake.lag_s": (1e-4, 1),
    "brake.play_A": (0, 1),
    "sensors.counts_per_turn": (360, 1 << 26),
    "sensors.torque_noise_Nm": (0, 10),
    "sensors.torque_step_Nm": (0, 1),
    "control.torque_p": (0, 10),
    "control.torque_i": (0, 1000),
    "control.torque_d": (0, 1),
    "control.velocity_p": (0, 1000),
    "control.observer_Hz": (1, 300),
    "control.lookahead_s": (0, 0.02),
    "control.error_lookahead_s": (0, 0.02),
    "control.brake_share": (0, 1),
    "control.brake_step_Nm": (0.1, 100),
    "control.hold_1_s": (0, 200),
    "control.end_stiffness_Nm_rad": (0, 1e8),
    "control.end_damping_Nm_s_rad": (0, 1000),
    "control.calming_Nm_s_rad": (0, 100),
    "limits.torque_Nm": (0, 200),
    "limits.speed_rad_s": (0, 50),
}


def check(parameters: Parameters) -> None:
    """Raise PlantError that names the first number outside its range."""
    for part in fields(parameters):
        group = getattr(parameters, part.name)
        for one in fields(group):
            name = f"{part.name}.{one.name}"
            if name in RANGES:
                _within(name, getattr(group, one.name))


def _within(name: str, value: object) -> None:
    low, high = RANGES[name]
    if not (isinstance(value, int | float) and low <= value <= high):
        raise PlantError(f"Door machine: {name} is {value!r}, expected a number from {low:g} to {high:g}.")


DEFAULT = Parameters()
