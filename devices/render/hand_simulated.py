"""A simulated hand that strokes freely, through a tablet's twin and the stylus' filters to speed and force."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import numpy as np

from palpate.devices.render.hands import Scripted
from palpate.devices.surfaces.hand import FreeHand, Motion, free_hand
from palpate.devices.tablet.device import Settings, make
from palpate.signals.arrays import Array
from palpate.signals.textures.sounds import RenderError

PIECE = 256
SHORTEST_S, LONGEST_S = 1.0, 3600.0


@dataclass(frozen=True)
class OverTablet:
    """A scene with only a hand: where it is and how hard it presses, without a surface."""

    hand: FreeHand

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:
        """Yield zeros, as no acceleration is simulated: pieces of shape (n, 3)."""
        return (np.zeros((len(piece.force), 3)) for piece in self._pieces(rate_hz))

    def wrench(self, rate_hz: float) -> Iterator[Array]:
        """Yield the wrench, with the force in the third column: (n, 6)."""
        for piece in self._pieces(rate_hz):
            made = np.zeros((len(piece.force), 6))
            made[:, 2] = piece.force
            yield made

    def position_mm(self, rate_hz: float) -> Iterator[Array]:
        """Yield the tip's position, (n, 3)."""
        for piece in self._pieces(rate_hz):
            yield np.column_stack([*piece.place, np.zeros(len(piece.force))])

    def _pieces(self, rate_hz: float) -> Iterator[Motion]:
        return (self.hand.at((first + np.arange(PIECE)) / rate_hz) for first in count(0, PIECE))


@dataclass
class _Clock:
    s: float = 0.0

    def __call__(self) -> float:
        return self.s

    def ns(self) -> int:
        return round(self.s * 1e9)


@dataclass
class _Read:
    speed: list[float] = field(default_factory=list)
    force: list[float] = field(default_factory=list)


def simulated_hand(seconds: float, seed: int) -> Scripted:
    """Return free strokes over a tablet's twin for some seconds, seeded. Raises RenderError."""
    if not SHORTEST_S <= seconds <= LONGEST_S:
        raise RenderError(f"{seconds:g} s of a simulated hand: {SHORTEST_S:g} to {LONGEST_S:g} are expected.")
    clock, read = _Clock(), _Read()
    tablet = make("stylus", Settings(kind="tablet", driver="twin", seed=seed), Path())
    tablet.elapsed_s = clock
    tablet.expect(OverTablet(free_hand(seconds, "render", seed)))
    tablet.open()
    tablet.start(clock.ns)
    steps = round(seconds * 1000)
    while len(read.speed) < steps:
        clock.s += 0.5
        for block in tablet.read(0.0)["stylus"]:
            rows = np.frombuffer(block.data, "<f4").reshape(-1, 6)
            read.speed.extend(rows[:, 4].tolist())
            read.force.extend(rows[:, 5].tolist())
    tablet.close()
    return Scripted(read.speed[:steps], read.force[:steps])
