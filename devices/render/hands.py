"""Sources of speed and force: a recording (CSV), a simulated hand, a stylus, or pushed reports."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from palpate.devices.device import DeviceFault
from palpate.devices.tablet.device import Tablet
from palpate.devices.tablet.pipeline import Shape, Stylus
from palpate.devices.tablet.recorded import COLUMNS as REPORTED
from palpate.devices.tablet.recorded import read_reports
from palpate.devices.tablet.reports import REFUSED, Guard, Report
from palpate.protocols.tables import Mistake, TableFormat, read_table
from palpate.protocols.wording import count, some
from palpate.signals.textures.sounds import RenderError

RATE_HZ = 1000
FELT = ("t_s", "speed_mm_s", "force_N")
LONGEST_S = 86_400.0


class Hand(Protocol):
    """A source of speed in mm/s and force in N, queried once for every sample that is played."""

    def at(self, sample: int) -> tuple[float, float]:
        """Return speed and force at the sample of this number; a live hand returns its newest."""


@dataclass(frozen=True)
class Scripted:
    """A hand known in advance, at 1 kHz; off the surface after its end."""

    speed_mm_s: Sequence[float]
    force_N: Sequence[float]

    def __post_init__(self) -> None:
        if len(self.speed_mm_s) != len(self.force_N):
            raise RenderError(f"{len(self.speed_mm_s)} speeds and {len(self.force_N)} forces: as many are expected.")

    def __len__(self) -> int:
        return len(self.speed_mm_s)

    @property
    def seconds(self) -> float:
        """Return the length in seconds."""
        return len(self) / RATE_HZ

    def at(self, sample: int) -> tuple[float, float]:
        """Return speed and force of that millisecond."""
        if 0 <= sample < len(self.speed_mm_s):
            return self.speed_mm_s[sample], self.force_N[sample]
        return 0.0, 0.0


@dataclass
class OnTablet:
    """The stylus of an open, started tablet; nothing else may read it meanwhile."""

    tablet: Tablet

    def at(self, sample: int) -> tuple[float, float]:  # noqa: ARG002 - a live hand has no other than its newest
        """Return the newest speed and force. Raises DeviceFault if the tablet fails."""
        self.tablet.read(0.0)
        return self.tablet.felt


@dataclass
class Pushed:
    """A stylus whose reports are pushed, as a window does for its mouse; from any one thread.

    `elapsed_s` is the clock that times the reports.
    """

    elapsed_s: Callable[[], float]
    shape: Shape = field(default_factory=Shape)
    refused: Guard = field(default_factory=lambda: Guard("hand", aligned=True))
    felt: tuple[float, float] = (0.0, 0.0)
    _waiting: deque[Report] = field(default_factory=lambda: deque(maxlen=4096))
    _stylus: Stylus = field(init=False)
    _ticks: int = 0

    def __post_init__(self) -> None:
        self._stylus = Stylus(self.shape)

    def push(self, report: Report) -> None:
        """Add a report, timed by the clock."""
        self._waiting.append(report)

    def at(self, sample: int) -> tuple[float, float]:  # noqa: ARG002 - a live hand has no other than its newest
        """Return the newest speed and force. Raises DeviceFault if too many reports in a row are implausible."""
        now_s = self.elapsed_s()
        due = int(now_s * RATE_HZ) + 1
        if due - self._ticks > RATE_HZ:  # nobody asked for a second: only what is newest matters
            self._ticks = due - 1
        while self._ticks < due:
            t_s = self._ticks / RATE_HZ
            while self._waiting and self._waiting[0].t_s <= t_s:
                accepted = self.refused.check(self._waiting.popleft(), now_s)
                if accepted is not None:
                    self._stylus.report(accepted)
            self.felt = self._stylus.step(t_s)
            self._ticks += 1
        return self.felt


def _unreadable(wrong: Mistake) -> str:
    why = getattr(wrong.problem, "strerror", None) or "it is not a table in UTF-8"
    return f"{wrong.path}: cannot be read as a hand's recording: {why}."


RECORDING = TableFormat(
    error=RenderError,
    strip=True,
    blank_above=True,
    unreadable=_unreadable,
    encoding=_unreadable,
    quoting=_unreadable,
    missing=lambda wrong: (
        f"{wrong.path}: the column {wrong.column} is missing; {', '.join(FELT)} or {', '.join(REPORTED)} are expected, "
        f"found {some(sorted(wrong.header)) or 'none'}."
    ),
    short=lambda wrong: f"{wrong.path}: a row does not hold three numbers ({wrong.column!r}).",
    number=lambda wrong: f"{wrong.path}: a row does not hold three numbers ({wrong.problem}).",
)


def read_hand(path: Path, shape: Shape | None = None) -> Scripted:
    """Return the hand in a CSV file, at 1 kHz from its first time on.

    Columns t_s, speed_mm_s, force_N: linear between rows. Columns t_s, x_mm, y_mm, pressure: a stylus' reports, through
    the same causal filters and thresholds as a real one's (thesis 4.5.3).

    Raises:
        RenderError: a file that cannot be read, columns that are missing, times that do not rise, fewer than two rows,
            implausible reports.
        DeviceError: reports that are not numbers.
    """
    table = read_table(path, (), RECORDING)
    if not set(REPORTED) - set(table.header):
        return _stroked(path, shape or Shape())
    table.demand(FELT)
    times, *felt = map(np.asarray, table.numbers(FELT, gaps=True, finite=False).values())
    if len(times) < 2:
        raise RenderError(f"{table.path}: {count(len(times), 'row')}; two at least are expected.")
    if not np.isfinite(times).all() or (backwards := np.flatnonzero(np.diff(times) <= 0)).size:
        row = int(np.flatnonzero(~np.isfinite(times))[0]) if not np.isfinite(times).all() else int(backwards[0]) + 1
        raise RenderError(f"{table.path}, line {row + 2}: t_s is {times[row]:g}; seconds that rise are expected.")
    if times[-1] - times[0] > LONGEST_S:
        raise RenderError(f"{table.path}: {times[-1] - times[0]:g} s; a day at most. Is t_s in seconds?")
    at = times[0] + np.arange(math.floor((times[-1] - times[0]) * RATE_HZ + 1e-6) + 1) / RATE_HZ
    speed, force = (np.interp(at, times, column).tolist() for column in felt)
    return Scripted(speed, force)


def _stroked(path: Path, shape: Shape) -> Scripted:
    reports = read_reports(path)
    start_s, end_s = reports[0].t_s, max(report.t_s for report in reports if math.isfinite(report.t_s))
    if not end_s - start_s <= LONGEST_S:
        raise RenderError(f"{path}: {end_s - start_s:g} s; a day at most. Is t_s in seconds?")
    felt, refused = _filtered(reports, start_s, end_s, shape)
    if refused:
        del refused["clock_reset"]
        why, count = refused.most_common(1)[0]
        message = f"{REFUSED[why][1]}, in {count} of {len(reports)} rows"
        raise RenderError(f"{path}: {message}. Correct these rows or leave them out.")
    return Scripted([speed for speed, _ in felt], [force for _, force in felt])


def _filtered(
    reports: Sequence[Report], start_s: float, end_s: float, shape: Shape
) -> tuple[list[tuple[float, float]], Counter[str]]:
    """Return speed and force at every millisecond, and how many reports were implausible, by the reason."""
    guard, stylus = Guard("hand", aligned=True), Stylus(shape)
    waiting = [report._replace(t_s=report.t_s - start_s) for report in reversed(reports)]
    felt = []
    for sample in range(int((end_s - start_s) * RATE_HZ) + 1):
        t_s = sample / RATE_HZ
        while waiting and not waiting[-1].t_s > t_s:
            with suppress(DeviceFault):  # it counts them
                if (accepted := guard.check(waiting.pop(), t_s)) is not None:
                    stylus.report(accepted)
        felt.append(stylus.step(t_s))
    return felt, guard.refused
