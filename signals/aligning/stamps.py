"""Time stamps that come with the samples, compared with the arrivals: how late samples came on the host's clock.

A stamp errs to both sides, so the line goes through the middle of the stamps, not under them; stamps far off the line
are left out. Where the stamps' clock is the host's, the distance between this line and the line under the arrivals is
the delay that all arrivals share, which no arrival shows. A device's own clock gives differences only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.protocols.clocks import TOLERANCE_PPM, WINDOWS, Clock
from palpate.signals.arrays import Array

OF_THE_HOST = ("lsl",)
"""Clocks whose times the recorder put into session time (docs/reference/streams.md)."""
FEWEST = 2 * WINDOWS
FAR = 5.0
"""A stamp this many robust standard deviations off the line is left out."""
ROUNDS = 5
MOST_LATE_S = 1.0
"""Greatest plausible delay of a sensor's transport; a stamp that is older comes from another clock."""
SURE = 3.0
"""Lines that are this many standard errors apart disagree."""
COARSE_S = 1e-6
"""Finest resolution at which a clock is read or two clocks are compared."""


@dataclass(frozen=True)
class Stamps:
    """The line through a stream's own stamps, and how late its samples came against it.

    `late_s` is how far the line under the arrivals lies above the stamps' line, `late_error_s` its standard error;
    `late_median_s` and `late_p95_s` are those of the arrivals; None where the clock is not the host's. `scatter_s` is
    the stamps' SD about their line. `problem` says why the stream cannot be timed by them; None where it can.
    """

    clock: str
    count: int
    line: Clock | None = None
    scatter_s: float | None = None
    late_s: float | None = None
    late_error_s: float | None = None
    late_median_s: float | None = None
    late_p95_s: float | None = None
    problem: str | None = None

    def account(self) -> dict[str, Any]:
        """Return the description as JSON data."""
        return {
            "clock": self.clock, "of_the_host": self.clock in OF_THE_HOST, "count": self.count,
            "rate_hz": self.line.rate_hz if self.line else None, "scatter_s": self.scatter_s,
            "wander_s": self.line.wander_s if self.line else None, "late_s": self.late_s,
            "late_error_s": self.late_error_s, "late_median_s": self.late_median_s, "late_p95_s": self.late_p95_s,
            "usable": self.problem is None, "why_not": self.problem,
        }  # fmt: skip


def stamps_of(stamped: Sequence[tuple[int, float, float]], rate_hz: float, clock: str, arrived: Clock) -> Stamps:
    """Compare stamps (n, arrival in s of session time, stamp in s) of a stream with the clock `arrived` of its
    arrivals.
    """
    count = len(stamped)
    if count < FEWEST:
        return Stamps(clock, count, problem=f"{count} stamps are too few for a line: {FEWEST} are needed")
    n, came_s, stamp_s = np.array(stamped, dtype=np.float64).T
    line, scatter_s = _line_through(n, stamp_s, rate_hz)
    if line is None:
        return Stamps(clock, count, problem="its stamps are not on a line: their clock stopped, or was set meanwhile")
    if clock not in OF_THE_HOST:
        own = (
            f"its stamps are by its own clock ({clock}): only their differences mean something, and they do not "
            "say when in session time a sample was taken. Where its delay is known, --latency takes it"
        )
        return Stamps(clock, count, line, scatter_s, problem=own)
    late = came_s - (line.t0_s + n / line.rate_hz)
    ends = stamped[0][0], stamped[-1][0]
    apart = [arrived.time_s(at) - line.time_s(at) for at in ends]
    # How far the lines' offset, and their distance from end to end, may be off by what the fits allow.
    span_s = (ends[1] - ends[0]) / rate_hz
    at_middle = sum(error or 0.0 for clock in (line, arrived) for error in (clock.offset_error_s, clock.wander_s))
    paces = [clock.drift_error_ppm for clock in (line, arrived)]
    pace = math.inf if None in paces else math.hypot(*(error or 0.0 for error in paces)) * 1e-6 * span_s
    problem = _disagree(apart, (SURE * (at_middle + COARSE_S), SURE * (at_middle + pace + COARSE_S)))
    if problem is not None:
        return Stamps(clock, count, line, scatter_s, problem=problem)
    error_s = math.hypot(line.offset_error_s or 0.0, arrived.offset_error_s or 0.0)
    return Stamps(
        clock, count, line, scatter_s, sum(apart) / 2, error_s, float(np.median(late)), float(np.quantile(late, 0.95))
    )


def _disagree(apart: Sequence[float], allowed_s: tuple[float, float]) -> str | None:
    """Return why the arrivals' line is not slightly later than the stamps' throughout; None where it is."""
    middle = sum(apart) / 2
    if not -allowed_s[0] <= middle <= MOST_LATE_S:
        return (
            f"its samples came {middle:.6g} s after their stamps: between {-allowed_s[0]:.2g} and {MOST_LATE_S:g} s "
            "would be plausible, so the stamps are not by this host's clock, or their sender's clock is set wrong"
        )
    if abs(apart[1] - apart[0]) > allowed_s[1]:
        return (
            f"its stamps drift from its arrivals by {1e3 * (apart[1] - apart[0]):.3g} ms over the recording, where "
            f"{1e3 * allowed_s[1]:.2g} ms is what both lines may err: one of the two clocks does not run evenly"
        )
    return None


def _line_through(n: Array, stamp_s: Array, rate_hz: float) -> tuple[Clock | None, float | None]:
    """Return the least-squares line without outliers, and the SD about it; None for each where there is no line."""
    off_s = stamp_s - stamp_s[0] - (n - n[0]) / rate_hz  # the drift alone: no digits lost
    from_middle = n - n.mean()
    used = np.isfinite(off_s)
    slope = middle = scale = 0.0
    for _ in range(ROUNDS):
        if used.sum() < max(3, len(n) // 2):
            return None, None
        slope, middle = (float(term) for term in np.polyfit(from_middle[used], off_s[used], 1))
        left = np.abs(off_s - middle - slope * from_middle)
        scale = 1.4826 * float(np.median(left))
        used = left <= FAR * scale + COARSE_S
    scatter_s = float(np.sqrt(np.mean((off_s - middle - slope * from_middle)[used] ** 2)))
    if 1 / rate_hz + slope <= 0 or scatter_s > MOST_LATE_S:
        return None, None
    zero_s = float(stamp_s[0] - n[0] / rate_hz)
    return _clock(n[used], zero_s, off_s[used], rate_hz, scatter_s), scatter_s


def _clock(n: Array, zero_s: float, off_s: Array, rate_hz: float, scatter_s: float) -> Clock:
    """Return the clock of stamps at zero_s + n / rate_hz + off_s."""
    middle_n = float(n.mean())
    from_middle = n - middle_n
    error_n = scatter_s / math.sqrt(float((from_middle**2).sum()))
    slope, middle_s = (float(term) for term in np.polyfit(from_middle, off_s, 1))
    error_ppm = error_n * rate_hz * 1e6
    measured = error_ppm <= TOLERANCE_PPM or abs(slope * rate_hz) * 1e6 > TOLERANCE_PPM + SURE * error_ppm
    slope = slope if measured else 0.0
    left = off_s - middle_s - slope * from_middle
    wander_s = max(abs(float(part.mean())) for part in np.array_split(left, WINDOWS) if len(part))
    return Clock(
        zero_s + middle_s - slope * middle_n, 1 / (1 / rate_hz + slope), rate_hz, measured, error_ppm,
        scatter_s / math.sqrt(len(n)), None, None, wander_s, len(n),
    )  # fmt: skip
