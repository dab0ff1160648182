"""A device's clock seen through arrivals: blocks come late by an unknown, changing delay, and never early.

So the line under all arrivals is the clock, but for the least delay, which no arrival can show: it is part of the
line's offset, the same for every sample, and has to be known from elsewhere (a calibration of the transport).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from palpate.protocols.undefined import finite_or_none

TOLERANCE_PPM = 100.0
"""What a crystal may be off its nominal rate. A rate that is measured less surely than this is not taken."""
SPACINGS, SPACINGS_OF = 8, 3
"""Over so many of the smallest delays of each half their spacing is averaged: how far the least one is from 0. Of few
arrivals it is over a third of them, no less than three: the larger ones lie further apart."""
SURER = 1.5
"""Errors are told so much larger than that spacing: the slope's real error was up to 1.5 of it (docs/how-to)."""
WINDOWS = 8
"""Stretches in which the least delay is looked at: where it strays, the clock is no line."""

Point = tuple[float, float]


class ClockError(ValueError):
    """Arrivals that no clock can be fitted to."""


@dataclass(frozen=True)
class Clock:
    """Sample n was taken at t0_s + n / rate_hz, in seconds of the host's clock.

    `drift_ppm` is how much faster the device's clock runs than its nominal rate says; +- `drift_error_ppm` (standard
    error) as the arrivals tell it, None where they tell nothing. `measured` is False where the nominal rate was kept
    because it is surer. `offset_error_s` is the standard error of the line at its middle, without the least delay.
    `delay_s` and `jitter_s` are the median and the 95th percentile of the arrivals' delays over the least.
    `wander_s` is the most that the least delay of an eighth of the recording lies above the line: of the size of
    `offset_error_s` where the clock runs evenly.
    """

    t0_s: float
    rate_hz: float
    nominal_hz: float
    measured: bool
    drift_error_ppm: float | None = None
    offset_error_s: float | None = None
    delay_s: float | None = None
    jitter_s: float | None = None
    wander_s: float | None = None
    arrivals: int = 0

    @property
    def drift_ppm(self) -> float:
        """How much faster than nominal the samples come, in millionths."""
        return (self.rate_hz / self.nominal_hz - 1.0) * 1e6

    def time_s(self, number: float) -> float:
        """When sample `number` was taken."""
        return self.t0_s + number / self.rate_hz


def nominal_clock(rate_hz: float, first: int, t_s: float) -> Clock:
    """The clock of a stream without arrivals: sample `first` at t_s, the rate as declared. Raises ClockError."""
    _demand_rate(rate_hz)
    if not math.isfinite(t_s):
        raise ClockError(f"the time of sample {first} is {t_s}: a finite number of seconds is needed")
    return Clock(t_s - first / rate_hz, rate_hz, rate_hz, measured=False)


def fit_clock(arrivals: Sequence[Point], rate_hz: float) -> Clock:
    """The line closest under all arrivals (n, t_s): sample n, the last of its block, was there at t_s.

    Among all lines that no arrival lies below, the one with the least sum of delays: the edge of the lower convex
    hull at the mean sample number. It is exact where two arrivals, one in each half, had the least delay.

    Raises:
        ClockError: no arrivals, a number or time that is not finite, numbers that do not rise, times that fall,
            a rate that is not positive, or arrivals that came at one moment.
    """
    _demand_rate(rate_hz)
    if not arrivals:
        raise ClockError("no arrivals: nothing tells when the samples came")
    for place, (n, t) in enumerate(arrivals):
        if not (math.isfinite(n) and math.isfinite(t)):
            raise ClockError(f"arrival {place + 1} is sample {n} at {t} s: finite numbers are needed")
        if place and n <= arrivals[place - 1][0]:
            raise ClockError(
                f"arrival {place + 1} is sample {n}, after sample {arrivals[place - 1][0]}: they must rise"
            )
        if place and t < arrivals[place - 1][1]:
            raise ClockError(
                f"arrival {place + 1} came at {t} s, before the one before it ({arrivals[place - 1][1]} s)"
            )
    n0, t0 = arrivals[0]
    points = [(float(n - n0), (t - t0) - (n - n0) / rate_hz) for n, t in arrivals]  # the drift alone: no digits lost
    if len(points) < 2:
        return _placed(Clock(t0, rate_hz, rate_hz, measured=False, arrivals=1), n0)
    offset, slope = _line_under(points)
    if 1.0 / rate_hz + slope <= 0.0:
        raise ClockError(f"{len(points)} arrivals, most of them at one moment: they do not tell how fast samples come")
    error_n, error_s = _errors(points, offset, slope)
    drift_error_ppm = error_n * rate_hz * 1e6
    measured = drift_error_ppm <= TOLERANCE_PPM or abs(slope * rate_hz) * 1e6 > TOLERANCE_PPM + 3.0 * drift_error_ppm
    if not measured:
        offset, slope = min(t for _, t in points), 0.0
        error_s = SURER * _spacing([t - offset for _, t in points])
    delays = [t - offset - slope * n for n, t in points]
    ordered = sorted(delays)
    clock = Clock(
        t0 + offset, 1.0 / (1.0 / rate_hz + slope), rate_hz, measured,
        finite_or_none(drift_error_ppm), finite_or_none(error_s),
        ordered[len(ordered) // 2], ordered[len(ordered) * 95 // 100], _wander(points, delays), len(points),
    )  # fmt: skip
    return _placed(clock, n0)


def _placed(clock: Clock, n0: float) -> Clock:
    """The clock with its offset at sample 0 rather than at the first arrival's."""
    return replace(clock, t0_s=clock.t0_s - n0 / clock.rate_hz)


def _demand_rate(rate_hz: float) -> None:
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise ClockError(f"the nominal rate is {rate_hz} Hz: a positive number is needed")


def _line_under(points: Sequence[Point]) -> tuple[float, float]:
    """Offset and slope of the edge of the lower hull at the mean of n."""
    hull: list[Point] = []
    for point in points:
        while len(hull) > 1 and _turns_down(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    middle = math.fsum(n for n, _ in points) / len(points)
    right = next(place for place, (n, _) in enumerate(hull) if n >= middle and place)
    (n1, t1), (n2, t2) = hull[right - 1], hull[right]
    slope = (t2 - t1) / (n2 - n1)
    return t1 - slope * n1, slope


def _turns_down(before: Point, last: Point, new: Point) -> bool:
    """Whether `last` lies on or above the line from `before` to `new`."""
    return (last[1] - before[1]) * (new[0] - before[0]) >= (new[1] - before[1]) * (last[0] - before[0])


def _errors(points: Sequence[Point], offset: float, slope: float) -> tuple[float, float]:
    """Standard errors of the slope (seconds a sample) and of the line at its middle (seconds).

    The least of m delays lies above the least possible one by about the spacing of the smallest delays, whatever
    their distribution, as long as it does not vanish at its lower end (order statistics of a uniform density).
    """
    half = max(1, len(points) // 2)
    parts = points[:half], points[half:]
    late = [_spacing([t - offset - slope * n for n, t in part]) for part in parts]
    centres = [math.fsum(n for n, _ in part) / len(part) for part in parts]
    apart = centres[1] - centres[0]
    return SURER * math.hypot(*late) / apart, SURER * (math.hypot(*late) + sum(late)) / 2.0


def _spacing(delays: Sequence[float]) -> float:
    """How far the least delay of a sample is from the least possible one, about; nothing tells where there is one."""
    ordered = sorted(delays)[: 1 + max(SPACINGS_OF, min(SPACINGS, len(delays) // SPACINGS_OF))]
    return (ordered[-1] - ordered[0]) / (len(ordered) - 1) if len(ordered) > 1 else math.inf


def _wander(points: Sequence[Point], delays: Sequence[float]) -> float | None:
    """The largest of the least delays of equal stretches of the recording; None where there are too few arrivals."""
    if len(points) < 4 * WINDOWS:
        return None
    span = (points[-1][0] - points[0][0]) or 1.0
    least = [math.inf] * WINDOWS
    for (n, _), delay in zip(points, delays, strict=True):
        window = min(WINDOWS - 1, int(WINDOWS * (n - points[0][0]) / span))
        least[window] = min(least[window], delay)
    return max(value for value in least if math.isfinite(value))
