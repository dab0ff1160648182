"""The 1 kHz loop: hand, voice, actuator, the clock that paces it, and whether it met every deadline."""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from palpate.devices.render.hands import Hand
from palpate.devices.render.sinks import Sink

NS_US = 1000
LATE_US = 1000.0
"""A step that is ready after the next one is due would have been missed without a buffer."""
EDGES_US = tuple(float(round(2 ** (place / 4), 3)) for place in range(2 * 4, 18 * 4 + 1))
"""Upper edges of the histogram's cells, from 4 us to 0.26 s in quarters of an octave; a last cell has no edge."""
STEP_NS = 1_000_000
NEVER = 2**62
"""A number of milliseconds that is never reached."""


class Pace(Protocol):
    """A clock with a function that waits."""

    def now_ns(self) -> int:
        """Return the time in nanoseconds; it never decreases."""

    def until(self, at_ns: int) -> None:
        """Wait until a time; not at all if it has passed."""


class Wall:
    """The machine's monotonic clock, with waiting by sleep only.

    A sleep ends some tens of microseconds late, which the buffer covers; busy waiting would use up processor time that
    the next step needs if other processes want it too.
    """

    def now_ns(self) -> int:
        """Return the time in nanoseconds."""
        return time.monotonic_ns()

    def until(self, at_ns: int) -> None:
        """Wait until then."""
        while (left_ns := at_ns - time.monotonic_ns()) > 0:
            time.sleep(left_ns * 1e-9)  # an absolute clock_nanosleep on Linux; elsewhere it may end early


class AtOnce:
    """A clock that never waits and is always on time."""

    def __init__(self) -> None:
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the latest time that was waited for."""
        return self._now_ns

    def until(self, at_ns: int) -> None:
        """Set the time without waiting."""
        self._now_ns = max(self._now_ns, at_ns)


@dataclass
class Deadlines:
    """Counts of steps and of late ones, the worst delay, and a histogram, of times in ns after a step was due.

    `skipped` are the late steps that were computed together with others, because a later one was due by then.
    """

    steps: int = 0
    late: int = 0
    skipped: int = 0
    worst_us: float = 0.0
    cells: list[int] = field(default_factory=lambda: [0] * (len(EDGES_US) + 1))

    def note(self, took_ns: int) -> None:
        """Count a step that was ready `took_ns` after it was due."""
        us = took_ns / NS_US
        self.steps += 1
        self.cells[bisect_left(EDGES_US, us)] += 1
        if us > LATE_US:
            self.late += 1
        self.worst_us = max(self.worst_us, us)

    def skip(self, took_ns: int) -> None:
        """Count a step that was due during a stall and was computed afterwards, together with others."""
        self.skipped += 1
        self.note(took_ns)

    @property
    def late_share(self) -> float:
        """Return the share of late steps among all steps."""
        return self.late / self.steps if self.steps else 0.0

    def quantile_us(self, share: float) -> float:
        """Return the upper edge of the cell that holds this quantile, in us: at most 19 % too much."""
        target, seen = share * self.steps, 0
        for count, edge in zip(self.cells, EDGES_US, strict=False):
            seen += count
            if seen >= target and seen:
                return min(edge, self.worst_us)
        return self.worst_us

    def record(self) -> Mapping[str, Any]:
        """Return the statistics as JSON data."""
        cells = {f"{edge:g}": count for edge, count in zip((*EDGES_US, -1.0), self.cells, strict=True) if count}
        return {
            "steps": self.steps, "late": self.late, "late_share": self.late_share, "skipped": self.skipped,
            "median_us": round(self.quantile_us(0.5), 1), "p99_us": round(self.quantile_us(0.99), 1),
            "p999_us": round(self.quantile_us(0.999), 1), "worst_us": round(self.worst_us, 1), "cells_us": cells,
        }  # fmt: skip


class Steps(Protocol):
    """A source of samples: a renderer, or a voice."""

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2."""


class Watches(Protocol):
    """A listener that gets every sample."""

    def note(self, acceleration_m_s2: float, speed_mm_s: float, force_N: float) -> None:
        """Take a sample, with the speed and force that it was made for."""


class Nobody:
    """A listener that does nothing."""

    def note(self, acceleration_m_s2: float, speed_mm_s: float, force_N: float) -> None:
        """Do nothing."""


@dataclass
class Loop:
    """A loop whose turn each millisecond fills the sink's room.

    After a stall one turn computes all that was missed, and writes each sample as soon as it is made, so that the first
    ones are played if the turn itself is delayed. `ready` counts from when a step was due to when it was written,
    `woken` to when its turn began.
    """

    render: Steps
    hand: Hand
    sink: Sink
    pace: Pace
    watch: Watches = field(default_factory=Nobody)
    ready: Deadlines = field(default_factory=Deadlines)
    woken: Deadlines = field(default_factory=Deadlines)
    made: int = 0
    _due_ns: int = 0

    def begin(self) -> None:
        """Fill the sink; the first step is due in a millisecond."""
        self.sink.write([self._next() for _ in range(self.sink.free())])
        self._due_ns = self.pace.now_ns() + STEP_NS

    def turn(self) -> None:
        """Wait for the next step and compute it, with all others that are due by then."""
        pace, due_ns = self.pace, self._due_ns
        pace.until(due_ns)
        woken_ns = pace.now_ns()
        for _ in range(self.sink.free()):
            self.sink.write((self._next(),))
        now_ns = pace.now_ns()
        self.woken.note(woken_ns - due_ns)
        self.ready.note(now_ns - due_ns)
        due_ns += STEP_NS
        while due_ns + STEP_NS <= now_ns:
            # Its successor is due as well: this one has been made up for.
            self.woken.skip(woken_ns - due_ns if woken_ns > due_ns else 0)
            self.ready.skip(now_ns - due_ns)
            due_ns += STEP_NS
        self._due_ns = due_ns

    def run(self, steps: int, ended: Callable[[], bool] = lambda: False) -> None:
        """Run for so many milliseconds, or until `ended`."""
        self.begin()
        while self.ready.steps < steps and not ended():
            self.turn()

    def _next(self) -> float:
        speed, force = self.hand.at(self.made)
        sample = self.render.step(speed, force)
        self.watch.note(sample, speed, force)
        self.made += 1
        return sample
