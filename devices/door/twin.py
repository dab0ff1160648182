"""The door's simulated twin: a hand opens it along a minimum-jerk path, and the profile gives the force.

Pure Python on purpose: a rating session with a simulated door needs no numpy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.devices.device import interleaved
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG, DoorDataError

LONGEST = 1_000_000
"""Greatest number of samples of one opening; more is a mistake in a rate or a duration."""


@dataclass(frozen=True)
class DoorTelemetry:
    """The door sensors' samples during one opening, one entry per sample."""

    rate_hz: float
    angle_deg: tuple[float, ...]
    force_N: tuple[float, ...]

    def interleaved(self) -> bytes:
        """Return angle and force alternating, as little-endian float32: 8 bytes per sample."""
        return interleaved(self.angle_deg, self.force_N)


def open_door(profile_N: Sequence[float], duration_s: float, rate_hz: float) -> DoorTelemetry:
    """Open the door from 0 to 62 degrees in `duration_s`, sampled at `rate_hz` from time 0 on.

    The path is the minimum-jerk one (Flash and Hogan 1985); the force is the profile's, linear between its 621
    points. There are floor(duration_s * rate_hz) + 1 samples.

    Raises:
        DoorDataError: a profile of another length, or a duration or rate that gives no usable number of samples.
    """
    if len(profile_N) != POINTS:
        raise DoorDataError(f"A door profile has {POINTS} points, this one has {len(profile_N)}.")
    steps = _steps(duration_s, rate_hz)
    span = duration_s * rate_hz
    grid = [(POINTS - 1) * _minimum_jerk(step / span) for step in range(steps + 1)]
    force = [_between(profile_N, place) for place in grid]
    return DoorTelemetry(rate_hz, tuple(place / POINTS_PER_DEG for place in grid), tuple(force))


def _steps(duration_s: float, rate_hz: float) -> int:
    """Return the number of whole sampling steps in the opening, with a tolerance for rounding errors."""
    for name, value in (("duration_s", duration_s), ("rate_hz", rate_hz)):
        if not (math.isfinite(value) and value > 0):
            raise DoorDataError(f"{name} is {value}: a finite number above 0 is needed.")
    steps = duration_s * rate_hz
    if not 1 <= steps < LONGEST:
        raise DoorDataError(f"{duration_s} s at {rate_hz} Hz is {steps:g} samples: between 1 and {LONGEST} are needed.")
    return min(math.floor(steps * (1 + 1e-12)), math.ceil(steps))


def _minimum_jerk(share: float) -> float:
    """Return the share of the distance after a share of the time."""
    share = min(share, 1.0)
    return min(share**3 * (10 + share * (6 * share - 15)), 1.0)


def _between(profile_N: Sequence[float], place: float) -> float:
    """Return the profile at a fractional grid index, linear between points and exact on them."""
    index = min(int(place), POINTS - 2)
    rest = place - index
    return profile_N[index] * (1 - rest) + profile_N[index + 1] * rest
