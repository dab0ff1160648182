"""A tracker's recording, read from a file and played at its own times."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, repeat
from pathlib import Path
from statistics import median
from threading import Event
from typing import TYPE_CHECKING

from palpate.devices.signals import DeviceError, DeviceFault, NowNs
from palpate.devices.tracker.motive import is_motive, read_motive
from palpate.devices.tracker.source import Batch, Elapsed, Opened, Row, awaited
from palpate.protocols.tables import Mistake, Table, TableFormat, read_table
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
COLUMNS = ("t_s", "x", "y", "z")
MOST = 64


def _unreadable(wrong: Mistake) -> str:
    return f"{wrong.path}: cannot be read as a tracker's recording: {wrong.problem}"


RECORDING = TableFormat(
    error=DeviceError,
    strip=True,
    counted=any,
    unreadable=_unreadable,
    encoding=_unreadable,
    quoting=None,
    missing=lambda wrong: (
        f"{wrong.path}: the column {wrong.column} is missing; t_s,x,y,z and perhaps seen are expected."
    ),
    number=lambda wrong: f"{wrong.where}: a number is expected in column {wrong.place + 1}, found {wrong.text!r}.",
)


@dataclass(frozen=True)
class Track:
    """Samples of one marker: rising times in s, and rows in mm."""

    times_s: Sequence[float]
    rows: Sequence[Row]
    facts: Mapping[str, str] = field(default_factory=dict)


def read_track(path: Path, unit: str | None = None, marker: str | None = None) -> Track:
    """Read a CSV with the columns t_s, x, y, z and perhaps seen (in `unit`, or mm), or a CSV export of Motive.

    An empty cell or `nan` is a position that was not seen. A Motive export says its own unit and may hold several
    markers, one of which is named by `marker`.

    Raises:
        DeviceError: naming file and line.
    """
    times_s: Sequence[float]
    rows: Iterable[Row]
    table = read_table(path, (), RECORDING)
    if is_motive(table):
        found = read_motive(table, marker)
        times_s, rows, facts, scale = found.times_s, found.rows, found.facts, MM[found.unit]
    else:
        times_s, rows = _plain(table)
        facts, scale = None, MM[unit or "mm"]
    _demand_rising(path, times_s)
    return Track(times_s, [(x * scale, y * scale, z * scale, seen) for x, y, z, seen in rows], facts or {})


@dataclass
class Played:
    """The recording as a source: a sample is there once its time has passed since the start.

    After the last one there is silence: that is a fault, as it is with a real tracker.
    """

    name: str
    path: Path
    unit: str | None
    marker: str | None
    silent_s: float
    clock: str = "recording"
    track: Track | None = None
    elapsed_s: Elapsed | None = None
    given: int = 0
    stopped: Event = field(default_factory=Event)

    def open(self) -> Opened:
        """Read the whole file. Raises DeviceError."""
        self.track = track = read_track(self.path, self.unit, self.marker)
        span = track.times_s[-1] - track.times_s[0]
        return Opened(usual_hz(track.times_s), {"recording": f"{self.path.name}, {span:.1f} s", **track.facts})

    def expect(self, scene: Scene | None) -> None:
        """A recording gives what it holds."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin with the first sample."""
        self.elapsed_s, self.given = elapsed_s, 0
        self.stopped.clear()

    def zero_s(self, now_ns: NowNs) -> float:  # noqa: ARG002
        """Its clock is its own, and begins with its first sample."""
        return 0.0

    def pull(self, timeout_s: float) -> Batch:
        """What is due by now, 64 samples at most. Raises DeviceFault (`silent`) past the end."""
        return awaited(self._come, self.stopped, timeout_s, 0.002)

    def stop(self) -> None:
        """Give no more."""
        self.elapsed_s = None
        self.stopped.set()

    def close(self) -> None:
        """The same as stop; what was read is let go."""
        self.stop()
        self.track = None

    def _come(self) -> Batch:
        elapsed_s, track = self.elapsed_s, self.track
        return Batch() if elapsed_s is None or track is None else self._due(track, elapsed_s())

    def _due(self, track: Track, elapsed_s: float) -> Batch:
        first, times = self.given, track.times_s
        last = min(first + MOST, len(times))
        while self.given < last and times[self.given] - times[0] <= elapsed_s:
            self.given += 1
        if self.given == first == len(times) and elapsed_s > times[-1] - times[0] + self.silent_s:
            raise DeviceFault(
                self.name, "silent", f"{self.name}: the recording {self.path.name} is over; record less than it holds."
            )
        return Batch(times[first : self.given], track.rows[first : self.given])


def _plain(table: Table) -> tuple[Sequence[float], Iterable[Row]]:
    table.demand(COLUMNS)
    table.places |= {name: table.header.index(name) for name in table.header}  # the first of two of one name
    told = ("seen",) if "seen" in table.header else ()
    times_s, x, y, z, *others = table.numbers([*COLUMNS, *told], gaps=True, finite=False).values()
    for t_s, line in zip(times_s, table.lines, strict=True):
        if not math.isfinite(t_s):
            raise DeviceError(f"{table.path}, line {line}: a time is expected in the column t_s, found none.")
    seen = (value > 0 for value in others[0]) if others else repeat(True, len(x))
    return times_s, zip(x, y, z, seen, strict=True)


def _demand_rising(path: Path, times_s: Sequence[float]) -> None:
    if len(times_s) < 2:
        raise DeviceError(f"{path}: {count(len(times_s), 'sample')}; two at least are expected.")
    if at := next((place for place, pair in enumerate(pairwise(times_s), 1) if pair[1] <= pair[0]), 0):
        raise DeviceError(
            f"{path}: time does not rise at sample {at + 1}: {times_s[at]:g} s after {times_s[at - 1]:g} s. "
            "Sort the recording, or cut it where the clock was set."
        )


def usual_hz(times_s: Sequence[float]) -> float:
    """Samples per second where none is missing: of the steps that are no longer than 1.5 times the median one."""
    steps = [after - before for before, after in pairwise(times_s)]
    usual = [step for step in steps if step <= 1.5 * median(steps)]
    return len(usual) / sum(usual)
