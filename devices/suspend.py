"""Detect that the computer was suspended, by a clock that goes on meanwhile and another that stops.

Session time stops while a computer is suspended (Linux, macOS), so nothing else would show it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from palpate.protocols.events import NS

_CLOCKS = (("CLOCK_BOOTTIME", "CLOCK_MONOTONIC"), ("CLOCK_MONOTONIC", "CLOCK_UPTIME_RAW"))
"""On Linux and on macOS: the clock that goes on, and the clock that stops."""
LEAST_NS = NS // 10
"""Least difference that counts: the clocks are read one after the other, which a busy computer may interrupt."""


def suspended_ns() -> int:
    """Return how long this computer was suspended since it was started; 0 if no clock shows it (Windows)."""
    for goes_on, stops in _CLOCKS:
        if hasattr(time, goes_on) and hasattr(time, stops):
            return time.clock_gettime_ns(getattr(time, goes_on)) - time.clock_gettime_ns(getattr(time, stops))
    return 0


@dataclass
class SuspendWatch:
    """A detector of a suspension of the computer since the last call."""

    count_ns: Callable[[], int] = suspended_ns
    seen_ns: int = field(init=False)

    def __post_init__(self) -> None:
        self.seen_ns = self.count_ns()

    def message(self) -> str | None:
        """Return a message if the computer was suspended since the last call, else None."""
        slept_ns = self.count_ns() - self.seen_ns
        if slept_ns < LEAST_NS:
            return None
        self.seen_ns += slept_ns
        return f"the computer was suspended for {slept_ns / NS:.1f} s"
