"""The firmware's limits, and its check of its own sensors, which are used only while their readings are plausible."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from palpate.devices.door.link.codes import DoorFault, State
from palpate.devices.door.plant.machine import Tick

SILENT_MS = 5
STUCK_MS = 20
"""Milliseconds for which the angle stands still before the encoder is doubted."""
STANDS_DEG = 0.05
"""An angle that stays within this range stands still; an observer or the last digit may still move it."""
BEFORE_MS = 4
STUCK_DEG_S = 25.0
"""No hand stops the arm at once from this speed: within STANDS_DEG that takes 109 rad/s^2."""
PULLED_NM = 25.0
"""The arm does not stand still against a hand that pulls this much more than the rendered torque."""
FROM_A_STOP_DEG = 1.0
Found = tuple[DoorFault, float]


@dataclass
class SensorCheck:
    """A check of one reading per millisecond."""

    limits: Limits
    t_us: int | None = None
    silent_ms: int = 0
    angles_deg: deque[float] = field(default_factory=lambda: deque(maxlen=BEFORE_MS + STUCK_MS + 1))
    pulled_ms: int = 0

    def check(self, reading: Tick, state: State, end_deg: float) -> Found | None:
        """Return a fault and the value that shows it; None if the reading is plausible."""
        if reading.t_us == self.t_us:
            self.silent_ms += 1
            return (DoorFault.sensor_silent, float(self.silent_ms)) if self.silent_ms >= SILENT_MS else None
        self.t_us, self.silent_ms = reading.t_us, 0
        return self._impossible(reading) or self._too_fast(reading, state) or self._stuck(reading, state, end_deg)

    def _impossible(self, reading: Tick) -> Found | None:
        sensed = (
            (math.degrees(reading.angle_rad), self.limits.angle_deg),
            (math.degrees(reading.velocity_rad_s), (-math.inf, math.inf)),
            (reading.torque_Nm, self.limits.sensed_Nm),
            (reading.brake_A, self.limits.brake_A),
        )
        for value, (least, most) in sensed:
            if not math.isfinite(value):
                return DoorFault.not_a_number, value
            if not least <= value <= most:
                return DoorFault.over_range, value
        return None

    def _too_fast(self, reading: Tick, state: State) -> Found | None:
        speed = math.degrees(reading.velocity_rad_s)
        moving = state in (State.armed, State.playing)
        return (DoorFault.over_speed, speed) if moving and abs(speed) > self.limits.speed_deg_s else None

    def _stuck(self, reading: Tick, state: State, end_deg: float) -> Found | None:
        """Return a fault if the encoder stands still while the arm cannot: it stopped at once, or is being pulled."""
        angle = math.degrees(reading.angle_rad)
        self.angles_deg.append(angle)
        pulled = abs(reading.torque_Nm) > abs(reading.commanded_Nm) + PULLED_NM
        self.pulled_ms = self.pulled_ms + 1 if pulled else 0
        if state is not State.playing or not FROM_A_STOP_DEG < angle < end_deg - FROM_A_STOP_DEG:
            return None
        late = list(self.angles_deg)[BEFORE_MS:]
        if len(late) <= STUCK_MS or max(late) - min(late) > STANDS_DEG:
            return None
        before_deg_s = abs(self.angles_deg[BEFORE_MS] - self.angles_deg[0]) * 1000 / BEFORE_MS
        stuck = before_deg_s >= STUCK_DEG_S or self.pulled_ms >= STUCK_MS
        return (DoorFault.encoder_stuck, angle) if stuck else None


@dataclass(frozen=True)
class Limits:
    """Limits of a profile and of the motion while the motor is on, and of the sensors' readings."""

    torque_Nm: float = 60.0
    slope_Nm_deg: float = 100.0
    speed_deg_s: float = 180.0
    angle_deg: tuple[float, float] = (-15.0, 80.0)
    sensed_Nm: tuple[float, float] = (-250.0, 250.0)
    brake_A: tuple[float, float] = (-0.5, 20.0)
    still_deg_s: float = 5.0
    """Greatest speed of the arm at which the motor is switched on."""
