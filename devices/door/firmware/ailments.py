"""Simulated sensor faults of the door for drills: a plant whose sensors fail at a given millisecond."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from palpate.devices.door.firmware.twin_plant import Plant
from palpate.devices.door.plant.machine import Mode, Tick

Ailment = Callable[[Tick, Tick], Tick]
"""From the true reading and the reading reported last to the one that is reported."""
AILMENTS: Mapping[str, Ailment] = {
    "silent": lambda _true, last: last,
    "stuck": lambda true, last: replace(true, angle_rad=last.angle_rad, velocity_rad_s=0.0),
    "not_a_number": lambda true, _last: replace(true, torque_Nm=math.nan),
    "angle_not_a_number": lambda true, _last: replace(true, angle_rad=math.nan, velocity_rad_s=math.nan),
    "infinite": lambda true, _last: replace(true, torque_Nm=math.inf),
    "over_range": lambda true, _last: replace(true, torque_Nm=1e6),
    "angle_over_range": lambda true, _last: replace(true, angle_rad=10.0),
    "too_fast": lambda true, _last: replace(true, velocity_rad_s=100.0),
}


@dataclass
class Ailing:
    """A plant whose sensors are faulty from the millisecond `from_ms` on; None: never."""

    plant: Plant
    ailment: str
    from_ms: int | None = None
    t_ms: int = 0
    last: Tick | None = None

    @property
    def mode(self) -> Mode:
        """Return the mode of the plant."""
        return self.plant.mode

    @mode.setter
    def mode(self, mode: Mode) -> None:
        self.plant.mode = mode

    def load(self, torque_Nm: Sequence[float], end_rad: float) -> None:
        """Load the profile in the plant."""
        self.plant.load(torque_Nm, end_rad)

    def change(self, torque_Nm: Sequence[float]) -> None:
        """Change the profile of the plant."""
        self.plant.change(torque_Nm)

    def step(self) -> Tick:
        """Advance the plant by 1 ms and return what its faulty sensors report."""
        self.t_ms += 1
        reading = self.plant.step()
        if self.from_ms is not None and self.t_ms >= self.from_ms and self.last is not None:
            reading = AILMENTS[self.ailment](reading, self.last)
        self.last = reading
        return reading
