"""An opening of a car's door as its sensors are exposed to it (thesis 5.3.1.1; see devices/scene.py)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import count

import numpy as np

from palpate.devices.door.opening import RATE_HZ, opened_once
from palpate.devices.scene import PIECE_S
from palpate.protocols.keyed import Key, uniform
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import DoorDataError

RADIUS_M = 0.95
"""Distance from the hinge to handle, force sensor and marker by default."""
ASIDE = 0.06
"""Greatest share of the pull that acts up or along the door instead."""
ASIDE_HZ = (0.4, 1.5)
GRIP_M = (0.0, 0.004, -0.002)
"""Point of the pull from the sensor's origin, so close that a sensor of 50 N and 0.5 N m withstands every door."""
RATES_HZ = (1.0, 100_000.0)


class OpeningScene:
    """A hand that opens the door of a profile once in `seconds`, as in `palpate.devices.door.opening`.

    The key seeds the hand. Axes: z up; at the closed door, x in the direction of the pull, y from the hinge to the
    handle. The force sensor turns with the door, the tracker does not.
    """

    def __init__(self, profile_N: Sequence[float], seconds: float, *key: Key, radius_m: float = RADIUS_M) -> None:
        """Prepare the motion. Raises DoorDataError as `opened_once`, and for a radius outside 0.1 to 3 m."""
        if not 0.1 <= radius_m <= 3:
            raise DoorDataError(f"radius_m is {radius_m}: from 0.1 to 3 m from hinge to handle are expected.")
        opening = opened_once(profile_N, seconds, *key)
        self.radius_m = radius_m
        self._force, self._angle = np.array(opening.force_N), np.radians(opening.angle_deg)
        self._sways = tuple(_sway(axis, key) for axis in ("up", "along"))

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:
        """Yield the readings of an accelerometer at rest beside the door: pieces of shape (n, 3)."""
        return _pieces(lambda t_s: np.tile((0.0, 0.0, GRAVITY_M_S2), (len(t_s), 1)), rate_hz)

    def wrench(self, rate_hz: float) -> Iterator[Array]:
        """Yield the hand's force on the handle, x the pull in N, and its torque in N m: pieces of shape (n, 6)."""
        return _pieces(self._wrench_at, rate_hz)

    def position_mm(self, rate_hz: float) -> Iterator[Array]:
        """Yield the marker on its circle around the hinge, which is the origin: pieces of shape (n, 3)."""
        return _pieces(self._position_at, rate_hz)

    def _wrench_at(self, t_s: Array) -> Array:
        pull = _read(self._force, t_s)
        force = np.column_stack([pull, *(pull * sway(t_s) for sway in reversed(self._sways))])
        return np.hstack([force, np.cross(GRIP_M, force)])

    def _position_at(self, t_s: Array) -> Array:
        angle, radius_mm = _read(self._angle, t_s), 1000 * self.radius_m
        return np.column_stack([radius_mm * np.sin(angle), radius_mm * np.cos(angle), np.zeros(len(t_s))])


def _sway(axis: str, key: tuple[Key, ...]) -> Callable[[Array], Array]:
    low, high = ASIDE_HZ
    omega = 2 * np.pi * (low + (high - low) * uniform("aside", axis, *key))
    phase = 2 * np.pi * uniform("aside phase", axis, *key)
    return lambda t_s: np.asarray(ASIDE * np.sin(omega * t_s + phase))


def _read(values: Array, t_s: Array) -> Array:
    """Return the values interpolated between the steps of the motion; the last value holds after it."""
    return np.asarray(np.interp(t_s * RATE_HZ, np.arange(len(values)), values))


def _pieces(at: Callable[[Array], Array], rate_hz: float) -> Iterator[Array]:
    low, high = RATES_HZ
    if not low <= rate_hz <= high:
        raise DoorDataError(f"{rate_hz} samples a second: from {low:g} to {high:g} are expected.")
    rows = max(1, round(PIECE_S * rate_hz))
    return (at(np.arange(n * rows, (n + 1) * rows) / rate_hz) for n in count())
