"""The emulator within this process: as a port in virtual time, and as a port paced by the wall clock.

Virtual time passes only while a test reads or waits, so that every dialogue and every drill is repeatable.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from palpate.devices.door.firmware.wire import Wire
from palpate.protocols.events import NS

MS_NS = NS // 1000
UNPLUGGED = "the device is gone"


@dataclass
class VirtualLine:
    """A port whose time passes only while somebody reads it, or in `run`.

    `every_ms` is called every millisecond, like a thread of the host, such as a link's heartbeat. An unplugged line
    raises OSError; the firmware goes on.
    """

    wire: Wire
    every_ms: Callable[[int], None] = lambda _t_ms: None
    t_ms: int = 0
    unplugged: bool = False
    arrived: bytearray = field(default_factory=bytearray)

    def clock_s(self) -> float:
        """Return the virtual time in seconds."""
        return self.t_ms / 1000

    def now_ns(self) -> int:
        """Return the virtual time in nanoseconds."""
        return self.t_ms * MS_NS

    def run(self, ms: int) -> None:
        """Let `ms` milliseconds pass."""
        for _ in range(ms):
            self.t_ms += 1
            out = self.wire.tick()
            if not self.unplugged:
                self.arrived += out
            self.every_ms(self.t_ms)

    def read(self, timeout_s: float) -> bytes:
        """Return the received bytes after the virtual time that they took."""
        until_ms = self.t_ms + max(1, round(timeout_s * 1000))
        while not self.arrived and not self.unplugged and self.t_ms < until_ms:
            self.run(1)
        if self.unplugged:
            raise OSError(UNPLUGGED)
        data = bytes(self.arrived)
        self.arrived.clear()
        return data

    def write(self, data: bytes) -> None:
        """Send the data."""
        if self.unplugged:
            raise OSError(UNPLUGGED)
        self.wire.push(data)

    def close(self) -> None:
        """Do nothing: the port needs no closing."""


@dataclass
class PacedLine:
    """A port whose device runs by the wall clock: bytes take the time that they take at the line's rate.

    `latency_ms` is the interval at which a USB adapter passes bytes on.
    """

    wire: Wire
    latency_ms: int = 1
    in_adapter: bytearray = field(default_factory=bytearray)
    began_s: float = field(default_factory=time.monotonic)
    ticks: int = 0
    arrived: bytearray = field(default_factory=bytearray)

    def read(self, timeout_s: float) -> bytes:
        """Return the received bytes."""
        until_s = time.monotonic() + timeout_s
        while not self.arrived and time.monotonic() < until_s:
            self._catch_up()
            if not self.arrived:
                time.sleep(2e-4)
        data = bytes(self.arrived)
        self.arrived.clear()
        return data

    def write(self, data: bytes) -> None:
        """Send the data."""
        self._catch_up()
        self.wire.push(data)

    def close(self) -> None:
        """Do nothing: the port needs no closing."""

    def _catch_up(self) -> None:
        for _ in range(int((time.monotonic() - self.began_s) * 1000) - self.ticks):
            self.ticks += 1
            self.in_adapter += self.wire.tick()
            if self.ticks % self.latency_ms == 0:
                self.arrived += self.in_adapter
                self.in_adapter.clear()
