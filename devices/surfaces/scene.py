"""A hand-held tool that strokes over a simulated surface, as its sensors are exposed to it (see devices/scene.py)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import count

import numpy as np

from palpate.devices.scene import PIECE_S
from palpate.devices.surfaces.act import KEPT, Act, Batch
from palpate.devices.surfaces.contact import INTERNAL_HZ, law
from palpate.devices.surfaces.hand import Hand, free_hand, slow_wave
from palpate.devices.surfaces.rates import at_rate
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.table import Surface, SurfaceDataError
from palpate.devices.surfaces.tool import SWAYS, Ground, ground, torque
from palpate.protocols.keyed import Key
from palpate.signals.arrays import Array

LONGEST_S = 86_400.0
RATES_HZ = (1.0, 100_000.0)
SWAY_HZ = (0.1, 0.7)


def ground_of(texture: Surface) -> Ground:
    """Return the ground of a surface's relief (10 MB), to be shared by every scene on that surface."""
    return ground(relief(texture).height_um, texture.stiffness_N_mm)


class SurfaceScene:
    """An exploration of a surface; see `palpate.devices.scene.Scene`. The id seeds the relief, the key the hand.

    All sensors share one hand and one contact, computed at 10 kHz in batches of 6.4 s on demand, and band-limited below
    2 kHz. `kept` batches are cached; one that was dropped is computed again with the same result. After `seconds` the
    tool is held still off the surface.
    """

    def __init__(
        self, texture: Surface, seconds: float, *key: Key, hand: Hand | None = None, under: Ground | None = None,
        kept: int = KEPT,
    ) -> None:  # fmt: skip
        """Make the ground, unless `under` is given. Raises SurfaceDataError for less than 0.1 s or over a day."""
        if not 0.1 <= seconds <= LONGEST_S:
            raise SurfaceDataError(f"{seconds} s of exploration: from 0.1 to {LONGEST_S:g} s are expected")
        self.seconds = seconds
        sway = (slow_wave(2 * SWAYS, SWAY_HZ, "sway", "x", *key), slow_wave(2 * SWAYS, SWAY_HZ, "sway", "y", *key))
        self._act = Act(
            under if under is not None else ground_of(texture), law(texture),
            hand if hand is not None else free_hand(seconds, "hand", *key), seconds, sway, kept,
        )  # fmt: skip

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:
        """Yield the ideal acceleration of the tool in its axes, with gravity: pieces of shape (n, 3)."""
        return self._pieces(lambda batch: batch.acceleration, rate_hz)

    def wrench(self, rate_hz: float) -> Iterator[Array]:
        """Yield the surface's force on the tip (x, y along it, z out of it) and its torque about the sensor: (n, 6).

        They are in the sample's axes, so that the third column is the normal force.
        """
        return (np.hstack([force, torque(force)]) for force in self._pieces(lambda batch: batch.force, rate_hz))

    def position_mm(self, rate_hz: float) -> Iterator[Array]:
        """Yield the tip's position, from the middle of the sample and of its height: pieces of shape (n, 3)."""
        return self._pieces(lambda batch: batch.place, rate_hz)

    def _pieces(self, part: Callable[[Batch], Array], rate_hz: float) -> Iterator[Array]:
        low, high = RATES_HZ
        if not low <= rate_hz <= high:
            raise SurfaceDataError(f"{rate_hz} samples a second: from {low:g} to {high:g} are expected")
        whole = (part(self._act.batch(number)) for number in count())
        return cut(at_rate(whole, INTERNAL_HZ, rate_hz), max(1, round(PIECE_S * rate_hz)))


def cut(pieces: Iterator[Array], rows: int) -> Iterator[Array]:
    """Yield each piece in parts of at most `rows` rows."""
    return (piece[first : first + rows] for piece in pieces for first in range(0, len(piece), rows))


def first_rows(pieces: Iterator[Array], rows: int) -> Array:
    """Return the first rows of an endless signal in one array."""
    taken: list[Array] = []
    while sum(map(len, taken)) < rows:
        taken.append(next(pieces))
    return np.concatenate(taken)[:rows]
