"""Several sensors on one card with one converter: one task samples all inputs, and each sensor takes its own.

The task runs at the rate of the fastest sensor; a slower one takes every n-th sample, as sampling at its own rate would
give.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from threading import RLock
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.daq.acquire import Daq, Pace, Taken, Volts, Wiring
from palpate.devices.daq.ni import NiDaq
from palpate.devices.daq.sensor import DaqSensor
from palpate.devices.device import DeviceError, DeviceFault

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

WHOLE = 1e-6
"""Greatest deviation of the ratio of two rates from a whole number."""
PART_S = 1.0


@dataclass
class Card:
    """A card with one task. `at` is the number of its next sample."""

    daq: Daq
    opened: set[str] = field(default_factory=set)
    running: dict[str, Share] = field(default_factory=dict)
    at: int = 0
    lock: RLock = field(default_factory=RLock)

    def pump(self, timeout_s: float) -> None:
        """Pass the samples that have arrived to all running sensors. Raises DeviceFault."""
        taken = self.daq.read(max(1, round(PART_S * self.daq.wiring.rate_hz)), timeout_s)
        first = self.at + taken.lost
        if len(taken.volts):
            self.at = first + len(taken.volts)
            for share in self.running.values():
                share.give(first, taken.volts)


@dataclass
class Share:
    """One sensor's part of a card, as a `Daq` of its own: columns from `first`, every `every`-th sample."""

    name: str
    wiring: Wiring
    card: Card
    column: int
    every: int
    parts: deque[tuple[int, Volts]] = field(default_factory=deque)
    origin: int = 0
    number: int = 0

    @property
    def facts(self) -> Mapping[str, str]:
        """Return the card's facts, and that it is shared."""
        return {**self.card.daq.facts, "shared": f"takes every {self.every}. sample" if self.every > 1 else "yes"}

    def open(self) -> None:
        """Reserve the inputs of all sensors, if none has yet. Raises DeviceError."""
        with self.card.lock:
            if not self.card.opened:
                self.card.daq.open()
            self.card.opened.add(self.name)

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: a real card senses the real scene."""

    def start(self, pace: Pace) -> None:
        """Begin with the next sample. Raises DeviceError."""
        with self.card.lock:
            self.stop()
            if self.name not in self.card.opened:
                raise DeviceError(f"{self.name}: the card is not open")
            if self.card.running:
                self.card.pump(0.0)
            else:
                self.card.daq.start(pace)
                self.card.at = 0
            self.parts.clear()
            self.origin, self.number = self.card.at, 0
            self.card.running[self.name] = self

    def read(self, most: int, timeout_s: float) -> Taken:
        """Return the next samples that have arrived for this sensor. Raises DeviceFault."""
        with self.card.lock:
            if self.name not in self.card.running:
                return Taken(self._nothing())
            try:
                self.card.pump(0.0 if self.parts else timeout_s)
            except DeviceFault as fault:
                raise DeviceFault(self.name, fault.what, f"{self.name}: {fault}") from fault
            if not self.parts:
                return Taken(self._nothing())
            number, volts = self.parts.popleft()
            if len(volts) > most:
                self.parts.appendleft((number + most, volts[most:]))
            lost, self.number = number - self.number, number + len(volts[:most])
            return Taken(volts[:most], lost)

    def stop(self) -> None:
        """Stop taking samples; the last sensor to do so stops the task."""
        with self.card.lock:
            if self.card.running.pop(self.name, None) is not None and not self.card.running:
                self.card.daq.stop()
            self.parts.clear()

    def close(self) -> None:
        """Release the card; the last sensor to do so releases the inputs."""
        with self.card.lock:
            self.stop()
            if self.name in self.card.opened:
                self.card.opened.discard(self.name)
                if not self.card.opened:
                    self.card.daq.close()

    def give(self, first: int, volts: Volts) -> None:
        """Keep this sensor's samples of a part that begins with the card's sample `first`; the oldest are dropped."""
        skip = -(first - self.origin) % self.every
        mine = volts[skip :: self.every, self.column : self.column + len(self.wiring.channels)]
        if len(mine):
            self.parts.append(((first + skip - self.origin) // self.every, mine))
        excess = sum(len(part) for _, part in self.parts) - self.wiring.buffer
        while excess > 0:
            number, oldest = self.parts.popleft()
            if len(oldest) > excess:
                self.parts.appendleft((number + excess, oldest[excess:]))
            excess -= len(oldest)

    def _nothing(self) -> Volts:
        return np.empty((0, len(self.wiring.channels)))


def share_cards(devices: Iterable[object]) -> None:
    """Let one task serve all sensors of a rig on one card; call it before they open.

    Raises:
        DeviceError: an input wired to two sensors, or a fastest rate that is not a multiple of the others.
    """
    by_card: dict[str, list[DaqSensor]] = {}
    for device in devices:
        if isinstance(device, DaqSensor) and isinstance(device.daq, NiDaq):
            by_card.setdefault(device.daq.wiring.channels[0].partition("/")[0], []).append(device)
    for name, sensors in by_card.items():
        if len(sensors) > 1:
            _join(name, sensors)


def _join(name: str, sensors: list[DaqSensor]) -> None:
    wirings = [sensor.daq.wiring for sensor in sensors]
    names = " and ".join(sensor.name for sensor in sensors)
    channels = [channel for wiring in wirings for channel in wiring.channels]
    if len(set(channels)) < len(channels):
        raise DeviceError(f"{names}: an input of {name} is wired to both; see `channels`")
    rate_hz, buffer_s = max(wired.rate_hz for wired in wirings), max(wired.buffer_s for wired in wirings)
    alike = [replace(wiring, rate_hz=rate_hz, buffer_s=buffer_s) for wiring in wirings]
    card, column = Card(NiDaq(names, alike[0], tuple(alike[1:]))), 0
    shares = []
    for sensor, wiring in zip(sensors, wirings, strict=True):
        ratio = rate_hz / wiring.rate_hz
        every = max(1, round(ratio))
        if abs(ratio - every) > WHOLE * ratio:
            raise DeviceError(
                f"{sensor.name}: {name} has one clock for all its inputs and runs at {rate_hz:g} Hz, of which"
                f" {wiring.rate_hz:g} is no whole part; write `rate_hz: {rate_hz / every:.9g}`, or use a card of its"
                " own"
            )
        shares.append(Share(sensor.name, wiring, card, column, every))
        column += len(wiring.channels)
    for sensor, share in zip(sensors, shares, strict=True):
        sensor.daq = share
