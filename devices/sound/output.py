"""Outputs that play samples: a sound card, a DAQ card, or a recording twin."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from palpate.devices.device import DeviceFault
from palpate.signals.arrays import Array

Fill = Callable[[int], Array]
"""Returns the next samples of one channel; called from any thread, and must not wait."""
DRAIN_S = 0.25
"""Longest time for which an output plays on until a ramp ends."""


class Output(Protocol):
    """An output that plays the samples of `fill`, one after the other, at `rate_hz`.

    `latency_s` is how long a sample waits in the output before it sounds.
    """

    @property
    def rate_hz(self) -> float:
        """Return the rate in samples per second."""

    @property
    def latency_s(self) -> float:
        """Return the latency in seconds."""

    def wait_s(self) -> float:
        """Return how long from now the next sample sounds that is filled; below 0 where it was due before."""

    def open(self) -> None:
        """Check that the output is available. Raises DeviceError."""

    def start(self, fill: Fill) -> None:
        """Begin to play. Raises DeviceError."""

    def cut(self) -> None:
        """Drop the samples in the output, if that is possible without a click; any thread may call it."""

    def drain(self, silent: threading.Event) -> None:
        """Play on until the event says that only silence is left, for at most DRAIN_S."""

    def stop(self) -> None:
        """Stop playing and release the output, also if it is not playing."""

    def fault(self) -> DeviceFault | None:
        """Return the fault that occurred while it played, or None."""

    def facts(self) -> Mapping[str, str]:
        """Return a description for people."""


class Plays(Protocol):
    """A device that plays through an output."""

    name: str
    output: Any


def unplug(device: Plays) -> None:
    """Cut the output of a twin off, as if its cable were pulled."""
    device.output.broken = DeviceFault(device.name, "link_lost", f"{device.name}: its output is unplugged.")


@dataclass
class Tape:
    """An output without hardware: it takes the samples that are due by its clock and passes them to `heard`.

    If it was not called for longer than `most_s`, older samples are skipped. `broken` is the fault of one that was
    unplugged.
    """

    rate_hz: float
    elapsed_s: Callable[[], float]
    heard: Callable[[Array], None]
    latency_s: float = 0.0
    most_s: float = math.inf
    taken: int = 0
    broken: DeviceFault | None = None
    _fill: Fill | None = None
    _started_s: float = 0.0
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def wait_s(self) -> float:
        """Return when the next sample is due by the clock, in seconds from now."""
        return self._started_s + self.taken / self.rate_hz - self.elapsed_s() + self.latency_s

    def open(self) -> None:
        """Start the clock: a twin is always available."""

    def start(self, fill: Fill) -> None:
        """Begin at the current time of the clock."""
        self._fill, self._started_s, self.taken = fill, self.elapsed_s(), 0

    def advance(self) -> None:
        """Play the samples that are due by now."""
        with self._lock:
            due = int((self.elapsed_s() - self._started_s) * self.rate_hz + 1e-6)
            self.taken = max(self.taken, math.ceil(due - self.most_s * self.rate_hz) if self.most_s < math.inf else 0)
            self._play(due - self.taken)

    def _play(self, count: int) -> None:
        """Play at most a second at a time, so that memory stays small however late the call."""
        while self._fill is not None and count > 0:
            part = min(count, int(self.rate_hz))
            self.heard(self._fill(part))
            self.taken, count = self.taken + part, count - part

    def cut(self) -> None:
        """Play the samples that are due by now; a twin has no buffer."""
        self.advance()

    def drain(self, silent: threading.Event) -> None:
        """Play the end of the ramp at once."""
        if self._fill is not None and not silent.is_set():
            with self._lock:
                self._play(int(DRAIN_S * self.rate_hz))

    def stop(self) -> None:
        """Stop playing."""
        self._fill = None

    def fault(self) -> DeviceFault | None:
        """Return None after playing what is due, as a twin fails only if it is unplugged."""
        self.advance()
        return self.broken

    def facts(self) -> Mapping[str, str]:
        """Return a description for people."""
        return {"output": "twin", "rate": f"{self.rate_hz:g} Hz"}
