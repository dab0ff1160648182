"""How a device's clock runs against the host's, from when its samples arrived: late at times, never early.

The earliest arrivals lie along a line, all others above it. Memory is bounded however long it runs: the device's time
is cut into at most 32 bins, each keeping its earliest arrival; where they are used up, every two become one. A line
through these, weighted by how many arrivals each bin chose from, gives the rate; what they scatter about it, and how
coarsely arrivals are noticed, gives its standard error. (The lower envelope as in Moon, Skelly and Towsley 1999,
Estimation and removal of clock skew from network delay measurements; bins instead of its hull, because their scatter
says how far to trust the result, and because a hull of all arrivals grows with them.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median

from protocols.events import NS

BINS = 32
"""So many are merged into half as many; 16 to 31 serve the fit of a recording that is not very short."""
FIRST_BIN_S = 0.25
FEWEST = 5
"""Bins below which nothing is said: three degrees of freedom for an error."""
LATE = 5.0
"""A bin whose earliest arrival lies so many robust deviations above the line was late throughout: it is left out."""
SAME_S = 2e-9
PPM = 1e6


@dataclass(frozen=True)
class Fit:
    """A device's clock against the host's.

    `pace` is the device's seconds per host's second, `ppm` what that is off 1 (above 0: the device runs fast), `se_ppm`
    the standard error of both in parts per million; the device's clock stood at 0 when the host's was at `zero_ns`.
    """

    pace: float
    ppm: float
    se_ppm: float
    zero_ns: float


@dataclass
class _Bin:
    device_s: float
    late_s: float
    count: int = 1


@dataclass
class ClockFit:
    """Takes arrivals one by one, in bounded memory; one thread only."""

    width_s: float = FIRST_BIN_S
    origin: tuple[float, int] | None = None
    slope: float = 1.0
    bins: dict[int, _Bin] = field(default_factory=dict)
    late_s: float | None = None
    tick_s: float = math.inf

    def add(self, device_s: float, t_ns: int) -> None:
        """The device's clock stood at device_s when the host's stood at t_ns or somewhat earlier."""
        if self.origin is None:
            self.origin = (device_s, t_ns)
        x, t = device_s - self.origin[0], (t_ns - self.origin[1]) / NS
        if not (math.isfinite(x) and x >= 0):
            return
        self._tick(t - x)
        while x >= BINS * self.width_s:
            self._halve()
        self._keep(int(x / self.width_s), _Bin(x, t))

    def fit(self) -> Fit | None:
        """What the arrivals say so far; None where they are too few, where time stood still, where none was late.

        Arrivals that all came on the nominal dot were noticed in steps too coarse to see the clock, or never timed.
        """
        line = _line(list(self.bins.values()))
        if line is None or self.origin is None or line.slope <= 0 or math.isinf(self.tick_s):
            return None
        pace = 1 / line.slope
        span_s = max(each.device_s for each in self.bins.values())
        coarse = self.tick_s / 2 / span_s
        zero_ns = self.origin[1] + (line.at_zero - line.slope * self.origin[0]) * NS
        return Fit(pace, (pace - 1) * PPM, math.hypot(line.error, coarse) * pace * pace * PPM, zero_ns)

    def _tick(self, late_s: float) -> None:
        """Learn in how coarse steps arrivals are noticed: one that is polled for tells no more than that."""
        step = math.inf if self.late_s is None else abs(late_s - self.late_s)
        self.late_s = late_s
        if SAME_S < step < self.tick_s:
            self.tick_s = step

    def _keep(self, place: int, new: _Bin) -> None:
        old = self.bins.get(place)
        if old is None:
            self._learn()
            self.bins[place] = new
            return
        self.bins[place] = self._earlier(old, new)

    def _earlier(self, one: _Bin, other: _Bin) -> _Bin:
        """The one that lies lower, as the clock is known to run so far."""
        lower = min(one, other, key=lambda each: each.late_s - self.slope * each.device_s)
        return _Bin(lower.device_s, lower.late_s, one.count + other.count)

    def _learn(self) -> None:
        line = _line(list(self.bins.values()))
        if line is not None and line.slope > 0:
            self.slope = line.slope

    def _halve(self) -> None:
        self._learn()
        merged: dict[int, _Bin] = {}
        for place, each in self.bins.items():
            half = place // 2
            merged[half] = self._earlier(merged[half], each) if half in merged else each
        self.bins, self.width_s = merged, 2 * self.width_s


@dataclass(frozen=True)
class _Line:
    at_zero: float
    slope: float
    error: float


def _line(points: Sequence[_Bin]) -> _Line | None:
    """A weighted line through the earliest arrivals, those that were late throughout left out, one at a time."""
    left = list(points)
    while len(left) >= FEWEST:
        line = _weighted(left)
        if line is None:
            return None
        off = [each.late_s - line.at_zero - line.slope * each.device_s for each in left]
        middle = median(off)
        scale = 1.4826 * median(abs(each - middle) for each in off)
        worst = max(range(len(left)), key=lambda place: off[place])
        if off[worst] - middle <= max(LATE * scale, 1e-9) or len(left) == FEWEST:
            return line
        del left[worst]
    return None


def _weighted(points: Sequence[_Bin]) -> _Line | None:
    """Least squares; the earliest of k arrivals scatters as 1 / k where delays are exponential."""
    weights = [float(each.count**2) for each in points]
    total = math.fsum(weights)
    x0 = math.fsum(w * p.device_s for w, p in zip(weights, points, strict=True)) / total
    t0 = math.fsum(w * p.late_s for w, p in zip(weights, points, strict=True)) / total
    sxx = math.fsum(w * (p.device_s - x0) ** 2 for w, p in zip(weights, points, strict=True))
    if sxx <= 0:
        return None
    sxt = math.fsum(w * (p.device_s - x0) * (p.late_s - t0) for w, p in zip(weights, points, strict=True))
    slope = sxt / sxx
    off = (w * (p.late_s - t0 - slope * (p.device_s - x0)) ** 2 for w, p in zip(weights, points, strict=True))
    return _Line(t0 - slope * x0, slope, math.sqrt(math.fsum(off) / (len(points) - 2) / sxx))
