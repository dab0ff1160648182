"""What the firmware allows, whatever the host asks for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Limits of a profile and of the motion while the motor is on, and what the sensors can read at all."""

    torque_Nm: float = 60.0
    slope_Nm_deg: float = 100.0
    speed_deg_s: float = 180.0
    angle_deg: tuple[float, float] = (-15.0, 80.0)
    sensed_Nm: tuple[float, float] = (-250.0, 250.0)
    brake_A: tuple[float, float] = (-0.5, 20.0)
    still_deg_s: float = 5.0
    """The arm may move no faster than this where the motor is switched on."""
