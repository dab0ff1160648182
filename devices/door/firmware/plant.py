"""What the firmware needs of the door that it drives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from palpate.devices.door.plant.machine import Mode, Tick


class Plant(Protocol):
    """The arm, its motor, its brake and its inner control loops.

    `off`: motor off, brake fully on; `hold`: the arm is held where it is; `play`: the loaded profile is rendered.
    """

    mode: Mode

    def load(self, torque_Nm: Sequence[float], end_rad: float) -> None:
        """Take a profile over 0 to 62 degrees, and where its stop stands."""

    def change(self, torque_Nm: Sequence[float]) -> None:
        """While playing: pass over to this profile without a step in torque; the stop stays where it is."""

    def step(self) -> Tick:
        """Go on for 1 ms; the time of the reading stands still where the sensors are silent."""
