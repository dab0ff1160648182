"""Where a tablet's or a tracker's samples come from: what every source can do, and the clock it is started with."""

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
"""Seconds since sampling was started."""
Opened_co = TypeVar("Opened_co", covariant=True)
Batch_co = TypeVar("Batch_co", covariant=True)


class Source(Protocol[Opened_co, Batch_co]):
    """A way to samples. One thread pulls, another may start and stop."""

    def open(self) -> Opened_co:
        """Connect, and return what is known of the source. Raises DeviceError."""

    def expect(self, scene: Scene | None) -> None:
        """Take the scene that is sensed from the next start on; only a twin uses it."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin to sample; earlier samples are not given. Raises DeviceError."""

    def pull(self, timeout_s: float) -> Batch_co:
        """Return what came since the last pull, waiting at most that long. Raises DeviceFault."""

    def stop(self) -> None:
        """End sampling; also where it has not started."""

    def close(self) -> None:
        """Disconnect."""


@dataclass(kw_only=True)
class TimedSource:
    """The part of a twin or a recording that gives each sample once its time has passed since the start."""

    elapsed_s: Elapsed | None = None
    stopped: Event = field(default_factory=Event)

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin with the first sample."""
        self.elapsed_s = elapsed_s
        self.stopped.clear()

    def stop(self) -> None:
        """Give no more samples."""
        self.elapsed_s = None
        self.stopped.set()

    def close(self) -> None:
        """Stop."""
        self.stop()


def since(now_ns: NowNs) -> Elapsed:
    """Return a function that gives the seconds of that clock from now on."""
    start_ns = now_ns()
    return lambda: (now_ns() - start_ns) / NS
