"""A tablet's recording, played at its own times."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.device import DeviceError
from palpate.devices.source import Elapsed, TimedSource
from palpate.devices.tablet.reports import Batch, Report
from palpate.protocols.tables import Mistake, TableFormat, read_table

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

COLUMNS = ("t_s", "x_mm", "y_mm", "pressure")
MOST = 256


def _unreadable(wrong: Mistake) -> str:
    return f"{wrong.path}: cannot be read as a tablet's recording: {wrong.problem}"


RECORDING = TableFormat(
    error=DeviceError,
    unreadable=_unreadable,
    encoding=_unreadable,
    quoting=None,
    missing=lambda wrong: f"{wrong.path}: the column {wrong.column} is missing; {','.join(COLUMNS)} are expected.",
    number=lambda wrong: f"{wrong.where}: numbers are expected ({wrong.problem}).",
)


def read_reports(path: Path) -> list[Report]:
    """Return the reports of a CSV with the columns t_s, x_mm, y_mm, pressure; an empty position means away.

    Raises:
        DeviceError: naming file and line.
    """
    columns = read_table(path, COLUMNS, RECORDING).numbers(COLUMNS, gaps=True, finite=False)
    reports = []
    for t_s, x, y, pressure in zip(*columns.values(), strict=True):
        away = math.isnan(x) or math.isnan(y)
        reports.append(Report(t_s, x, y, 0.0 if away else pressure, not away and pressure > 0, away))
    if not reports or not math.isfinite(reports[0].t_s):
        raise DeviceError(f"{path}: no report, or none with a time; a recording of a tablet is expected.")
    return reports


@dataclass
class PlayedReports(TimedSource):
    """A source that plays a recording; after its last report the stylus does not change."""

    path: Path
    aligned: bool = True
    reports: Sequence[Report] = ()
    given: int = 0

    def open(self) -> Mapping[str, str]:
        """Read the whole file. Raises DeviceError."""
        self.reports = read_reports(self.path)
        span = self.reports[-1].t_s - self.reports[0].t_s
        back = sum(after.t_s < before.t_s for before, after in pairwise(self.reports))
        summary = f"{self.path.name}, {len(self.reports)} reports, {span:.1f} s"
        return {"recording": summary + (f", time runs back {back} times" if back else "")}

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: a recording is fixed."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin with the first report."""
        self.given = 0
        super().start(elapsed_s)

    def pull(self, timeout_s: float) -> Batch:
        """Return the reports due by now, at most 256; one whose time runs backwards is due at once."""
        elapsed_s = self.elapsed_s
        if elapsed_s is None:
            return Batch()
        now_s, first, start_s = elapsed_s(), self.given, self.reports[0].t_s
        last = min(first + MOST, len(self.reports))
        while self.given < last and not self.reports[self.given].t_s - start_s > now_s:
            self.given += 1
        if self.given == first:
            self.stopped.wait(timeout_s)
        return Batch([report._replace(t_s=report.t_s - start_s) for report in self.reports[first : self.given]])
