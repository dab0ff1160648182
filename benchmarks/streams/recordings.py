"""Synthetic sensors that note when every read was due and when it ran, for the figures for streams."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.devices.device import Block, Health, NowNs, Signal
from palpate.devices.scene import Scene
from palpate.protocols.events import NS

KINDS = (
    ("vibration", ("x", "y", "z"), 3000.0),
    ("force", ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), 10_000.0),
    ("tracker", ("x", "y", "z"), 120.0),
    ("door", ("angle", "velocity", "torque", "brake", "state"), 1000.0),
)
BLOCK_S = 0.005
"""Seconds of a block: a reader is woken 200 times a second, whatever the rate."""
RAMP = 1 << 16
"""The number at which a channel starts again from 0: float32 holds every number below exactly."""


@dataclass
class SyntheticSensor:
    """A sensor that gives the due samples, `fast` times as many as its rate says; every value is the sample's number.

    `late_ns` has for every read when it was due and when the thread ran; `handed_ns` how long passing on the samples of
    the previous read took.
    """

    name: str
    channels: tuple[str, ...]
    rate_hz: float
    fast: float
    late_ns: list[tuple[int, int]] = field(default_factory=list)
    handed_ns: list[int] = field(default_factory=list)
    produced: int = 0
    start_ns: int = 0
    turn: int = 0
    left_ns: int = 0
    now_ns: NowNs = time.perf_counter_ns

    def __post_init__(self) -> None:
        ramp = np.arange(2 * RAMP, dtype="<f4") % RAMP
        self.ramp = np.repeat(ramp, len(self.channels)).tobytes()

    @property
    def signals(self) -> Sequence[Signal]:
        """The sensor's one signal, at the accelerated rate."""
        units = ("1",) * len(self.channels)
        return (Signal("samples", self.channels, units, self.rate_hz * self.fast, self.name),)

    def open(self) -> None:
        """Do nothing: there is no device to open."""

    def safe(self) -> None:
        """Do nothing: nothing moves."""

    def close(self) -> None:
        """Do nothing: there is no device to close."""

    def describe(self) -> Mapping[str, Any]:
        """Return a description."""
        return {"kind": "made up"}

    def health(self, seconds: float) -> Health:
        """Return that the sensor is well."""
        return Health(True, f"made up, {seconds} s")

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: it gives the same numbers for any scene."""

    def start(self, now_ns: NowNs) -> None:
        """Start counting at 0."""
        self.now_ns, self.start_ns = now_ns, now_ns()

    def stop(self) -> None:
        """Do nothing: nothing runs."""

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Sleep until the next block is due, and return all blocks that are due then."""
        if self.left_ns:
            self.handed_ns.append(time.perf_counter_ns() - self.left_ns)
        self._sleep(timeout_s)
        at_ns = self.now_ns()
        count = int((at_ns - self.start_ns) / NS * self.rate_hz * self.fast) - self.produced
        if count <= 0:
            self.left_ns = 0
            return {}
        row, start = 4 * len(self.channels), self.produced % RAMP
        count = min(count, RAMP)
        block = Block(self.produced, self.ramp[start * row : (start + count) * row], at_ns)
        self.produced += count
        self.left_ns = time.perf_counter_ns()
        return {"samples": (block,)}

    def _sleep(self, timeout_s: float) -> None:
        if not timeout_s:
            return
        due_ns = self.start_ns + round((self.turn + 1) * BLOCK_S * NS)
        time.sleep(max(0, due_ns - self.now_ns()) / NS)
        woken_ns = self.now_ns()
        self.late_ns.append((due_ns, woken_ns))
        self.turn = max(self.turn + 1, int((woken_ns - self.start_ns) / NS / BLOCK_S))
