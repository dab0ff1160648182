"""A tracker's recording (a CSV of ours, or an export of Motive), played at its own times.

Motive's CSV (docs.optitrack.com, "Data Export: CSV", format versions 1.2x) has a line of facts, rows that name the
columns, then frames; blank cells mean that a marker was hidden.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, repeat
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from palpate.devices.device import DeviceError, DeviceFault, NowNs
from palpate.devices.source import Elapsed, TimedSource
from palpate.devices.tracker.samples import Batch, MarkerSample, Opened, awaited
from palpate.protocols.tables import Mistake, Table, TableFormat, read_table
from palpate.protocols.wording import count, some

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
COLUMNS = ("t_s", "x", "y", "z")
MOST = 64
UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}
KINDS = ("Marker", "Rigid Body", "Rigid Body Marker")
"""Objects with a position, measured ones first: a rigid body's marker is where the solver put it."""
AXES = ("X", "Y", "Z")


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
    """The samples of a marker: rising times in s, and rows in mm."""

    times_s: Sequence[float]
    rows: Sequence[MarkerSample]
    facts: Mapping[str, str] = field(default_factory=dict)


def read_track(path: Path, unit: str | None = None, marker: str | None = None) -> Track:
    """Read a CSV with the columns t_s, x, y, z and optionally seen (in `unit`, or mm), or a CSV export of Motive.

    An empty cell or `nan` is a position that was hidden. A Motive export has its own unit and may hold several markers,
    of which `marker` names one.

    Raises:
        DeviceError: naming file and line.
    """
    times_s: Sequence[float]
    rows: Iterable[MarkerSample]
    table = read_table(path, (), RECORDING)
    if is_motive(table):
        export = read_motive(table, marker)
        times_s, rows, facts, scale = export.times_s, export.rows, export.facts, MM[export.unit]
    else:
        times_s, rows = _plain(table)
        facts, scale = None, MM[unit or "mm"]
    if len(times_s) < 2:
        raise DeviceError(f"{path}: {count(len(times_s), 'sample')}; two at least are expected.")
    if at := next((place for place, pair in enumerate(pairwise(times_s), 1) if pair[1] <= pair[0]), 0):
        raise DeviceError(
            f"{path}: time does not rise at sample {at + 1}: {times_s[at]:g} s after {times_s[at - 1]:g} s. "
            "Sort the recording, or cut it where the clock was set."
        )
    return Track(times_s, [(x * scale, y * scale, z * scale, seen) for x, y, z, seen in rows], facts or {})


@dataclass
class Played(TimedSource):
    """A source that plays a recording: a sample is given once its time since the start has passed.

    Silence after the last sample is a fault, as with a real tracker.
    """

    name: str
    path: Path
    unit: str | None
    marker: str | None
    silent_s: float
    clock: str = "recording"
    track: Track | None = None
    given: int = 0

    def open(self) -> Opened:
        """Read the whole file. Raises DeviceError."""
        self.track = track = read_track(self.path, self.unit, self.marker)
        span = track.times_s[-1] - track.times_s[0]
        return Opened(usual_hz(track.times_s), {"recording": f"{self.path.name}, {span:.1f} s", **track.facts})

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: a recording is fixed."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin with the first sample."""
        self.given = 0
        super().start(elapsed_s)

    def zero_s(self, now_ns: NowNs) -> float:  # noqa: ARG002
        """Return 0 as this source's clock, which begins with its first sample."""
        return 0.0

    def pull(self, timeout_s: float) -> Batch:
        """Return the samples due by now, at most 64. Raises DeviceFault (`silent`) past the end."""
        return awaited(self._due, self.stopped, timeout_s, 0.002)

    def close(self) -> None:
        """Stop, and drop the recording."""
        self.stop()
        self.track = None

    def _due(self) -> Batch:
        elapsed, track = self.elapsed_s, self.track
        if elapsed is None or track is None:
            return Batch()
        elapsed_s = elapsed()
        first, times = self.given, track.times_s
        last = min(first + MOST, len(times))
        while self.given < last and times[self.given] - times[0] <= elapsed_s:
            self.given += 1
        if self.given == first == len(times) and elapsed_s > times[-1] - times[0] + self.silent_s:
            raise DeviceFault(
                self.name, "silent", f"{self.name}: the recording {self.path.name} is over; record less than it holds."
            )
        return Batch(times[first : self.given], track.rows[first : self.given])


def _plain(table: Table) -> tuple[Sequence[float], Iterable[MarkerSample]]:
    table.demand(COLUMNS)
    table.places |= {name: table.header.index(name) for name in table.header}  # the first of two of one name
    seen_column = ("seen",) if "seen" in table.header else ()
    times_s, x, y, z, *others = table.numbers([*COLUMNS, *seen_column], gaps=True, finite=False).values()
    for t_s, line in zip(times_s, table.lines, strict=True):
        if not math.isfinite(t_s):
            raise DeviceError(f"{table.path}, line {line}: a time is expected in the column t_s, found none.")
    seen = (value > 0 for value in others[0]) if others else repeat(True, len(x))
    return times_s, zip(x, y, z, seen, strict=True)


def usual_hz(times_s: Sequence[float]) -> float:
    """Return the samples per second without missing ones, from the steps up to 1.5 times the median step."""
    steps = [after - before for before, after in pairwise(times_s)]
    usual = [step for step in steps if step <= 1.5 * median(steps)]
    return len(usual) / sum(usual)


FACTS = {"Take Name": "take", "Export Frame Rate": "exported at", "Length Units": "length units"}
"""Fields of Motive's header that are shown, and their names."""


@dataclass(frozen=True)
class Export:
    """The samples of a marker, in `unit`."""

    times_s: list[float]
    rows: list[MarkerSample]
    unit: str
    facts: Mapping[str, str]


def is_motive(opened: Table) -> bool:
    """Return whether the file begins as Motive's exports do."""
    return opened.header[:1] == ["Format Version"]


def read_motive(opened: Table, marker: str | None) -> Export:
    """Return the track of the named marker, or of the only one. Raises DeviceError."""
    path, table = opened.path, [opened.header, *opened.records()]
    head = next((place for place, row in enumerate(table) if row[0] == "Frame"), None)
    if head is None or len(table[head]) < 5:
        raise DeviceError(f"{path}: no row that begins with Frame; export from Motive with header and markers.")
    facts = dict(zip(table[0][::2], table[0][1::2], strict=False))
    unit = UNITS.get(facts.get("Length Units", "").lower())
    if unit is None:
        raise DeviceError(f"{path}: Length Units is {facts.get('Length Units')!r}; expected one of {', '.join(UNITS)}.")
    columns = _columns(table[1 : head + 1])
    names = sorted({name for kind, name in columns if kind in KINDS})
    name = marker if marker is not None else (names[0] if len(names) == 1 else None)
    places = next((columns[kind, name] for kind in KINDS if name is not None and (kind, name) in columns), None)
    if places is None:
        problem = "several markers" if marker is None and names else f"no marker {marker!r}"
        raise DeviceError(f"{path}: {problem}; name one as `marker`: {some(names) or 'there is none'}.")
    times_s, rows = [], []
    for frame in table[head + 1 :]:
        try:
            times_s.append(float(frame[1]))
            x, y, z = (
                float(frame[place]) if frame[place : place + 1] not in ([], [""]) else math.nan for place in places
            )
        except (ValueError, IndexError):
            raise DeviceError(
                f"{path}: frame {frame[0]}: numbers are expected, found {some(frame, 8, ',')!r}."
            ) from None
        rows.append((x, y, z, True))
    return Export(times_s, rows, unit, {name: facts[key] for key, name in FACTS.items() if facts.get(key)})


def _columns(head: Sequence[Sequence[str]]) -> dict[tuple[str, str], list[int]]:
    """Return, by kind and name, the columns of X, Y and Z of a position."""
    labelled = {label: row for row in head for label in row[:2] if label in {"Type", "Name"}}
    kinds, names, what, axes = labelled.get("Type", []), labelled.get("Name", []), head[-2], head[-1]
    columns: dict[tuple[str, str], list[int]] = {}
    for place in range(2, min(map(len, (kinds, names, what, axes)))):
        if what[place] == "Position" and axes[place] in AXES:
            columns.setdefault((kinds[place], names[place]), []).append(place)
    return {key: places for key, places in columns.items() if len(places) == 3}
