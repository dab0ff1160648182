"""Estimate a device's clock from arrivals: blocks come late by an unknown, changing delay, and never early.

So the line under all arrivals is the clock, except for the least delay, which no arrival can show: it is part of the
line's offset, the same for every sample, and has to be known from elsewhere (a calibration of the transport).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from palpate.protocols.undefined import finite_or_none

TOLERANCE_PPM = 100.0
"""Greatest deviation of a crystal from its nominal rate; a rate with a greater standard error is not used."""
BURST_S, FASTEST = 0.25, 3.0
"""Samples that all came within this time, and over so many times as fast as nominal, were held back: one burst."""
SPACINGS, SPACINGS_OF = 8, 3
"""Number of the smallest delays of each half over which their spacing is averaged, to estimate how far the least one is
above 0. Of few arrivals a third of them is used, at least three: the larger delays lie further apart.
"""
SURER = 1.5
"""Factor between that spacing and the reported errors: the slope's real error was up to 1.5 times it (docs/how-to)."""
WINDOWS = 8
"""Stretches whose least delays are compared: where they differ, the clock is not linear."""

Point = tuple[float, float]


class ClockError(ValueError):
    """Arrivals that no clock can be fitted to."""


@dataclass(frozen=True)
class Clock:
    """A linear clock: sample n was taken at t0_s + n / rate_hz, in seconds of the host's clock.

    `drift_ppm` is how much faster the device's clock runs than its nominal rate, `drift_error_ppm` its standard error,
    None where the arrivals do not determine it. `measured` is False where the nominal rate was kept because it is more
    certain. `offset_error_s` is the standard error of the line at its middle, without the least delay. `delay_s` and
    `jitter_s` are the median and the 95th percentile of the arrivals' delays over the least. `wander_s` is how far the
    least delay of an eighth of the recording lies above the line, at most: about `offset_error_s` where the clock runs
    evenly.
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
        """Return how much faster than nominal the samples come, in parts per million."""
        return (self.rate_hz / self.nominal_hz - 1.0) * 1e6

    def time_s(self, number: float) -> float:
        """Return when sample `number` was taken."""
        return self.t0_s + number / self.rate_hz


def nominal_clock(rate_hz: float, first: int, t_s: float) -> Clock:
    """Return the clock of a stream without arrivals: sample `first` at t_s, at the declared rate.

    Raises ClockError.
    """
    _demand_rate(rate_hz)
    if not math.isfinite(t_s):
        raise ClockError(f"the time of sample {first} is {t_s}: a finite number of seconds is needed")
    return Clock(t_s - first / rate_hz, rate_hz, rate_hz, measured=False)


def fit_clock(arrivals: Sequence[Point], rate_hz: float) -> Clock:
    """Fit the closest line under all arrivals (n, t_s): sample n, the last of its block, had arrived at t_s.

    Of all lines that no arrival lies below, it is the line with the least sum of delays: the edge of the lower convex
    hull at the mean sample number. It is exact where two arrivals, one in each half, had the least delay.

    Raises:
        ClockError: no arrivals, a number or time that is not finite, numbers that do not rise, times that fall,
            a rate that is not positive, or arrivals in one burst (`BURST_S`, `FASTEST`).
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
    samples, took_s = arrivals[-1][0] - n0, arrivals[-1][1] - t0
    if 1.0 / rate_hz + slope <= (1.0 / (FASTEST * rate_hz) if took_s <= BURST_S else 0.0):
        raise ClockError(
            f"{len(points)} arrivals, most of them at one moment: {samples:g} samples came within {took_s:.3g} s, not "
            f"{samples / rate_hz:.3g} s as at {rate_hz:g} Hz; a burst does not tell how fast samples come"
        )
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
    """Return the clock with its offset at sample 0 instead of the first arrival's sample `n0`."""
    return replace(clock, t0_s=clock.t0_s - n0 / clock.rate_hz)


def _demand_rate(rate_hz: float) -> None:
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise ClockError(f"the nominal rate is {rate_hz} Hz: a positive number is needed")


def _line_under(points: Sequence[Point]) -> tuple[float, float]:
    """Return offset and slope of the edge of the lower hull at the mean of n."""
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
    """Return whether `last` lies on or above the line from `before` to `new`."""
    return (last[1] - before[1]) * (new[0] - before[0]) >= (new[1] - before[1]) * (last[0] - before[0])


def _errors(points: Sequence[Point], offset: float, slope: float) -> tuple[float, float]:
    """Return the standard errors of the slope (seconds per sample) and of the line at its middle (seconds).

    The least of m delays lies above the least possible delay by about the spacing of the smallest delays, whatever
    their distribution, if its density does not vanish at the lower end (order statistics of a uniform density).
    """
    half = max(1, len(points) // 2)
    parts = points[:half], points[half:]
    late = [_spacing([t - offset - slope * n for n, t in part]) for part in parts]
    centres = [math.fsum(n for n, _ in part) / len(part) for part in parts]
    apart = centres[1] - centres[0]
    return SURER * math.hypot(*late) / apart, SURER * (math.hypot(*late) + sum(late)) / 2.0


def _spacing(delays: Sequence[float]) -> float:
    """Return about how far the least observed delay is above the least possible one; infinite for a single delay."""
    ordered = sorted(delays)[: 1 + max(SPACINGS_OF, min(SPACINGS, len(delays) // SPACINGS_OF))]
    return (ordered[-1] - ordered[0]) / (len(ordered) - 1) if len(ordered) > 1 else math.inf


def _wander(points: Sequence[Point], delays: Sequence[float]) -> float | None:
    """Return the largest of the least delays of equal stretches of the recording; None for too few arrivals."""
    if len(points) < 4 * WINDOWS:
        return None
    span = (points[-1][0] - points[0][0]) or 1.0
    least = [math.inf] * WINDOWS
    for (n, _), delay in zip(points, delays, strict=True):
        window = min(WINDOWS - 1, int(WINDOWS * (n - points[0][0]) / span))
        least[window] = min(least[window], delay)
    return max(value for value in least if math.isfinite(value))
