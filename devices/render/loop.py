"""The loop at 1 kHz: hand, voice, actuator, the clock that paces it, and whether it met every millisecond."""

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
"""Upper edges of the histogram's cells, from 4 us to 0.26 s in quarters of an octave; one more cell lies beyond."""
STEP_NS = 1_000_000
NEVER = 2**62
"""Milliseconds that nobody plays to the end."""


class Pace(Protocol):
    """A clock that can be waited for."""

    def now_ns(self) -> int:
        """Return the time in nanoseconds; it never runs backwards."""

    def until(self, at_ns: int) -> None:
        """Wait until then; not at all where that is past."""


class Wall:
    """The machine's monotonic clock, slept on to the end.

    A sleep ends some tens of microseconds late, which the buffer bears; whoever waits awake uses up the share of the
    processor that the next step needs where others want it too.
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
        """Return the last time that was waited for."""
        return self._now_ns

    def until(self, at_ns: int) -> None:
        """Set the time without waiting."""
        self._now_ns = max(self._now_ns, at_ns)


@dataclass
class Deadlines:
    """Steps, how many were late, the worst, and a histogram, of times in ns from when a step was due.

    `skipped` are those among the late ones that were caught up with in one go, since a later one was due by then.
    """

    steps: int = 0
    late: int = 0
    skipped: int = 0
    worst_us: float = 0.0
    cells: list[int] = field(default_factory=lambda: [0] * (len(EDGES_US) + 1))

    def note(self, took_ns: int) -> None:
        """Count a step that was ready so long after it was due."""
        us = took_ns / NS_US
        self.steps += 1
        self.cells[bisect_left(EDGES_US, us)] += 1
        if us > LATE_US:
            self.late += 1
        self.worst_us = max(self.worst_us, us)

    def skip(self, took_ns: int) -> None:
        """Count a step that was due during a stall and was only made up for afterwards, together with others."""
        self.skipped += 1
        self.note(took_ns)

    @property
    def late_share(self) -> float:
        """The share of late steps among all steps."""
        return self.late / self.steps if self.steps else 0.0

    def quantile_us(self, share: float) -> float:
        """Return the upper edge of the cell that this share of the steps reaches: at most 19 % too much."""
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
        """Take one sample, with the speed and force that it was made for."""


class Nobody:
    """A listener that does nothing."""

    def note(self, acceleration_m_s2: float, speed_mm_s: float, force_N: float) -> None:
        """Do nothing."""


@dataclass
class Loop:
    """One turn each millisecond fills the sink's room. After a stall one turn makes up for all that was missed, a
    sample written as soon as it is made: where the turn itself is held up, what it made so far is played.

    `ready` counts from when a step was due to when it was written, `woken` to when its turn began.
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
        """Wait for the next step and do it, with all those that are due by then."""
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
        """Run so many milliseconds, or until it has ended."""
        self.begin()
        while self.ready.steps < steps and not ended():
            self.turn()

    def _next(self) -> float:
        speed, force = self.hand.at(self.made)
        sample = self.render.step(speed, force)
        self.watch.note(sample, speed, force)
        self.made += 1
        return sample
