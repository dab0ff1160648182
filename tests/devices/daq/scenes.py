"""Acts with a known truth, a clock that tests move, and a card whose volts tests bend."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np


@dataclass
class Clock:
    now_s: float = 0.0

    def __call__(self) -> float:
        return self.now_s

    def ns(self) -> int:
        return round(self.now_s * 1e9)


@dataclass(frozen=True)
class Steady:
    """The same all the time, plus a sine of `hz` along `swing` where that is given."""

    wrench_is: tuple[float, ...] = (0.0,) * 6
    acceleration_is: tuple[float, ...] = (0.0, 0.0, 9.80665)
    hz: float = 0.0
    swing: tuple[float, ...] = (0.0,)
    piece: int = 777

    def wrench(self, rate_hz: float) -> Iterator[np.ndarray]:
        return self._pieces(np.array(self.wrench_is), rate_hz)

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[np.ndarray]:
        return self._pieces(np.array(self.acceleration_is), rate_hz)

    def position_mm(self, rate_hz: float) -> Iterator[np.ndarray]:
        return self._pieces(np.zeros(3), rate_hz)

    def _pieces(self, mean: np.ndarray, rate_hz: float) -> Iterator[np.ndarray]:
        first = 0
        while True:
            t_s = np.arange(first, first + self.piece) / rate_hz
            swing = np.resize(self.swing, len(mean)) if self.hz else np.zeros(len(mean))
            yield mean + np.sin(2 * np.pi * self.hz * t_s)[:, None] * swing
            first += self.piece


@dataclass
class Bent:
    """A card whose volts go through `bend(volts, number of the first)` on their way."""

    daq: object
    bend: Callable[[np.ndarray, int], np.ndarray]
    first: int = 0

    def __getattr__(self, name):
        return getattr(self.daq, name)

    def start(self, pace) -> None:
        self.first = 0
        self.daq.start(pace)

    def read(self, most, timeout_s):
        taken = self.daq.read(most, timeout_s)
        if not len(taken.volts):
            return taken
        bent = self.bend(taken.volts.copy(), self.first)
        self.first += len(bent)
        return type(taken)(bent, taken.lost)


def rows(signal, blocks) -> np.ndarray:
    joined = b"".join(block.data for block in blocks)
    return np.frombuffer(joined, "<f4").reshape(-1, len(signal.channels))


def run(sensor, clock: Clock, seconds: float, step_s: float = 0.05) -> list:
    """Let time pass and read, until `seconds` are over: the blocks of the one signal."""
    blocks = []
    sensor.start(clock.ns)
    for _ in range(round(seconds / step_s)):
        clock.now_s += step_s
        blocks += sensor.read(0.01)[sensor.signals[0].name]
    sensor.stop()
    return blocks
