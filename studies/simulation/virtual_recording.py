"""Recordings by twins of sensors in no time: the same code as in a session at a rig, under a clock that leaps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from palpate.devices.device import Block, DeviceFault, Sensor, Signal
from palpate.devices.kinds import KINDS
from palpate.protocols.events import NS, Samples
from palpate.protocols.keyed import keyed_bits
from palpate.protocols.needs import NEEDS
from palpate.studies.sessions.rig import RigError

if TYPE_CHECKING:
    from palpate.devices.scene import Scene
    from palpate.protocols.plan import Plan

STEP_S = 0.25
"""Seconds that the clock leaps by: less than any twin's buffer holds."""


@dataclass
class Leaping:
    """A clock that is set forward, or goes forward by a stride each time it is read."""

    at_s: float = 0.0
    stride_s: float = 0.0

    def __call__(self) -> float:
        self.at_s += self.stride_s
        return self.at_s

    def ns(self) -> int:
        """Return the time in nanoseconds."""
        return round(self.at_s * NS)


@dataclass
class _Tape:
    """The samples that one signal has given; `count` is the number of the next one."""

    signal: Signal
    parts: list[bytes] = field(default_factory=list)
    count: int = 0

    def take(self, block: Block) -> None:
        if block.lost or block.first != self.count:
            raise RigError(f"the twin of {self.signal.name} lost samples before number {block.first}")
        self.parts.append(block.data)
        self.count += len(block.data) // (4 * len(self.signal.channels))


def _read(sensor: Sensor, tapes: Mapping[str, _Tape]) -> None:
    """Append what the sensor has given since the last reading to the tapes, one for each signal."""
    for name, blocks in sensor.read(0.0).items():
        for block in blocks:
            tapes[name].take(block)


def recorded_at_once(need: str, scene: Scene | None, seconds: float, t_ns: int, seed: int) -> tuple[Samples, ...]:
    """Return the streams of a need over a scene, or at rest: seconds x rate samples each.

    The seed decides the sensors' noise.
    """
    samples: list[Samples] = []
    for kind, taken in NEEDS[need].takes.items():
        samples += _recorded(taken.stream, _twin(kind, taken.rate_hz, seed), scene, seconds, t_ns)
    return tuple(samples)


@dataclass
class VirtualRecorder:
    """Twins recorded beside a simulated session, under its clock alone."""

    now_ns: Callable[[], int]
    clock: Leaping
    streams: Mapping[str, Sensor]
    taken: dict[tuple[str, str], int] = field(default_factory=dict)

    @classmethod
    def of(cls, needs: Iterable[str], now_ns: Callable[[], int], plan: Plan) -> VirtualRecorder:
        """Open and start the twins of the needs at second 0 of the session; earlier samples than now are left out."""
        clock, streams = Leaping(), dict[str, Sensor]()
        for need in needs:
            for kind, taken in NEEDS[need].takes.items():
                seed = keyed_bits(
                    "beside", need, kind, plan.study.study, plan.seed, plan.who.participant, *plan.occasion
                )
                sensor: Any = _twin(kind, taken.rate_hz, seed % 2**31)
                sensor.elapsed_s = clock
                sensor.open()
                sensor.start(clock.ns)
                streams[taken.stream] = sensor
        recorder = cls(now_ns, clock, streams)
        recorder.take()
        return recorder

    def take(self) -> tuple[Samples, ...]:
        """Return what each signal has given since the last call. Raises RigError where a twin lost samples."""
        tapes = {
            stream: {s.name: _Tape(s, count=self.taken.get((stream, s.name), 0)) for s in sensor.signals}
            for stream, sensor in self.streams.items()
        }
        while self.clock.ns() < self.now_ns():
            self.clock.at_s = min(self.clock.at_s + STEP_S, self.now_ns() / NS)
            for stream, sensor in self.streams.items():
                _read(sensor, tapes[stream])
        samples: list[Samples] = []
        for stream, name, tape in ((stream, *item) for stream, own in tapes.items() for item in own.items()):
            signal, first = tape.signal, self.taken.get((stream, name), 0)
            self.taken[stream, name] = tape.count
            if data := b"".join(tape.parts):
                t0_ns = round(first * NS / signal.rate_hz)
                samples.append(Samples(stream, signal.channels, signal.units, signal.rate_hz, t0_ns, data))
        return tuple(samples)

    def close(self) -> None:
        """Close the twins."""
        for sensor in self.streams.values():
            sensor.close()


def _twin(kind: str, rate_hz: float, seed: int) -> Sensor:
    settings = {"kind": kind, "driver": "twin", "rate_hz": rate_hz, "seed": seed}
    described = KINDS[kind]
    return cast(Sensor, described.make(kind, described.settings.model_validate(settings), Path()))


def _recorded(stream: str, sensor: Sensor, scene: Scene | None, seconds: float, t_ns: int) -> Iterator[Samples]:
    """Yield exactly the samples of so many seconds, for each signal of the sensor."""
    clock = Leaping(stride_s=STEP_S / 10)  # Opening takes a zero, which takes time.
    timed: Any = sensor
    timed.elapsed_s = clock
    tapes = {signal.name: _Tape(signal) for signal in sensor.signals}
    sensor.open()
    clock.at_s = clock.stride_s = 0.0
    try:
        sensor.expect(scene)
        sensor.start(clock.ns)
        while any(tape.count < round(seconds * tape.signal.rate_hz) for tape in tapes.values()):
            clock.at_s += STEP_S
            _read(sensor, tapes)
        sensor.stop()
    except DeviceFault as fault:
        raise RigError(f"{stream}: a simulated sensor does not bear this stimulus: {fault}") from fault
    finally:
        sensor.close()
    for tape in tapes.values():
        signal = tape.signal
        data = b"".join(tape.parts)[: 4 * len(signal.channels) * round(seconds * signal.rate_hz)]
        yield Samples(stream, signal.channels, signal.units, signal.rate_hz, t_ns, data)
