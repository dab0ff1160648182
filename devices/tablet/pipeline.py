"""From a stylus' irregular reports to speed and force at 1 kHz, sample by sample and causal (thesis 4.5.3).

Every report gives the speed since the one before and the force of its pressure. Both are upsampled, low-pass filtered
at 20 Hz and limited: nothing below 10 mm/s or 0.15 N, nothing above 300 mm/s and 3.6 N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from palpate.devices.device import DeviceError
from palpate.devices.tablet.force import Force
from palpate.devices.tablet.reports import Report

NEAR_S = 0.001
"""Reports closer together were bunched on their way: a speed between them would be meaningless."""
STILL = 3.0
"""After so many usual intervals without a report the stylus is still: tablets are silent if nothing changes."""
Upsampling = Literal["hold", "line"]


@dataclass(frozen=True)
class Shape:
    """The conversion of reports to speed and force; the limits are those of thesis 4.5.3."""

    force: Force = field(default_factory=Force)
    report_hz: float = 133.0
    upsampling: Upsampling = "hold"
    cutoff_hz: float = 20.0
    rate_hz: float = 1000.0
    slowest_mm_s: float = 10.0
    fastest_mm_s: float = 300.0
    faintest_N: float = 0.15
    firmest_N: float = 3.6

    def __post_init__(self) -> None:
        """Raise DeviceError for settings that are not valid."""
        positive = (self.report_hz, self.cutoff_hz, self.rate_hz, self.force.a_N, self.force.b)
        rising = (0, self.slowest_mm_s, self.fastest_mm_s), (0, self.faintest_N, self.firmest_N)
        if not all(0 < number < math.inf for number in positive) or not all(
            a <= b < c < math.inf for a, b, c in rising
        ):
            limits = f"speed_mm_s {self.slowest_mm_s:g} to {self.fastest_mm_s:g}, force_N {self.faintest_N:g} to"
            raise DeviceError(
                f"{limits} {self.firmest_N:g}, report_hz {self.report_hz:g}, cutoff_hz {self.cutoff_hz:g},"
                f" {self.force}: all must be finite, rates and force above 0, and limits rise from lowest to highest."
            )

    @property
    def speed_delay_s(self) -> float:
        """Return the mean delay of the speed: half an interval by the difference, the upsampling, the filter."""
        return 0.5 / self.report_hz + self.force_delay_s

    @property
    def force_delay_s(self) -> float:
        """Return the mean delay of the force: half an interval held, or a whole one on the line; and the filter."""
        return (0.5 if self.upsampling == "hold" else 1.0) / self.report_hz + delay_s(self.cutoff_hz)


class Upsampled:
    """A value between reports: held, or reached linearly by the usual time of the next report."""

    __slots__ = ("_for_s", "_from", "_since_s", "_to")

    def __init__(self, for_s: float) -> None:
        """Take the duration of a line in seconds; 0 holds the value."""
        self._for_s = for_s
        self._from = self._to = self._since_s = 0.0

    def jump(self, value: float) -> None:
        """Go to the value at once."""
        self._from = self._to = value

    def set(self, t_s: float, value: float) -> None:
        """Move towards the next value; repeating the current target changes nothing."""
        if value == self._to:
            return
        self._from, self._to, self._since_s = self.at(t_s), value, t_s

    def at(self, t_s: float) -> float:
        """Return the value at that time."""
        part_s = t_s - self._since_s
        if not self._for_s or part_s >= self._for_s:
            return self._to
        return self._from + (self._to - self._from) * max(0.0, part_s) / self._for_s


class Stylus:
    """A filter that takes reports as they arrive and gives (speed in mm/s, force in N) every millisecond.

    Reports and steps must each be in time order; a report counts from the step after it arrived. A touch begins at its
    first force and at its first speed, without a transient; lifting off ends both at once.
    """

    def __init__(self, shape: Shape | None = None) -> None:
        """Begin without contact."""
        self.shape = shape = shape or Shape()
        self._usual_s = 1 / shape.report_hz
        line_s = self._usual_s if shape.upsampling == "line" else 0.0
        self._speed, self._force = Upsampled(line_s), Upsampled(line_s)
        self._speed_low = Lowpass(shape.cutoff_hz, shape.rate_hz)
        self._force_low = Lowpass(shape.cutoff_hz, shape.rate_hz)
        self._touching = self._moved = False
        self._anchor = self._last = (0.0, 0.0, 0.0)

    @property
    def touching(self) -> bool:
        """Return whether the last report was a contact."""
        return self._touching

    def report(self, report: Report) -> None:
        """Take a plausible report."""
        if not report.touching or report.pressure <= 0:
            self._touching = False
            return
        here = report.t_s, report.x_mm, report.y_mm
        force = min(self.shape.firmest_N, self.shape.force.newtons(report.pressure))
        if self._touching:
            self._force.set(report.t_s, force)
            self._move(here)
        else:
            self._touching, self._moved, self._anchor = True, False, here
            self._force.jump(force)
            self._force_low.settle(force)
            self._speed.jump(0.0)
            self._speed_low.settle(0.0)
        self._last = here

    def step(self, t_s: float) -> tuple[float, float]:
        """Return speed and force at that time; (0, 0) if either is below its threshold or nothing touches."""
        if not self._touching:
            return 0.0, 0.0
        if t_s - self._last[0] > STILL * self._usual_s:
            self._speed.set(t_s, 0.0)
        speed = self._speed_low.step(self._speed.at(t_s))
        force = self._force_low.step(self._force.at(t_s))
        shape = self.shape
        if speed <= shape.slowest_mm_s or force <= shape.faintest_N:
            return 0.0, 0.0
        return min(speed, shape.fastest_mm_s), min(force, shape.firmest_N)

    def _move(self, here: tuple[float, float, float]) -> None:
        """Set the speed since the last report that was not bunched with this one."""
        gap_s = here[0] - self._last[0]
        if gap_s > STILL * self._usual_s:
            # Silent as nothing changed: it set off one usual interval ago at the earliest.
            self._anchor = (here[0] - self._usual_s, *self._last[1:])
        elif gap_s >= NEAR_S:
            self._anchor = self._last
        for_s = here[0] - self._anchor[0]
        if for_s < NEAR_S:
            return
        speed = math.hypot(here[1] - self._anchor[1], here[2] - self._anchor[2]) / for_s
        self._set_speed(here[0], min(speed, self.shape.fastest_mm_s))

    def _set_speed(self, t_s: float, speed: float) -> None:
        if self._moved:
            self._speed.set(t_s, speed)
        else:
            self._moved = True
            self._speed.jump(speed)
            self._speed_low.settle(speed)


class Lowpass:
    """The bilinear transform of a second-order Butterworth filter, direct form II transposed.

    Its group delay towards 0 Hz is sqrt(2) / (2 pi cutoff), 11.25 ms at 20 Hz, to within the warping of the transform.
    """

    __slots__ = ("_a1", "_a2", "_b0", "_b1", "_z1", "_z2")

    def __init__(self, cutoff_hz: float, rate_hz: float) -> None:
        """Begin at rest at 0. Raise DeviceError unless the cutoff is between 0 and half the rate."""
        if not 0 < cutoff_hz < rate_hz / 2:
            raise DeviceError(
                f"a cutoff of {cutoff_hz:g} Hz at {rate_hz:g} Hz: above 0 and below half the rate is expected."
            )
        warped = math.tan(math.pi * cutoff_hz / rate_hz)
        whole = 1 + math.sqrt(2) * warped + warped * warped
        self._b0 = warped * warped / whole
        self._b1 = 2 * self._b0
        self._a1 = 2 * (warped * warped - 1) / whole
        self._a2 = (1 - math.sqrt(2) * warped + warped * warped) / whole
        self._z1 = self._z2 = 0.0

    def settle(self, value: float) -> None:
        """Set the state as if this value had always come in, so that there is no transient."""
        self._z1 = (1 - self._b0) * value
        self._z2 = (self._b0 - self._a2) * value

    def step(self, value: float) -> float:
        """Return the next output sample for the next input sample."""
        out = self._b0 * value + self._z1
        self._z1 = self._b1 * value - self._a1 * out + self._z2
        self._z2 = self._b0 * value - self._a2 * out
        return out


def delay_s(cutoff_hz: float) -> float:
    """Return the group delay of the filter towards 0 Hz, in seconds."""
    return math.sqrt(2) / (2 * math.pi * cutoff_hz)
