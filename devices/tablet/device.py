"""A stylus tablet as a sensor: position, pressure, and from them speed and force at 1 kHz (thesis 4.5.2, 4.5.3)."""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import Field

from palpate.devices.device import Block, DeviceError, DeviceFault, Health, NowNs, Signal, interleaved
from palpate.devices.kinds import CalibrationMethod, Date, DeviceKind, Finite, Positive
from palpate.devices.source import Elapsed, since
from palpate.devices.tablet.evdev import Axis, EventFile
from palpate.devices.tablet.force import Force
from palpate.devices.tablet.pipeline import Shape, Stylus, Upsampling
from palpate.devices.tablet.pyglet_window import PygletTablet
from palpate.devices.tablet.recorded import PlayedReports
from palpate.devices.tablet.reports import REFUSED, Guard, Report, TabletSource
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

TICK_HZ = 1000
MOST = 1000
"""Greatest number of milliseconds of one read."""
FEWEST = 10
"""Least number of milliseconds for a reader that waits, so that a recording has no tiny blocks."""
STEP_S = 0.002
NAN = math.nan
T = TypeVar("T")
Channels = tuple[float, float, float, float, float, float]


class Range(Strict):
    """An axis in the tablet's units; `per_mm` is needed for x and y."""

    least: int
    most: int
    per_mm: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0


class Axes(Strict):
    """Axes of a tablet that does not report them, or of recorded bytes."""

    x: Range
    y: Range
    pressure: Range


class Curve(Strict):
    """The force curve F = a exp(b y), in newtons."""

    a_N: Positive = 0.13
    b: Positive = 3.32


class Display(Strict):
    """A tablet's screen: its number, its pixels per millimetre, and the position of a picture's middle on it.

    The position is in mm from its top left corner; None: the middle of the screen.
    """

    number: Annotated[int, Field(ge=0, le=15)]
    px_per_mm: Annotated[float, Field(ge=1, le=40, allow_inf_nan=False)]
    middle_mm: tuple[Positive, Positive] | None = None


class Settings(Strict):
    """The settings of a tablet in a rig file.

    `path` is the event file of evdev, `px_per_mm` is that of the screen for pyglet; jitter, step, levels and seed are
    for the twin.
    """

    kind: Literal["tablet"]
    driver: Literal["evdev", "pyglet", "recording", "twin"]
    calibrated: Date | None = None
    force: Curve = Curve()
    report_hz: Annotated[float, Field(ge=20, le=1000)] = 133.0
    upsampling: Upsampling = "hold"
    cutoff_hz: Annotated[float, Field(ge=1, le=200)] = 20.0
    speed_mm_s: tuple[Finite, Finite] = (10.0, 300.0)
    force_N: tuple[Finite, Finite] = (0.15, 3.6)
    path: Path | None = None
    axes: Axes | None = None
    px_per_mm: Positive | None = None
    screen: Display | None = None
    recording: Path | None = None
    jitter_ms: Annotated[float, Field(ge=0, le=5)] = 0.5
    step_mm: Positive = 0.01
    levels: Annotated[int, Field(ge=2, le=65536)] = 1024
    seed: int = 0


MEANINGS: Mapping[str, str] = {
    "force": "the curve F = a_N exp(b y) from the pressure y (0 to 1) to newtons",
    "force.a_N": "force where the pressure is 0, N",
    "force.b": "how steeply it grows",
    "report_hz": "how often the tablet reports a moving stylus, Hz",
    "upsampling": "to 1 kHz by holding the last report, or along a line between two",
    "cutoff_hz": "of the low-pass on speed and force, Hz",
    "speed_mm_s": "lowest and highest speed that count, mm/s",
    "force_N": "lowest and highest force that count, N",
    "path": "event file, as /dev/input/event3; needed by `evdev`",
    "axes": "for a tablet that does not tell its axes",
    "axes.x": "of the stylus from left to right",
    "axes.x.least": "lowest value, in the tablet's units",
    "axes.x.most": "highest value, in the tablet's units",
    "axes.x.per_mm": "the tablet's units per mm",
    "axes.y": "of the stylus from top to bottom",
    "axes.y.least": "lowest value, in the tablet's units",
    "axes.y.most": "highest value, in the tablet's units",
    "axes.y.per_mm": "the tablet's units per mm",
    "axes.pressure": "of the stylus on the tablet",
    "axes.pressure.least": "lowest value, in the tablet's units",
    "axes.pressure.most": "highest value, in the tablet's units",
    "axes.pressure.per_mm": "has no meaning for the pressure",
    "px_per_mm": "of the screen's calibration, pixels per mm; needed by `pyglet`",
    "screen": "the screen that the tablet is; a study shows the texture's picture there while its virtual side is on",
    "screen.number": "which of the machine's screens, from 0; another one than the participant's window is on",
    "screen.px_per_mm": "its pixels per mm, measured with a ruler",
    "screen.middle_mm": (
        "where the middle of the picture lies, mm from the left and from the top; none is the middle of the screen"
    ),
    "recording": "CSV file in the rig file's folder, with t_s,x_mm,y_mm,pressure; needed by `recording`",
    "jitter_ms": "of the twin's report times (SD), ms",
    "step_mm": "the twin's resolution of position, mm",
    "levels": "the twin's levels of pressure",
}


def make(name: str, settings: Settings, folder: Path) -> Tablet:
    """Return the tablet of these settings without opening it. Raises DeviceError if they do not go together."""
    shape = Shape(
        Force(settings.force.a_N, settings.force.b), settings.report_hz, settings.upsampling, settings.cutoff_hz,
        float(TICK_HZ), *settings.speed_mm_s, *settings.force_N,
    )  # fmt: skip
    return Tablet(name, settings, _source(name, settings, folder, shape.force), shape)


def _source(name: str, settings: Settings, folder: Path, force: Force) -> TabletSource:
    if settings.driver == "evdev":
        axes = (
            {} if settings.axes is None else {key: Axis(**value) for key, value in settings.axes.model_dump().items()}
        )
        return EventFile(name, folder / _given(name, settings.path, "path: /dev/input/event3"), axes)
    if settings.driver == "pyglet":
        return PygletTablet(name, _given(name, settings.px_per_mm, "px_per_mm: 10.4 (of the screen's calibration)"))
    if settings.driver == "recording":
        return PlayedReports(folder / _given(name, settings.recording, "recording: FILE.csv"))
    from palpate.devices.tablet.twin import TwinTablet

    return TwinTablet(
        name, force, settings.report_hz, 1e-3 * settings.jitter_ms, settings.step_mm, settings.levels, settings.seed
    )


@dataclass
class Tablet:
    """A source of the signal `stylus` at 1 kHz: x and y in mm (NaN while away), pressure, contact, speed, force.

    `felt` is the newest speed and force. `elapsed_s` replaces the time since the start (twin and recording); `now_ns`
    times the reading for health.
    """

    name: str
    settings: Settings
    source: TabletSource
    shape: Shape
    elapsed_s: Elapsed | None = None
    now_ns: NowNs = time.monotonic_ns
    facts: Mapping[str, str] | None = None
    felt: tuple[float, float] = (0.0, 0.0)
    stylus: Stylus = field(default_factory=Stylus)
    guard: Guard = field(default_factory=lambda: Guard("", aligned=True))
    passed_s: Elapsed | None = None
    clock_ns: NowNs = time.monotonic_ns
    waiting: deque[Report] = field(default_factory=deque)
    last: Report | None = None
    ticks: int = 0
    came: int = 0
    dropped: int = 0

    @property
    def signals(self) -> Sequence[Signal]:
        """Return its only signal, the stylus."""
        curve = f"F = {self.shape.force.a_N:g} exp({self.shape.force.b:g} y) N"
        calibration = curve if self.settings.calibrated is None else f"{curve}, {self.settings.calibrated}"
        names, units = ("x", "y", "pressure", "contact", "speed", "force"), ("mm", "mm", "1", "1", "mm/s", "N")
        return (Signal("stylus", names, units, float(TICK_HZ), calibration=calibration),)

    def attach(self, window: Any) -> None:
        """Take reports from this pyglet window (PsychoPy's `win.winHandle`); before opening, and for pyglet only."""
        if isinstance(self.source, PygletTablet):
            self.source.window = window

    def open(self) -> None:
        """Open the source. Raises DeviceError."""
        self.facts = self.source.open()

    def safe(self) -> None:
        """Do nothing: a tablet moves nothing."""

    def close(self) -> None:
        """Release it."""
        self.stop()
        self.source.close()
        self.facts = None

    def describe(self) -> Mapping[str, Any]:
        """Return the tablet's description for the ledger."""
        delays = {"speed_delay_ms": 1e3 * self.shape.speed_delay_s, "force_delay_ms": 1e3 * self.shape.force_delay_s}
        known = self.settings.model_dump(mode="json", exclude_none=True)
        return {**known, "facts": dict(self.facts or {}), **{name: round(ms, 2) for name, ms in delays.items()}}

    def expect(self, scene: Scene | None) -> None:
        """Set the scene that a twin follows from the next start on."""
        self.source.expect(scene)

    def start(self, now_ns: NowNs) -> None:
        """Begin to sample. Raises DeviceError if it is not open."""
        if self.facts is None:
            raise DeviceError(f"{self.name} is not open.")
        self.stylus, self.felt, self.last = Stylus(self.shape), (0.0, 0.0), None
        self.ticks = self.came = self.dropped = 0
        self.waiting.clear()
        self.clock_ns, self.passed_s = now_ns, self.elapsed_s or since(now_ns)
        simulated = self.settings.driver in {"twin", "recording"}
        self.source.start(self._within if simulated else self.passed_s)
        self.guard = Guard(self.name, self.source.aligned)

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Return the milliseconds since the last read, at most a second, and at least 10 if it may wait.

        Raises:
            DeviceFault: `link_lost` where it was unplugged, or too many reports that are implausible.
        """
        passed_s = self.passed_s
        if passed_s is None:
            return {"stylus": []}
        refused = Counter(self.guard.refused)
        rows = [self._tick() for _ in range(self._due(passed_s, timeout_s))]
        if not rows:
            return {"stylus": []}
        why = ", ".join(sorted(self.guard.refused - refused))
        return {
            "stylus": [Block(self.ticks - len(rows), interleaved(*zip(*rows, strict=True)), self.clock_ns(), why=why)]
        }

    def stop(self) -> None:
        """Stop sampling."""
        self.passed_s = None
        self.source.stop()

    def health(self, seconds: float) -> Health:
        """Read it, and return how often the stylus reports and whether reports were refused."""
        from palpate.devices.health import sensed

        facts, calibrated = dict(self.facts or {}), self.settings.calibrated
        try:
            readings = sensed(self, seconds, self.now_ns)
        except DeviceFault as fault:
            return Health(False, str(fault), calibrated=calibrated, facts=facts)
        wrong = [
            f"{self.guard.refused[why]} x {reason}" for why, (_, reason) in REFUSED.items() if self.guard.refused[why]
        ]
        dropped = f"{self.dropped} times reports were dropped" if self.dropped else ""
        came = f"{self.came} reports in {seconds:g} s" if self.came else "no report: move the stylus on it to see some"
        return Health(not wrong, "; ".join(filter(None, (came, *wrong, dropped))), readings, calibrated, facts)

    def _due(self, passed_s: Elapsed, timeout_s: float) -> int:
        """Take reports until enough milliseconds are due or the time is over, and return how many to give."""
        end_s = time.monotonic() + timeout_s
        while True:
            batch = self.source.pull(min(timeout_s, STEP_S))
            now_s = passed_s()
            accepted = (self.guard.check(report, now_s) for report in batch.reports)
            self.waiting.extend(report for report in accepted if report is not None)
            self.came += len(batch.reports)
            if batch.dropped:
                self.dropped += batch.dropped
                self.guard.refused["reports_dropped"] += batch.dropped
            due = math.floor(self._within() * TICK_HZ) - self.ticks
            if due >= FEWEST or time.monotonic() >= end_s or self.passed_s is None:
                return due

    def _within(self) -> float:
        """Return the elapsed time, limited to what one read gives."""
        passed_s = self.passed_s
        return 0.0 if passed_s is None else min(passed_s(), (self.ticks + MOST) / TICK_HZ)

    def _tick(self) -> Channels:
        t_s = self.ticks / TICK_HZ
        while self.waiting and self.waiting[0].t_s <= t_s:
            self.last = self.waiting.popleft()
            self.stylus.report(self.last)
        self.ticks += 1
        self.felt = speed, force = self.stylus.step(t_s)
        last = self.last
        if last is None or last.away:
            return NAN, NAN, 0.0, 0.0, speed, force
        return last.x_mm, last.y_mm, last.pressure, float(self.stylus.touching), speed, force


def _given(name: str, value: T | None, setting: str) -> T:
    if value is None:
        raise DeviceError(f"{name}: this driver needs `{setting}` in the rig file.")
    return value


def unplug(tablet: Tablet) -> None:
    """Cut a twin off, as if its cable were pulled."""
    tablet.source.unplugged = True  # type: ignore[attr-defined]  # the twin has it


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=CalibrationMethod(
        "palpate.devices.rig.tablet_calibration:calibrate_tablet",
        ("pairs", "figure"),
        {
            "pairs": "give --pairs FILE.csv with the columns pressure,force_N: put a force sensor under the tablet and"
            " press in steps of a tenth of the pressure"
        },
    ),
    may_hide=True,
    unplug=unplug,
)
