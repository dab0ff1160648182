"""The clock that a loop is paced by."""

from __future__ import annotations

import time
from typing import Protocol


class Pace(Protocol):
    """A clock that can be waited for."""

    def now_ns(self) -> int:
        """Nanoseconds; never runs backwards."""

    def until(self, at_ns: int) -> None:
        """Wait until then; not at all where that is past."""


class Wall:
    """The machine's monotonic clock, slept on to the end.

    A sleep ends some tens of microseconds late, which the buffer bears; whoever waits awake uses up the share of the
    processor that the next step needs where others want it too.
    """

    def now_ns(self) -> int:
        """Nanoseconds."""
        return time.monotonic_ns()

    def until(self, at_ns: int) -> None:
        """Wait until then."""
        while (left_ns := at_ns - time.monotonic_ns()) > 0:
            time.sleep(left_ns * 1e-9)  # an absolute clock_nanosleep on Linux; elsewhere it may end early


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
