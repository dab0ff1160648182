"""A tracker's stream of the Lab Streaming Layer (labstreaminglayer.org), through pylsl, imported on opening."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from threading import Lock
from typing import TYPE_CHECKING, Any

from palpate.devices.device import DeviceError, DeviceFault, NowNs
from palpate.devices.source import Elapsed
from palpate.devices.tracker.samples import Batch, MarkerSample, Opened
from palpate.protocols.events import NS
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

BUFFER_S = 30
"""Seconds that the library buffers for a late reader; older samples are dropped and show as missing."""
MORE_S = 1.1
"""How long to look for a second stream of the same name: two rounds of queries, one every 0.5 s."""
LISTED_S = 1.0
CORRECT_S = 1.0
"""Interval at which the offset between the clocks is measured again."""
ANSWER_S = 0.2
"""How long a reader waits for that; samples are buffered meanwhile."""
LEAP_S = 1.0
"""A clock that jumps by more than this against ours was reset; no network delay is as long."""
MOST = 512
READINGS = 8
"""Number of readings of both clocks, of which an uninterrupted one is right to a microsecond."""
MM_PER = {
    "m": 1000.0, "meter": 1000.0, "meters": 1000.0, "metre": 1000.0, "metres": 1000.0,
    "cm": 10.0, "centimeters": 10.0, "centimetres": 10.0,
    "mm": 1.0, "millimeter": 1.0, "millimeters": 1.0, "millimetre": 1.0, "millimetres": 1.0,
}  # fmt: skip
SEEN = ("seen", "tracked", "tracking", "visible", "valid", "quality", "confidence")
"""Labels of a channel that says whether, or how well, the marker is visible."""
AXIS = {axis: re.compile(f"(^|[^A-Za-z]){axis}$|{axis.upper()}$") for axis in "xyz"}
"""A label that means an axis: x, X, PositionX, marker_x, and not quality."""
Labels = Sequence[str]


@dataclass
class LslStream:
    """A stream found by name or type. Its time stamps are converted to this computer's LSL clock by the measured
    offset.

    A stream that ends is a fault, unless `recover` lets the library wait until it comes back: then it is a gap.
    """

    name: str
    by: str
    value: str
    wait_s: float
    channels: Sequence[str | int] | None
    seen: str | int | None
    seen_above: float
    unit: str | None
    recover: bool
    clock: str = "lsl"
    library: Any = None
    inlet: Any = None
    map: Map | None = None
    declared_hz: float = 0.0
    running: bool = False
    offset_s: float = 0.0
    asked_s: float = -math.inf
    behind_s: float | None = None
    came_s: float = math.nan
    reading: Lock = field(default_factory=Lock)

    def open(self) -> Opened:
        """Find the stream, and measure its clock's offset.

        Raises:
            DeviceError: no library, no such stream (listing the available ones), several of them, unusable channels.
        """
        self.library = library = _library()
        info = self._resolve()
        self.inlet = library.StreamInlet(info, max_buflen=BUFFER_S, recover=self.recover)
        try:
            full = self.inlet.info(self.wait_s)
            self.offset_s = self.inlet.time_correction(self.wait_s)
        except RuntimeError as problem:
            self.close()
            raise DeviceError(
                f"{self.name}: the stream {self.value} was found but does not answer: {problem}"
            ) from None
        if full.channel_format() == self.library.cf_string:
            raise DeviceError(f"{self.name}: the stream {self.value} sends text; numbers are expected.")
        count = full.channel_count()
        given = (full.get_channel_labels(), full.get_channel_units())
        labels, units = (([text or "" for text in texts or []] + [""] * count)[:count] for texts in given)
        self.map = mapped(self.value, labels, units, self.channels, self.seen, self.unit, self.seen_above)
        offset = f"{1e3 * self.offset_s:.3f} ms"
        self.declared_hz = full.nominal_srate()
        return Opened(self.declared_hz, {"stream": _describe_stream(full), "clock offset": offset})

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: a real tracker sees the real scene."""

    def start(self, elapsed_s: Elapsed) -> None:  # noqa: ARG002
        """Subscribe; earlier samples are dropped. Raises DeviceError."""
        with self.reading:
            try:
                self.inlet.open_stream(self.wait_s)
            except RuntimeError as problem:
                raise DeviceError(f"{self.name}: the stream {self.value} cannot be read: {problem}") from None
            self.inlet.flush()
            self.running, self.behind_s, self.came_s = True, None, self.library.local_clock()

    def zero_s(self, now_ns: NowNs) -> float:
        """Return the library's clock when now_ns was 0, from the quickest of a few readings."""
        readings = [(now_ns(), self.library.local_clock(), now_ns()) for _ in range(READINGS)]
        before_ns, at_s, after_ns = min(readings, key=lambda reading: reading[2] - reading[0])
        return float(at_s - (before_ns + after_ns) / 2 / NS)

    def pull(self, timeout_s: float) -> Batch:
        """Return the samples that have arrived. Raises DeviceFault (`link_lost`) if the stream ended."""
        with self.reading:
            if not self.running:
                return Batch()
            try:
                sample, at_s = self.inlet.pull_sample(timeout_s)
                if sample is None:
                    return Batch()
                more, times_s = self.inlet.pull_chunk(0.0, MOST)
                return self._batch([sample, *(more or [])], [at_s, *times_s])
            except self.library.util.LostError:
                raise DeviceFault(
                    self.name, "link_lost", f"{self.name}: the stream {self.value} ended; start it again at its source."
                ) from None

    def stop(self) -> None:
        """Unsubscribe once the current pull is over."""
        with self.reading:
            if self.running:
                self.inlet.close_stream()
            self.running = False

    def close(self) -> None:
        """Release the stream."""
        self.stop()
        self.inlet = None

    def _resolve(self) -> Any:
        if "'" in self.value and '"' in self.value:
            raise DeviceError(f"{self.name}: a stream's {self.by} with both kinds of quotes cannot be looked for.")
        quote = '"' if "'" in self.value else "'"
        predicate = f"{self.by}={quote}{self.value}{quote}"
        streams = self.library.resolve_bypred(predicate, 1, self.wait_s)
        if streams:
            streams = self.library.resolve_bypred(predicate, 2, MORE_S) or streams
        if len(streams) == 1:
            return streams[0]
        there = "; ".join(map(_describe_stream, self.library.resolve_streams(LISTED_S))) or "none"
        result = count(len(streams), "stream") if streams else f"no stream within {self.wait_s:g} s"
        raise DeviceError(f"{self.name}: {result} with the {self.by} {self.value!r}. Streams that there are: {there}.")

    def _batch(self, samples: list[list[float]], sent_s: list[float]) -> Batch:
        if self.map is None:
            return Batch()
        now_s, anew = self.library.local_clock(), False
        if now_s - self.asked_s >= CORRECT_S:
            # Ask for the offset once a second, and whether the library takes the sender's clock for set anew. Where
            # the answer does not come in time, the last offset is nearer the truth than none.
            self.asked_s = now_s
            with suppress(self.library.util.TimeoutError):
                self.offset_s = self.inlet.time_correction(ANSWER_S)
            anew = bool(self.inlet.was_clock_reset())
        behind_s = now_s - (sent_s[-1] + self.offset_s)
        anew |= self.behind_s is not None and abs(behind_s - self.behind_s) > LEAP_S
        away_s, self.behind_s, self.came_s = now_s - self.came_s, behind_s, now_s
        rows = [self.map.row(sample) for sample in samples]
        # Where the sender's clock says nothing, our own tells how many samples are missing.
        missing = max(0, round(away_s * self.declared_hz) - len(rows)) if anew else 0
        return Batch([t_s + self.offset_s for t_s in sent_s], rows, anew, missing)


def _library() -> Any:
    try:
        return import_module("pylsl")
    except (ImportError, RuntimeError, OSError) as problem:
        raise DeviceError(
            f"The Lab Streaming Layer needs pylsl with its liblsl: pip install pylsl ({problem})"
        ) from None


def _describe_stream(info: Any) -> str:
    of = f"type {info.type()}, {info.channel_count()} channels, {info.nominal_srate():g} Hz, {info.hostname()}"
    return f"{info.name()} ({of})"


@dataclass(frozen=True)
class Map:
    """The channels of x, y, z and of the visibility in a sample, and millimetres per unit of the stream."""

    places: tuple[int, int, int]
    scale: float
    seen: int | None = None
    seen_above: float = 0.0

    def row(self, sample: Sequence[float]) -> MarkerSample:
        """Return the sample in mm; a visibility that is not a number counts as hidden."""
        x, y, z = (self.scale * float(sample[place]) for place in self.places)
        quality = math.inf if self.seen is None else float(sample[self.seen])
        return x, y, z, quality > self.seen_above


def mapped(
    stream: str, labels: Labels, units: Labels, channels: Sequence[str | int] | None, seen: str | int | None,
    unit: str | None, seen_above: float,
) -> Map:  # fmt: skip
    """Return the map of a stream whose channels have these labels and units ("" where unknown).

    `channels` are labels or indices (from 0) of x, y, z; without them they are the only labels that end in x, y and z
    (X, PositionX, marker_x), or the channels of a stream with just three.

    Raises:
        DeviceError: unsuitable channels, listing the available ones.
    """
    there = ", ".join(f"{place} {label or '(no label)'}" for place, label in enumerate(labels))
    known = f"the stream {stream} has the channels {there}"
    places = (
        _guess_places(known, labels) if channels is None else [_place(known, labels, channel) for channel in channels]
    )
    if len(set(places)) != 3:
        raise DeviceError(f"{known}; three different ones are expected for x, y and z: set `channels` in the rig file.")
    scale = _scale(known, unit, {units[place] for place in places})
    if seen is not None:
        quality: int | None = _place(known, labels, seen)
    else:
        quality = next((place for place, label in enumerate(labels) if label.lower() in SEEN), None)
    return Map((places[0], places[1], places[2]), scale, quality, seen_above)


def _place(known: str, labels: Labels, one: str | int) -> int:
    if isinstance(one, int) and 0 <= one < len(labels):
        return one
    if isinstance(one, str) and list(labels).count(one) == 1:
        return list(labels).index(one)
    raise DeviceError(f"{known}; {one!r} in the rig file is not one of them.")


def _guess_places(known: str, labels: Labels) -> list[int]:
    ending = [[place for place, label in enumerate(labels) if AXIS[axis].search(label)] for axis in "xyz"]
    if all(len(places) == 1 for places in ending):
        return [places[0] for places in ending]
    if len(labels) == 3 and not any(ending):
        return [0, 1, 2]
    raise DeviceError(f"{known}; which are x, y and z? Set `channels` in the rig file.")


def _scale(known: str, unit: str | None, declared: set[str]) -> float:
    if unit is not None:
        return MM_PER[unit]
    units = {word.strip().lower() for word in declared}
    if len(units) == 1 and (scale := MM_PER.get(next(iter(units)))) is not None:
        return scale
    raise DeviceError(
        f"{known} in the unit {' / '.join(sorted(declared)) or '(none)'!r}; set `unit: mm` or `m` in the rig file."
    )
