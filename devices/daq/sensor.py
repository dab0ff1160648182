"""A sensor on a card: volts in, blocks in the sensor's units out. Its transducer knows what it measures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from threading import RLock
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from palpate.devices.daq.acquire import Daq, Pace, Volts
from palpate.devices.device import (
    Block,
    DeviceFault,
    Health,
    NowNs,
    Reading,
    Signal,
    closed_on_failure,
    faults_as_errors,
)
from palpate.devices.health import WAIT_S, sensed
from palpate.protocols.events import NS
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

SILENT_S = 0.5
"""A sensor without samples for this many seconds is silent."""
RATE_TOLERANCE, LATE_S = 0.01, 0.02
"""Greatest deviation of a measured rate from the requested one: 1 %, or the effect of a late host on a short time."""
MOST_S = 1.0
"""Greatest duration of one read, so that a block stays small after a pause."""


class Transducer(Protocol):
    """The transducer that converts a card's volts."""

    signal: Signal

    def begin(self) -> None:
        """Reset the state, because the samples begin anew."""

    def rows(self, volts: Volts) -> Volts:
        """Return the same samples in the signal's units. Raises DeviceFault for volts that no working sensor gives."""

    def zero(self, volts: Volts, /) -> None:
        """Use these samples as zero. Raises DeviceError if they moved, or if the transducer cannot be zeroed."""

    def complaint(self, reading: Reading) -> str | None:
        """Return what is wrong with a reading at rest, in one sentence; None if nothing is."""

    def describe(self) -> Mapping[str, Any]:
        """Return calibration and limits, as JSON data."""

    @property
    def calibrated(self) -> str | None:
        """Return the date of the last calibration, as an ISO date."""

    @property
    def facts(self) -> Mapping[str, str]:
        """Return further facts to show."""


@dataclass
class DaqSensor:
    """A `Sensor` with one signal. One thread reads it; others may start, stop and close it.

    `elapsed_s` is the twin's time (seconds since the start); None: real time.
    """

    name: str
    kind: str
    driver: str
    daq: Daq
    transducer: Transducer
    zero_s: float = 0.0
    elapsed_s: Callable[[], float] | None = None
    now_ns: NowNs | None = None
    pace: Pace | None = None
    number: int = 0
    came_s: float = 0.0
    lock: RLock = field(default_factory=RLock)

    @property
    def signals(self) -> Sequence[Signal]:
        """Return the transducer's one signal."""
        return (self.transducer.signal,)

    def open(self) -> None:
        """Reserve the card's inputs, and take the zero if the rig file says so. Raises DeviceError."""
        self.daq.open()
        if self.zero_s > 0:
            with closed_on_failure(self.close), faults_as_errors():
                self.tare(self.zero_s)

    def tare(self, seconds: float) -> None:
        """Use the current reading as zero, while the tool hangs free and still. Sampling must be stopped.

        Raises:
            DeviceError: the reading moved, or this sensor cannot be zeroed.
            DeviceFault: it failed meanwhile.
        """
        self.daq.expect(None)
        self.start(time.monotonic_ns)
        try:
            target = max(2, math.ceil(seconds * self.daq.wiring.rate_hz))
            parts: list[Volts] = []
            patience = math.ceil(seconds / WAIT_S) + round(SILENT_S / WAIT_S)
            while (missing := target - sum(map(len, parts))) > 0 and patience:
                parts.append(self.daq.read(missing, WAIT_S).volts)
                patience -= not len(parts[-1])
            if missing > 0:
                raise DeviceFault(self.name, "silent", f"{self.name}: no sample came while its zero was taken")
            volts = np.concatenate(parts)
        finally:
            self.stop()
        self.transducer.zero(volts)

    def safe(self) -> None:
        """Do nothing: a sensor moves nothing, and its samples after another device's fault are useful."""

    def close(self) -> None:
        """Stop, and release the card's inputs."""
        with self.lock:
            self.stop()
            self.daq.close()

    def describe(self) -> Mapping[str, Any]:
        """Return kind, driver, card, wiring and calibration, as JSON data."""
        wiring = self.daq.wiring
        return {
            "kind": self.kind,
            "driver": self.driver,
            "card": dict(self.daq.facts),
            "channels": list(wiring.channels),
            "range_V": [wiring.low_V, wiring.high_V],
            "rate_hz": wiring.rate_hz,
            **self.transducer.describe(),
        }

    def health(self, seconds: float) -> Health:
        """Read the sensor at rest, and return rate, losses, mean and noise, and the transducer's assessment."""
        self.daq.expect(None)
        facts = {**self.daq.facts}
        elapsed_s = self.elapsed_s
        now_ns = time.monotonic_ns if elapsed_s is None else lambda: round(elapsed_s() * NS)
        try:
            readings = sensed(self, seconds, now_ns)
        except DeviceFault as fault:
            return Health(False, str(fault), (), self.transducer.calibrated, facts)
        wrong = [
            problem
            for reading in readings
            if (problem := _wrong(reading, seconds) or self.transducer.complaint(reading))
        ]
        summary = "; ".join(wrong) or f"{readings[0].rate_hz:.6g} Hz, nothing lost"
        return Health(
            not any(wrong), summary, readings, self.transducer.calibrated, facts | dict(self.transducer.facts)
        )

    def expect(self, scene: Scene | None) -> None:
        """Set the scene that is sensed from the next start on."""
        self.daq.expect(scene)

    def start(self, now_ns: NowNs) -> None:
        """Begin to sample. Raises DeviceError."""
        with self.lock:
            self.pace = Pace.real(now_ns) if self.elapsed_s is None else Pace.by_clock(self.elapsed_s)
            self.transducer.begin()
            self.daq.start(self.pace)
            self.now_ns, self.number, self.came_s = now_ns, 0, self.pace.elapsed_s()

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Return the block that has arrived, if any. Raises DeviceFault from the card or the transducer, or
        `silent`.
        """
        with self.lock:
            if self.pace is None or self.now_ns is None:
                return {self.transducer.signal.name: ()}
            taken = self.daq.read(max(1, round(MOST_S * self.daq.wiring.rate_hz)), timeout_s)
            at_ns = self.now_ns()
            if not len(taken.volts):
                quiet = self.pace.elapsed_s() - self.came_s
                if quiet > max(SILENT_S, 20 / self.daq.wiring.rate_hz):
                    message = f"{self.name}: no sample for {quiet:.1f} s; see the card, its cable and its clock"
                    raise DeviceFault(self.name, "silent", message)
                return {self.transducer.signal.name: ()}
            self.came_s = self.pace.elapsed_s()
            rows = self.transducer.rows(taken.volts)
            first = self.number + taken.lost
            self.number = first + len(rows)
            why = "not read in time: overwritten in the card's buffer" if taken.lost else ""
            block = Block(first, rows.astype("<f4").tobytes(), at_ns, None, taken.lost, why)
            return {self.transducer.signal.name: (block,)}

    def stop(self) -> None:
        """Stop sampling."""
        with self.lock:
            self.daq.stop()
            self.pace = self.now_ns = None


def _wrong(reading: Reading, seconds: float) -> str | None:
    nominal_hz = reading.signal.rate_hz
    off = max(RATE_TOLERANCE, LATE_S / seconds) * nominal_hz
    if reading.lost:
        return f"{count(reading.lost, 'sample')} lost"
    if reading.rate_hz and abs(reading.rate_hz - nominal_hz) > off:
        return f"it runs at {reading.rate_hz:.5g} Hz; {nominal_hz:g} are set"
    return None


def unplug(sensor: DaqSensor) -> None:
    """Cut a twin off its card, as if the card were pulled."""
    sensor.daq.unplugged = True  # type: ignore[attr-defined]  # the twin of a card has it
