"""What the firmware needs of the door that it drives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

Mode = Literal["off", "hold", "play"]


class Reading(Protocol):
    """What the device's own sensors give after 1 ms of plant time; t_us stands still where they are silent."""

    @property
    def t_us(self) -> int:
        """Time of the reading."""

    @property
    def angle_rad(self) -> float:
        """Opening angle, as the encoder counts it."""

    @property
    def velocity_rad_s(self) -> float:
        """Speed, positive where the door opens."""

    @property
    def torque_Nm(self) -> float:
        """The hand's torque on the arm."""

    @property
    def brake_A(self) -> float:
        """Current in the brake."""

    @property
    def commanded_Nm(self) -> float:
        """Torque that the profile asks for here."""

    @property
    def motor_Nm(self) -> float:
        """Torque of the motor."""


class Plant(Protocol):
    """The arm, its motor, its brake and its inner control loops.

    `off`: motor off, brake fully on; `hold`: the arm is held where it is; `play`: the loaded profile is rendered.
    """

    mode: Mode

    def load(self, torque_Nm: Sequence[float], end_rad: float) -> None:
        """Take a profile over 0 to 62 degrees, and where its stop stands."""

    def step(self) -> Reading:
        """Go on for 1 ms."""
