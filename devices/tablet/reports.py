"""Reports of a tablet, and the refusal of implausible ones."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from palpate.devices.device import DeviceFault
from palpate.devices.source import Source

SLACK = 0.05
"""How far beyond 0 and 1 a pressure may be by a driver's rounding; it is clipped."""
AHEAD_S = 1.0
ANEW = 3
"""After so many reports in a row from a clock that jumped, the new time is followed."""
TOO_MANY = 50
"""So many implausible reports in a row are a broken tablet."""
REFUSED = {
    "not_a_number": ("not_a_number", "positions or pressures that are not numbers"),
    "pressure_out_of_range": ("over_range", "pressures outside 0 to 1; see the pressure axis in the rig file"),
    "time_backwards": ("firmware", "time stamps that run backwards"),
    "time_ahead": ("firmware", "time stamps from the future"),
}
"""Reasons for refusing reports: the kind of fault for too many of them, and their description."""


class Report(NamedTuple):
    """A report: time, position in mm (right of and below the top left corner), and pressure from 0 to 1.

    `away` says that the stylus is out of the tablet's reach (or its state is unknown): its position has no meaning
    then.
    """

    t_s: float
    x_mm: float
    y_mm: float
    pressure: float
    touching: bool
    away: bool = False


@dataclass(frozen=True)
class Batch:
    """Reports as they arrived, and how often the device reported dropping some."""

    reports: Sequence[Report] = ()
    dropped: int = 0


class TabletSource(Source[Mapping[str, str], Batch], Protocol):
    """A source of reports; `open` returns facts to show."""

    @property
    def aligned(self) -> bool:
        """Return whether its reports are timed in seconds since the start, not by a clock of their own."""


@dataclass
class Guard:
    """A check that refuses implausible reports, by reason, and converts the others to seconds since the start."""

    name: str
    aligned: bool
    refused: Counter[str] = field(default_factory=Counter)
    shift_s: float = math.nan
    last_s: float = -math.inf
    jumped: int = 0
    in_a_row: int = 0

    def __post_init__(self) -> None:
        if self.aligned:
            self.shift_s = 0.0

    def check(self, report: Report, now_s: float) -> Report | None:
        """Return the report in this computer's time, or None.

        A clock that was reset is followed after three reports (`clock_reset`).

        Raises:
            DeviceFault: 50 reports in a row were refused.
        """
        if math.isnan(self.shift_s):
            self.shift_s = now_s - report.t_s
        why = self._wrong(report) or self._jump(report, now_s)
        if why is None:
            self.in_a_row = 0
            self.last_s = report.t_s + self.shift_s
            pressure = min(1.0, max(0.0, report.pressure))
            return report._replace(t_s=self.last_s, pressure=0.0 if report.away else pressure)
        self.refused[why] += 1
        self.in_a_row += 1
        if self.in_a_row >= TOO_MANY:
            what, words = REFUSED[why]
            raise DeviceFault(self.name, what, f"{self.name}: {self.in_a_row} reports in a row with {words}.")
        return None

    def _wrong(self, report: Report) -> str | None:
        if not math.isfinite(report.t_s) or not math.isfinite(report.pressure):
            return "not_a_number"
        if not report.away and not (math.isfinite(report.x_mm) and math.isfinite(report.y_mm)):
            return "not_a_number"
        return None if -SLACK <= report.pressure <= 1 + SLACK else "pressure_out_of_range"

    def _jump(self, report: Report, now_s: float) -> str | None:
        at_s = report.t_s + self.shift_s
        why = "time_backwards" if at_s < self.last_s else "time_ahead" if at_s > now_s + AHEAD_S else None
        self.jumped = self.jumped + 1 if why else 0
        if self.jumped < ANEW:
            return why
        self.refused["clock_reset"] += 1
        self.shift_s, self.last_s, self.jumped = now_s - report.t_s, now_s, 0
        return None
