"""Sources of a tablet's or tracker's samples: their interface, and the clock that they are started with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event
from typing import TYPE_CHECKING, Protocol, TypeVar

from palpate.devices.device import NowNs
from palpate.protocols.events import NS

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

Elapsed = Callable[[], float]
"""Seconds since sampling started."""
Opened_co = TypeVar("Opened_co", covariant=True)
Batch_co = TypeVar("Batch_co", covariant=True)


class Source(Protocol[Opened_co, Batch_co]):
    """A source of samples. One thread pulls, another may start and stop."""

    def open(self) -> Opened_co:
        """Connect, and return facts about the source. Raises DeviceError."""

    def expect(self, scene: Scene | None) -> None:
        """Set the scene that is sensed from the next start on; only a twin uses it."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin to sample; earlier samples are dropped. Raises DeviceError."""

    def pull(self, timeout_s: float) -> Batch_co:
        """Return the samples since the last pull, waiting at most `timeout_s` for some. Raises DeviceFault."""

    def stop(self) -> None:
        """Stop sampling, also if it has not started."""

    def close(self) -> None:
        """Disconnect."""


@dataclass(kw_only=True)
class TimedSource:
    """The base of twins and recordings, which give each sample once its time since the start has passed."""

    elapsed_s: Elapsed | None = None
    stopped: Event = field(default_factory=Event)

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin with the first sample."""
        self.elapsed_s = elapsed_s
        self.stopped.clear()

    def stop(self) -> None:
        """Stop giving samples."""
        self.elapsed_s = None
        self.stopped.set()

    def close(self) -> None:
        """Stop."""
        self.stop()


def since(now_ns: NowNs) -> Elapsed:
    """Return a function that gives the seconds of that clock from now on."""
    start_ns = now_ns()
    return lambda: (now_ns() - start_ns) / NS
