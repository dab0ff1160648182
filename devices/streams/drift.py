"""The drift of a device's clock against the host's, from arrivals of its samples: late at times, never early.

The earliest arrivals lie along a line, all others above it. Memory is bounded for any duration: the device's time is
divided into at most 32 bins, each with its earliest arrival; when they are used up, every two become one. The closest
line under these is the clock, by the same fit as in the analysis of the recorded arrivals (palpate.protocols.clocks).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from palpate.protocols.clocks import Clock, ClockError, Point, fit_clock
from palpate.protocols.events import NS

BINS = 32
"""Number of bins at which they are merged into half as many; 17 to 32 are enough for the fit unless a recording is very
short.
"""
FIRST_BIN_S = 0.25
FEWEST = 5
"""Least number of bins for a fit."""
SAME_S = 2e-9
PPM = 1e6


@dataclass(frozen=True)
class Fit:
    """The clock of a device relative to the host's.

    `pace` is the device's seconds per host's second, `ppm` its deviation from 1 (above 0: the device runs fast),
    `se_ppm` the standard error of both in parts per million.
    """

    pace: float
    ppm: float
    se_ppm: float


@dataclass
class ClockFit:
    """A fit of arrivals, added one by one in bounded memory; for one thread only.

    A bin is (device's, host's) seconds of one.
    """

    width_s: float = FIRST_BIN_S
    origin: tuple[float, int] | None = None
    slope: float = 1.0
    bins: dict[int, Point] = field(default_factory=dict)
    late_s: float | None = None
    tick_s: float = math.inf

    def add(self, device_s: float, t_ns: int) -> None:
        """Add an arrival: the device's clock read device_s when the host's read t_ns, or slightly earlier."""
        if self.origin is None:
            self.origin = (device_s, t_ns)
        x, t = device_s - self.origin[0], (t_ns - self.origin[1]) / NS
        if not (math.isfinite(x) and x >= 0):
            return
        # Learn in how coarse steps arrivals are noticed: one that is polled for tells no more than that.
        late_s = t - x
        step = math.inf if self.late_s is None else abs(late_s - self.late_s)
        self.late_s = late_s
        if SAME_S < step < self.tick_s:
            self.tick_s = step
        while x >= BINS * self.width_s:
            self._learn()
            merged: dict[int, Point] = {}
            for place, earliest in self.bins.items():
                half = place // 2
                merged[half] = min(merged[half], earliest, key=self._lateness) if half in merged else earliest
            self.bins, self.width_s = merged, 2 * self.width_s
        self._keep(int(x / self.width_s), (x, t))

    def fit(self) -> Fit | None:
        """Return the fit to the arrivals so far; None if they are too few, time did not pass, or none was late.

        Arrivals that all came exactly at nominal times were timed too coarsely to see the clock, or not at all.
        """
        clock = self._clock()
        if clock is None or clock.drift_error_ppm is None or math.isinf(self.tick_s):
            return None
        coarse_ppm = self.tick_s / 2 / max(x for x, _ in self.bins.values()) * PPM
        return Fit(clock.rate_hz, clock.drift_ppm, math.hypot(clock.drift_error_ppm, coarse_ppm * clock.rate_hz**2))

    def _clock(self) -> Clock | None:
        """Return the line under the earliest arrivals; None if their rate cannot be estimated."""
        if len(self.bins) < FEWEST:
            return None
        try:
            clock = fit_clock([self.bins[place] for place in sorted(self.bins)], 1.0)
        except ClockError:
            return None
        return clock if clock.measured and clock.rate_hz > 0 else None

    def _keep(self, place: int, new: Point) -> None:
        if place in self.bins:
            self.bins[place] = min(self.bins[place], new, key=self._lateness)
            return
        self._learn()
        self.bins[place] = new

    def _lateness(self, point: Point) -> float:
        """Return how late an arrival is, by the clock's rate estimated so far."""
        return point[1] - self.slope * point[0]

    def _learn(self) -> None:
        clock = self._clock()
        if clock is not None:
            self.slope = 1 / clock.rate_hz
