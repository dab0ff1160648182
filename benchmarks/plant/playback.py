"""The accuracy of a rendered door: torque at the handle against the profile's, along a pull."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.devices.door.plant.hand import Hand, human
from palpate.devices.door.plant.machine import Machine
from palpate.devices.door.plant.parameters import DEFAULT, Parameters
from palpate.devices.door.plant.rendering import STEP_RAD
from palpate.signals.doors.grid import motion_end

HANDLE_M = 0.9
SETTLE_TICKS = 100
FIRST_RAD = math.radians(0.05)
"""The angle up to which the arm is in its latch and nothing is rendered."""


@dataclass(frozen=True)
class Playback:
    """One pull with a row for each millisecond of motion: the arm's true angle, and torques at the handle."""

    angle_rad: tuple[float, ...]
    commanded_Nm: tuple[float, ...]
    rendered_Nm: tuple[float, ...]

    @property
    def rmse_Nm(self) -> float:
        """The root mean square of rendered minus commanded torque."""
        pairs = zip(self.rendered_Nm, self.commanded_Nm, strict=True)
        return math.sqrt(sum((one - other) ** 2 for one, other in pairs) / len(self.angle_rad))

    @property
    def r(self) -> float:
        """Pearson's correlation of rendered and commanded torque."""
        one, other = _centred(self.rendered_Nm), _centred(self.commanded_Nm)
        both = sum(a * b for a, b in zip(one, other, strict=True))
        return both / math.sqrt(sum(a * a for a in one) * sum(b * b for b in other))


def as_torque(force_N: Sequence[float], handle_m: float = HANDLE_M) -> tuple[tuple[float, ...], float]:
    """Return a profile of forces at the handle as torques, and the angle in rad where it ends."""
    return tuple(force * handle_m for force in force_N), motion_end(tuple(force_N)) * STEP_RAD


def play(
    torque_Nm: Sequence[float],
    end_rad: float,
    hand: Hand | None = None,
    duration_s: float = 3.3,
    parameters: Parameters = DEFAULT,
) -> Playback:
    """Pull the machine's door open once and return its true torque at the handle (not its sensor's) and the command."""
    machine = Machine(parameters, human(end_rad) if hand is None else hand)
    machine.load(torque_Nm, end_rad)
    machine.mode = "hold"
    for _ in range(SETTLE_TICKS):
        machine.step()
    machine.mode = "play"
    rows = []
    for _ in range(round(duration_s * 1000)):
        machine.step()
        angle = machine.dynamics.angle_rad
        if FIRST_RAD < angle < end_rad:
            rows.append((angle, machine.rendered.at(angle), machine.handle_Nm))
    angles, commanded, rendered = zip(*rows, strict=True)
    return Playback(angles, commanded, rendered)


def _centred(values: Sequence[float]) -> list[float]:
    mean = sum(values) / len(values)
    return [value - mean for value in values]
