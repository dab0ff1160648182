"""Record sensors, each read by a thread of its own; the writer takes their samples chunk by chunk."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

from palpate.devices.device import DeviceError, DeviceFault, NowNs, Sensor, Signal, closed_on_failure
from palpate.devices.streams.reader import BLOCK_BYTES, Reader, Ring
from palpate.devices.streams.stream import SILENT_S, SILENT_SAMPLES, Stream
from palpate.devices.suspend import SuspendWatch, suspended_ns
from palpate.protocols.events import NS, Chunk, Samples

CHUNK_S = 0.5
ROOM_S = 30.0
"""How long a disk may block before samples are lost."""
BLOCKS_HZ = 200.0
"""Blocks per second for which a signal has room."""
FIRST_S = 3.0
"""Time for a sensor's first samples: hardware is armed, a twin computes the first piece of its scene."""
NOT_A_NUMBER_S = 1.0
"""A signal without a finite row for this long is no longer measuring."""
TURN_S = 0.0005
"""How long a thread may hold the interpreter while another waits; Python's own 5 ms would delay the readers."""


def signals_of(sensors: Mapping[str, Sensor]) -> list[tuple[str, Sensor, Signal]]:
    """Return every signal with its prefix and its sensor."""
    return [(prefix, sensor, signal) for prefix, sensor in sensors.items() for signal in sensor.signals]


@dataclass
class Recording:
    """A recording of sensors: start, then take while it is due, then stop, then take until nothing is due.

    A signal of the sensor at `prefix` becomes the stream names[prefix, signal], else PREFIX_SIGNAL. `room_s` is how
    much of each stream may wait to be written; samples beyond are dropped and recorded as a gap. The streams in
    `may_hide` may be NaN for any time (a tracker whose marker is hidden). One thread uses it, the one that writes.
    Raises DeviceError if two streams would have the same name.
    """

    sensors: Mapping[str, Sensor]
    now_ns: NowNs
    chunk_s: float = CHUNK_S
    room_s: float = ROOM_S
    names: Mapping[tuple[str, str], str] = field(default_factory=dict)
    may_hide: Collection[str] = ()
    suspended_ns: NowNs = suspended_ns
    streams: dict[str, Stream] = field(default_factory=dict)
    started_ns: int = 0
    ended_ns: int | None = None
    _readers: list[Reader] = field(default_factory=list)
    _failed: DeviceFault | None = None
    _taken_ns: int = 0
    _turn_s: float | None = None
    _rest: deque[Chunk] = field(default_factory=deque)
    _suspend: SuspendWatch = field(init=False)

    def __post_init__(self) -> None:
        self._suspend = SuspendWatch(self.suspended_ns)
        for prefix, sensor, signal in signals_of(self.sensors):
            name = self.names.get((prefix, signal.name), f"{prefix}_{signal.name}")
            if name in self.streams:
                raise DeviceError(f"{sensor.name}: two streams would be named {name!r}; give one another name")
            # Room for so many seconds of a signal; of one without a rate, for a thousand rows a second.
            row_bytes, rate_hz = 4 * len(signal.channels), signal.rate_hz or 1000.0
            per_s = rate_hz * row_bytes + min(rate_hz, BLOCKS_HZ) * BLOCK_BYTES
            self.streams[name] = Stream(name, sensor.name, signal, Ring(max(1, round(self.room_s * per_s)), row_bytes))
        for prefix, sensor in self.sensors.items():
            names = {s.name: self.names.get((prefix, s.name), f"{prefix}_{s.name}") for s in sensor.signals}
            rings = {signal: self.streams[name].ring for signal, name in names.items()}
            self._readers.append(Reader(sensor, rings, self.now_ns))

    def start(self) -> None:
        """Start every sensor. Raises DeviceFault, also if a sensor is not available now; then none samples."""
        self._turn_s = sys.getswitchinterval()
        sys.setswitchinterval(min(self._turn_s, TURN_S))
        with closed_on_failure(self.end):
            for reader in self._readers:
                reader.start()
        self.started_ns = self._taken_ns = self.now_ns()

    def due(self) -> bool:
        """Return whether a chunk is to be written: its time is over, more waits than it can hold, or it is the last."""
        if self.ended_ns is not None:
            return bool(self._rest) or self._left()
        if not any(stream.ring.held for stream in self.streams.values()):
            return False
        late = self.now_ns() - self._taken_ns >= self.chunk_s * NS
        return late or any(stream.ring.waiting >= stream.most for stream in self.streams.values())

    def take(self) -> Chunk:
        """Return the samples since the last call, with {"streams": {NAME: metadata}}."""
        return self._rest.popleft() if self._rest else self._next()

    def _left(self) -> bool:
        return any(stream.ring.held or stream.ring.dropped for stream in self.streams.values())

    def _next(self) -> Chunk:
        self._taken_ns = self.now_ns()
        samples: list[Samples] = []
        metadata: dict[str, Any] = {}
        for name, stream in self.streams.items():
            made, of_it = stream.take(last=self.ended_ns is not None)
            samples.extend(made)
            if of_it is not None:
                metadata[name] = of_it
        return Chunk({"streams": metadata}, tuple(samples))

    def fault(self) -> DeviceFault | None:
        """Return the first fault, which stays: the computer was suspended, or a sensor raised, is silent, or gives no
        numbers.

        Once all samples are taken after the end, also report what failed last, and streams that are empty.
        """
        if self._failed is None:
            over = self.ended_ns is not None
            message = self._suspend.message()
            suspended = None if message is None else DeviceFault("session", "interrupted", message)
            raised = next((reader.fault for reader in self._readers if reader.fault is not None), None)
            failed = suspended or raised or self._untrue()
            self._failed = failed or (self._empty() if over else self._silent())
        return self._failed

    def end(self) -> None:
        """Stop sampling and reading at once; samples that were read can still be taken. Does nothing after the end.

        Every sensor is stopped, even if one of them raises: then DeviceFault is raised.
        """
        if self.ended_ns is not None:
            return
        self.ended_ns = self.now_ns()
        if self._turn_s is not None:
            sys.setswitchinterval(self._turn_s)
        for reader in self._readers:
            reader.end()
        hanging = [reader for reader in self._readers if not reader.gone()]
        with ExitStack() as ends:
            for reader in reversed(self._readers):
                ends.callback(reader.stop)
        if hanging and self._failed is None:
            name = hanging[0].sensor.name
            self._failed = DeviceFault(name, "stuck", "its driver hangs: the thread that reads it does not come back")

    def stop(self) -> dict[str, dict[str, Any]]:
        """End the recording, and return a summary of every stream, including samples that are still to be taken."""
        self.end()
        while self._left():
            self._rest.append(self._next())
        return {name: stream.summary() for name, stream in self.streams.items()}

    def hanging(self) -> Sequence[str]:
        """Return the sensors whose thread hangs in their driver."""
        return [
            reader.sensor.name for reader in self._readers if reader.thread is not None and reader.thread.is_alive()
        ]

    def _untrue(self) -> DeviceFault | None:
        for name, stream in self.streams.items():
            if stream.broken is not None:
                return stream.broken
            if stood_s := stream.standstill.stood_s:
                problem = f"{name}: nothing for {stood_s:.1f} s, and its samples were numbered on as if there had been"
                return DeviceFault(stream.device, "silent", problem)
            rate_hz = stream.signal.rate_hz
            if rate_hz and name not in self.may_hide and stream.bad_run >= NOT_A_NUMBER_S * rate_hz:
                problem = f"{name}: no numbers for {stream.bad_run / rate_hz:.1f} s (limit {NOT_A_NUMBER_S:g} s)"
                return DeviceFault(stream.device, "not_a_number", problem)
        return None

    def _empty(self) -> DeviceFault | None:
        """Return a fault for an empty stream once all is taken: a short recording ends before silence is noticed."""
        if self._left():
            return None
        lasted_s = ((self.ended_ns or 0) - self.started_ns) / NS
        for name, stream in self.streams.items():
            due = lasted_s * stream.signal.rate_hz >= SILENT_SAMPLES
            if due and not stream.next:
                return DeviceFault(stream.device, "silent", f"{name}: nothing in {lasted_s:.1f} s")
            if due and 0 < stream.samples == stream.bad and name not in self.may_hide:
                return DeviceFault(stream.device, "not_a_number", f"{name}: no numbers in {lasted_s:.1f} s")
        return None

    def _silent(self) -> DeviceFault | None:
        now_ns = self.now_ns()
        for reader in self._readers:
            for signal in reader.sensor.signals:
                ring = reader.rings.get(signal.name)
                least_s = FIRST_S if ring is not None and not ring.put_bytes else SILENT_S
                limit_s = max(least_s, SILENT_SAMPLES / signal.rate_hz) if signal.rate_hz else None
                quiet_s = (now_ns - reader.heard_ns.get(signal.name, now_ns)) / NS
                if limit_s is not None and quiet_s > limit_s:
                    problem = f"{signal.name}: nothing for {quiet_s:.1f} s (limit {limit_s:g} s)"
                    return DeviceFault(reader.sensor.name, "silent", problem)
        return None
