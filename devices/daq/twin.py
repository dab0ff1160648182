"""A simulated card: 16-bit volts computed from a scene at the sensor's rate, in a buffer that can overrun.

Noise is hashed from its key and the numbers of its start and its block: no two acts share it, and it depends neither on
how the samples are read nor on the machine.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.daq.acquire import POLL_S, Pace, Taken, Volts, Wiring
from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.noise import QUANTILES
from palpate.protocols.canonical import canonical
from palpate.protocols.keyed import Key

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

BITS = 16
"""Bits of the converter, as in the card of thesis 4.3.1 (USB-6351)."""
PIECE = 512
"""Samples per block of noise."""
NOISE = np.array(QUANTILES)
DUE = 1e-6
"""Tolerance in samples: a sample falls due this much before its time, so that sums of decimal steps lose none."""

Ideal = Callable[["Scene | None", float], Iterator[Volts]]
"""Endless volts of an ideal sensor in a scene at a rate: pieces of shape (n, channels)."""


@dataclass
class TwinDaq:
    """A card that computes samples as they fall due; unread samples are overwritten and counted as lost."""

    name: str
    wiring: Wiring
    ideal: Ideal
    noise_V: float
    key: tuple[Key, ...] = ()
    scene: Scene | None = None
    pace: Pace | None = None
    is_open: bool = False
    starts: int = 0
    made: int = 0
    unplugged: bool = False
    pieces: Iterator[Volts] = field(default_factory=lambda: iter(()))
    rest: Volts = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def facts(self) -> Mapping[str, str]:
        """Return what kind of card the twin simulates, and its rate."""
        return {"card": f"twin of a {BITS}-bit card", "rate_hz": f"{self.wiring.rate_hz:.9g}"}

    def open(self) -> None:
        """Reset the twin and open it; it is always available."""
        self.close()
        self.is_open = True

    def expect(self, scene: Scene | None) -> None:
        """Set the scene of the next start."""
        self.scene = scene

    def start(self, pace: Pace) -> None:
        """Begin the scene. Raises DeviceError if it is not open."""
        if not self.is_open:
            raise DeviceError(f"{self.name}: the card is not open")
        self.starts += 1
        self.pieces = _converted(self.wiring, self.ideal(self.scene, self.wiring.rate_hz), self._noise())
        self.rest, self.made, self.pace = np.empty((0, len(self.wiring.channels))), 0, pace

    def read(self, most: int, timeout_s: float) -> Taken:
        """Return the samples that have fallen due, and how many were overwritten before them.

        Raises DeviceFault if the twin is unplugged.
        """
        if self.unplugged:
            raise DeviceFault(self.name, "link_lost", f"{self.name}: the card is unplugged.")
        if self.pace is None:
            return Taken(np.empty((0, len(self.wiring.channels))))
        due = self._due(self.pace, timeout_s)
        lost = max(0, due - self.wiring.buffer)
        passed = 0
        while passed < lost:
            passed += len(self._take(min(lost - passed, self.wiring.buffer)))
        return Taken(self._take(min(due - lost, most)), lost)

    def stop(self) -> None:
        """End sampling."""
        self.pace = None
        self.pieces = iter(())

    def close(self) -> None:
        """Mark the twin as closed."""
        self.stop()
        self.is_open = False

    def _due(self, pace: Pace, timeout_s: float) -> int:
        """Return how many samples have fallen due and were neither read nor lost."""
        needed = max(1, round(self.wiring.rate_hz * min(POLL_S, timeout_s)))
        end = pace.elapsed_s() + timeout_s
        while True:
            elapsed = pace.elapsed_s()
            due = int(elapsed * self.wiring.rate_hz + DUE) - self.made
            if due >= needed or elapsed >= end:
                return max(0, due)
            pace.wait(min(POLL_S, timeout_s))
            if pace.elapsed_s() == elapsed:
                return max(0, due)

    def _take(self, count: int) -> Volts:
        parts, missing = [self.rest[:count]], count - len(self.rest)
        self.rest = self.rest[count:]
        while missing > 0:
            piece = next(self.pieces)
            parts.append(piece[:missing])
            self.rest = piece[missing:]
            missing -= len(piece)
        self.made += count
        return np.concatenate(parts)

    def _noise(self) -> Iterator[Volts]:
        shape = PIECE, len(self.wiring.channels)
        number = 0
        while True:
            yield self.noise_V * gaussians(shape, "daq", self.name, *self.key, self.starts, number)
            number += 1


def quantised(volts: Volts, wiring: Wiring) -> Volts:
    """Return the volts as a converter gives them: in steps of range / 2^16, limited to the range."""
    step = (wiring.high_V - wiring.low_V) / 2**BITS
    codes = np.clip(np.rint((volts - wiring.low_V) / step), 0, 2**BITS - 1)
    return np.asarray(wiring.low_V + codes * step, np.float64)


def gaussians(shape: tuple[int, int], *key: Key) -> Volts:
    """Return standard normal numbers of 4096 levels, seeded by the key and equal on every machine."""
    bits = np.frombuffer(hashlib.shake_256(canonical(key)).digest(2 * shape[0] * shape[1]), "<u2")
    return np.asarray(NOISE[bits >> 4].reshape(shape), np.float64)


def _converted(wiring: Wiring, ideal: Iterator[Volts], noise: Iterator[Volts]) -> Iterator[Volts]:
    """Yield ideal volts with the noise added, in pieces of the ideal ones' lengths."""
    left = next(noise)
    for piece in ideal:
        while len(left) < len(piece):
            left = np.concatenate([left, next(noise)])
        yield quantised(piece + left[: len(piece)], wiring)
        left = left[len(piece) :]
