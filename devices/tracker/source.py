"""What every way to a tracker's samples has in common."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from threading import Event
from typing import TYPE_CHECKING, Protocol

from palpate.devices.signals import NowNs
from palpate.protocols.events import NS

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

Elapsed = Callable[[], float]
"""Seconds since sampling was started."""
Row = tuple[float, float, float, bool]
"""Where the marker is said to be in mm, and whether the tracker itself says that it saw it."""


@dataclass(frozen=True)
class Batch:
    """Samples as they came in, with the times that they were taken at in seconds of the source's clock.

    `reset` says that this clock was set anew since the batch before; `away` is then how many samples are missing.
    """

    times_s: Sequence[float] = ()
    rows: Sequence[Row] = ()
    reset: bool = False
    away: int = 0


@dataclass(frozen=True)
class Opened:
    """What opening a source found out: the rate that it declares (0: none) and facts to show."""

    declared_hz: float = 0.0
    facts: Mapping[str, str] = field(default_factory=dict)


class Source(Protocol):
    """A way to samples. One thread pulls, another may start and stop."""

    clock: str

    def open(self) -> Opened:
        """Get hold of it. Raises DeviceError."""

    def expect(self, scene: Scene | None) -> None:
        """What is tracked next; only a twin minds."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin: samples that were taken before are not given. Raises DeviceError."""

    def zero_s(self, now_ns: NowNs) -> float:
        """Where the source's clock stood when now_ns's was at 0; 0 for a clock that is not this computer's."""

    def pull(self, timeout_s: float) -> Batch:
        """What came since the last pull; waits at most that long. Raises DeviceFault."""

    def stop(self) -> None:
        """End; also where it has not begun."""

    def close(self) -> None:
        """Let go of it."""


def awaited(found: Callable[[], Batch], stopped: Event, timeout_s: float, step_s: float) -> Batch:
    """The first batch that holds something, looked for every `step_s`; an empty one after the timeout, or stopped."""
    end_s = time.monotonic() + timeout_s
    while not (batch := found()).rows:
        left_s = end_s - time.monotonic()
        if left_s <= 0 or stopped.wait(min(left_s, step_s)):
            break
    return batch


def since(now_ns: NowNs) -> Elapsed:
    """Seconds of that clock from now on."""
    begun = now_ns()
    return lambda: (now_ns() - begun) / NS
