"""The clock that a loop is paced by."""

from __future__ import annotations

import time
from typing import Protocol

SPIN_NS = 60_000
"""The last part of a wait is not slept: a sleep ends some tens of microseconds late."""


class Pace(Protocol):
    """A clock that can be waited for."""

    def now_ns(self) -> int:
        """Nanoseconds; never runs backwards."""

    def until(self, at_ns: int) -> None:
        """Wait until then; not at all where that is past."""


class Wall:
    """The machine's monotonic clock: slept until shortly before, then looked at until it is time."""

    def now_ns(self) -> int:
        """Nanoseconds."""
        return time.monotonic_ns()

    def until(self, at_ns: int) -> None:
        """Wait until then."""
        left_ns = at_ns - time.monotonic_ns()
        if left_ns > SPIN_NS:
            time.sleep((left_ns - SPIN_NS) * 1e-9)  # an absolute clock_nanosleep on Linux
        while time.monotonic_ns() < at_ns:
            pass


class AtOnce:
    """As fast as it goes: a clock that is always on time."""

    def __init__(self) -> None:
        self._now_ns = 0

    def now_ns(self) -> int:
        """When was last waited for."""
        return self._now_ns

    def until(self, at_ns: int) -> None:
        """It is then."""
        self._now_ns = max(self._now_ns, at_ns)
