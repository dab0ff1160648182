"""A motion tracker as a sensor: the position of a marker, and when it was hidden (thesis 4.3.1, 5.3.1.1)."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from palpate.devices.device import Block, DeviceError, DeviceFault, Health, NowNs, Signal, interleaved
from palpate.devices.kinds import Date, DeviceKind, Positive
from palpate.devices.source import Elapsed, since
from palpate.devices.tracker.lsl import LslStream
from palpate.devices.tracker.recorded import Played
from palpate.devices.tracker.samples import Numbering, OcclusionDetector, Opened, Tally, TrackerSource
from palpate.protocols.events import NS
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Channel = str | Annotated[int, Field(ge=0)]


class Settings(Strict):
    """The settings of a tracker in a rig file.

    `stream` is the name (or with `by: type` the type) of a Lab Streaming Layer stream; `recording` a CSV file; noise,
    occlusions and the settings after them are for the twin.
    """

    kind: Literal["tracker"]
    driver: Literal["lsl", "recording", "twin"]
    rate_hz: Annotated[float, Field(ge=1, le=2000)] = 120.0
    calibrated: Date | None = None
    silent_s: Annotated[float, Field(ge=0.02, le=60)] = 0.5
    reach_mm: Positive = 20_000.0
    repeats: bool = False
    unit: Literal["mm", "cm", "m"] | None = None
    stream: str = "OptiTrack"
    by: Literal["name", "type"] = "name"
    wait_s: Annotated[float, Field(ge=0.1, le=60)] = 5.0
    channels: tuple[Channel, Channel, Channel] | None = None
    seen: Channel | None = None
    seen_above: float = 0.0
    recover: bool = False
    recording: Path | None = None
    marker: str | None = None
    noise_mm: Positive = 0.05
    occlusions_per_s: Annotated[float, Field(ge=0, le=100)] = 0.0
    occlusion_s: Annotated[float, Field(ge=0.001, le=60)] = 0.1
    hides: Literal["nan", "zeros", "frozen"] = "nan"
    drift_ppm: Annotated[float, Field(ge=-10_000, le=10_000)] = 0.0
    seed: int = 0
    silent_after_s: NotNegative | None = None


MEANINGS: Mapping[str, str] = {
    "rate_hz": "frames per second, Hz",
    "silent_s": "nothing for so long is a fault, s",
    "reach_mm": "a position farther away is a fault, since its unit is wrong, mm",
    "repeats": "whether equal consecutive positions count as seen",
    "unit": "of what comes; none is the stream's or file's own word, and mm for a plain CSV",
    "stream": "name of the Lab Streaming Layer stream, or its type",
    "by": "whether `stream` is a name or a type",
    "wait_s": "how long the stream is looked for, s",
    "channels": "labels or places (from 0) of x, y and z; none finds them by their labels",
    "seen": "label or place of the channel that says whether the marker is seen; none finds it by its label",
    "seen_above": "the marker is seen where that channel is above this",
    "recover": "whether a stream that ended is waited for (a gap), or is a fault",
    "recording": "CSV file in the rig file's folder; needed by `recording`",
    "marker": "which of several markers in the recording",
    "noise_mm": "the twin's noise of each axis (SD), mm",
    "occlusions_per_s": "how often the twin's marker is covered, per s",
    "occlusion_s": "how long it is covered then, s",
    "hides": "what the twin gives for a covered marker",
    "drift_ppm": "how fast the twin's clock drifts, millionths",
    "silent_after_s": "the twin falls silent after so long, s; none never does",
}


def make(name: str, settings: Settings, folder: Path) -> Tracker:
    """Return the tracker of these settings without opening it. Raises DeviceError if no recording is named."""
    source: TrackerSource
    if settings.driver == "lsl":
        source = LslStream(
            name,
            settings.by,
            settings.stream,
            settings.wait_s,
            settings.channels,
            settings.seen,
            settings.seen_above,
            settings.unit,
            settings.recover,
        )
    elif settings.driver == "twin":
        from palpate.devices.tracker.twin import Twin

        source = Twin(
            name, settings.rate_hz, settings.noise_mm, settings.occlusions_per_s, settings.occlusion_s, settings.hides,
            settings.drift_ppm, settings.seed, settings.silent_after_s,
        )  # fmt: skip
    elif settings.recording is None:
        raise DeviceError(f"{name}: the driver `recording` needs the file to play: set `recording: FILE.csv`.")
    else:
        source = Played(name, folder / settings.recording, settings.unit, settings.marker, settings.silent_s)
    return Tracker(name, settings, source)


@dataclass
class Tracker:
    """A source of the signal `position`: x, y, z in mm, NaN while the marker is hidden, and whether it was seen (0, 1).

    `elapsed_s` replaces the time since the start (twin and recording); `now_ns` times the reading for health.
    """

    name: str
    settings: Settings
    source: TrackerSource
    elapsed_s: Elapsed | None = None
    now_ns: NowNs = time.monotonic_ns
    opened: Opened | None = None
    clock_ns: NowNs = time.monotonic_ns
    numbering: Numbering = field(default_factory=lambda: Numbering(1.0))
    watch: OcclusionDetector = field(default_factory=OcclusionDetector)
    tally: Tally = field(default_factory=Tally)
    heard_ns: int = 0
    zero_s: float = 0.0
    running: bool = False

    @property
    def signals(self) -> Sequence[Signal]:
        """Return its only signal, the position."""
        rate, clock, calibrated = self.settings.rate_hz, self.source.clock, self.settings.calibrated
        return (Signal("position", ("x", "y", "z", "seen"), ("mm", "mm", "mm", "1"), rate, clock, calibrated),)

    def open(self) -> None:
        """Find the stream, or read the recording. Raises DeviceError."""
        self.opened = self.source.open()

    def safe(self) -> None:
        """Do nothing: a tracker moves nothing."""

    def close(self) -> None:
        """Release it."""
        self.running = False
        self.source.close()
        self.opened = None

    def describe(self) -> Mapping[str, Any]:
        """Return the tracker's description for the ledger."""
        facts = {} if self.opened is None else dict(self.opened.facts)
        return {**self.settings.model_dump(mode="json", exclude_none=True), "facts": facts}

    def expect(self, scene: Scene | None) -> None:
        """Set the scene that a twin sees from the next start on."""
        self.source.expect(scene)

    def start(self, now_ns: NowNs) -> None:
        """Begin to sample. Raises DeviceError if it is not open, or has another rate than in the rig file."""
        if self.opened is None:
            raise DeviceError(f"{self.name} is not open.")
        if problem := self._misdeclared(self.opened):
            raise DeviceError(problem)
        settings = self.settings
        self.numbering, self.watch, self.tally = (
            Numbering(settings.rate_hz),
            OcclusionDetector(settings.repeats),
            Tally(),
        )
        self.source.start(self.elapsed_s or since(now_ns))
        self.zero_s = self.source.zero_s(now_ns)
        self.clock_ns, self.heard_ns = now_ns, now_ns()
        self.running = True

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Return the samples since the last read.

        Raises:
            DeviceFault: `silent`, `link_lost`, or `over_range` for a position that no tracker can see.
        """
        batch = self.source.pull(timeout_s)
        now = self.clock_ns()
        if batch.rows:
            self.heard_ns = now
        elif self.running and now - self.heard_ns > self.settings.silent_s * NS:
            message = f"no sample for {self.settings.silent_s:g} s; see the tracker's software and its cable."
            raise DeviceFault(self.name, "silent", f"{self.name}: {message}")
        # Consecutive samples in one block; a new one begins after every gap.
        if batch.reset:
            self.numbering.anew(batch.away)
        expected, blocks, start = self.numbering.next - batch.away * batch.reset, [], 0
        numbers = self.numbering.number(batch.times_s)
        count = len(numbers)
        ends = [end for end in range(1, count + 1) if end == count or numbers[end] != numbers[end - 1] + 1]
        for end in ends:
            lost = numbers[start] - expected
            why = "clock_reset" if batch.reset and not start else "gap" if lost else ""
            seen = [self.watch.see(self._within(row)) for row in batch.rows[start:end]]
            data = interleaved(*zip(*seen, strict=True))
            blocks.append(Block(numbers[start], data, now, batch.times_s[end - 1] - self.zero_s, lost, why))
            expected, start = numbers[end - 1] + 1, end
            self.tally.add(len(seen), sum(row[3] > 0 for row in seen), lost)
        self.tally.took(batch)
        return {"position": blocks}

    def stop(self) -> None:
        """Stop sampling."""
        self.running = False
        self.source.stop()

    def health(self, seconds: float) -> Health:
        """Read it at rest, and return its actual rate, how often the marker is visible, and its noise."""
        from palpate.devices.health import sensed

        calibrated = self.settings.calibrated
        facts = {} if self.opened is None else self.opened.facts
        if self.opened is not None and (problem := self._misdeclared(self.opened)):
            return Health(False, problem, calibrated=calibrated, facts=facts)
        try:
            readings = sensed(self, seconds, self.now_ns)
        except DeviceFault as fault:
            return Health(False, str(fault), calibrated=calibrated, facts=facts)
        ok, summary = self.tally.summary(self.settings.rate_hz, readings[0].noise[:3], self.watch.counts)
        return Health(ok, summary, readings, calibrated, facts)

    def _misdeclared(self, opened: Opened) -> str | None:
        declared, expected = opened.declared_hz, self.settings.rate_hz
        if not declared or abs(declared / expected - 1) <= Tally.TOLERANCE:
            return None
        return f"{self.name}: it reports {declared:g} Hz, the rig file says {expected:g} Hz: correct rate_hz."

    def _within(self, row: tuple[float, float, float, bool]) -> tuple[float, float, float, bool]:
        reach = self.settings.reach_mm
        if row[3] and any(abs(part) > reach for part in row[:3]):
            message = (
                f"a position {max(map(abs, row[:3])):.3g} mm away, beyond its reach of {reach:g} mm: is `unit` right?"
            )
            raise DeviceFault(self.name, "over_range", f"{self.name}: {message}")
        return row


def unplug(tracker: Tracker) -> None:
    """Let a twin fall silent, as if its network were cut."""
    tracker.source.silent_after_s = 0.0  # type: ignore[attr-defined]  # the twin has it


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=(
        "is calibrated with its own software (Motive: wand, then ground plane). Do it there, then write that "
        "day into the rig file: `calibrated: 2026-11-21`"
    ),
    may_hide=True,
    unplug=unplug,
)
