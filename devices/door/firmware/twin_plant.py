"""The twin's plant: the simulated door machine, and a hand that opens and closes the door whenever it plays."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from random import Random
from typing import Protocol

from palpate.devices.door.plant.hand import NOBODY, Hand, minimum_jerk
from palpate.devices.door.plant.machine import Machine, Mode, Tick
from palpate.devices.door.plant.parameters import DEFAULT
from palpate.signals.doors.grid import MAX_ANGLE_DEG

STIFFNESS_NM_RAD, DAMPING_NM_S_RAD, GRIP_NM = 600.0, 20.0, 250.0
BEYOND_RAD = math.radians(4)
"""How far beyond the end the hand aims, so that it reaches the stop against any torque of a profile there."""
START_S = 0.3
WHOLE_RAD = math.radians(MAX_ANGLE_DEG)
LEAST_SHARE = 0.25


class TwinPlant:
    """A machine with a hand that is there only while the door plays; the time of each opening is random by the seed."""

    def __init__(self, seed: int) -> None:
        sensors = replace(DEFAULT.sensors, seed=seed)
        self.machine = Machine(replace(DEFAULT, sensors=sensors), NOBODY)
        self._random = Random(seed)
        self._end_rad = 0.0

    @property
    def mode(self) -> Mode:
        """Return the mode of the machine."""
        return self.machine.mode

    @mode.setter
    def mode(self, mode: Mode) -> None:
        if mode == "play" and self.machine.mode != "play":
            # From where the arm is, back to closed if it is not, then open, stay a moment, and back. A door that opens
            # less is opened in fewer seconds.
            share = max(LEAST_SHARE, self._end_rad / WHOLE_RAD)
            opens_s, stays_s = share * self._random.uniform(2.0, 3.0), self._random.uniform(0.2, 0.6)
            here, end = self.machine.sensing.angle_rad, self._end_rad + BEYOND_RAD
            moves = [(here, here, START_S), (here, 0.0, 0.2 + opens_s * max(here, 0.0) / end), (0.0, 0.0, START_S)]
            path = _path([*moves, (0.0, end, opens_s), (end, end, stays_s), (end, 0.0, opens_s)])
            self.machine.hand = Hand(path, STIFFNESS_NM_RAD, DAMPING_NM_S_RAD, grip_Nm=GRIP_NM)
        elif mode != "play":
            self.machine.hand = NOBODY
        self.machine.mode = mode

    def load(self, torque_Nm: Sequence[float], end_rad: float) -> None:
        """Load a profile."""
        self.machine.load(torque_Nm, end_rad)
        self._end_rad = end_rad

    def change(self, torque_Nm: Sequence[float]) -> None:
        """Change to another profile with the same stop."""
        self.machine.change(torque_Nm)

    def step(self) -> Tick:
        """Advance by 1 ms."""
        return self.machine.step()


def _path(moves: Sequence[tuple[float, float, float]]) -> Callable[[float], tuple[float, float]]:
    def path(t_s: float) -> tuple[float, float]:
        for start, to, seconds in moves:
            if t_s < seconds:
                place, speed = minimum_jerk(t_s / seconds)
                return start + (to - start) * place, (to - start) * speed / seconds
            t_s -= seconds
        return moves[-1][1], 0.0

    return path


class Plant(Protocol):
    """The arm, its motor, its brake and its inner control loops.

    `off`: motor off, brake fully on; `hold`: the arm is held in place; `play`: the loaded profile is rendered.
    """

    mode: Mode

    def load(self, torque_Nm: Sequence[float], end_rad: float) -> None:
        """Load a profile over 0 to 62 degrees, and the position of its stop."""

    def change(self, torque_Nm: Sequence[float]) -> None:
        """Change to this profile while playing, without a step in torque; the stop stays in place."""

    def step(self) -> Tick:
        """Advance by 1 ms; the time of the reading does not change while the sensors are silent."""
