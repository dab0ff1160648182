"""Twins on a calibration bench: their time passes as they are read, and what they feel is what the bench does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import repeat

import numpy as np

from palpate.devices.actuator.device import VoiceCoil
from palpate.devices.actuator.outputs import Felt
from palpate.devices.actuator.queue import RATE_HZ
from palpate.devices.daq.sensor import DaqSensor
from palpate.devices.signals import Block, DeviceError
from palpate.protocols.events import NS
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

PIECE = 512


@dataclass
class Passing:
    """Seconds that pass only when somebody lets them pass."""

    s: float = 0.0

    def __call__(self) -> float:
        """Seconds so far."""
        return self.s

    def ns(self) -> int:
        """The same in nanoseconds."""
        return round(self.s * NS)


@dataclass
class Hastened(DaqSensor):
    """A twin whose time is the reading's: a read of 50 ms lets 50 ms pass, and nobody waits for them."""

    clock: Passing = field(default_factory=Passing)

    def __post_init__(self) -> None:
        self.elapsed_s = self.clock

    @staticmethod
    def of(twin: DaqSensor) -> Hastened:
        """The same twin, on the same card."""
        return Hastened(twin.name, twin.kind, twin.driver, twin.daq, twin.transducer)

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """What comes within that time."""
        self.clock.s += timeout_s
        return super().read(timeout_s)


@dataclass(frozen=True)
class _Still:
    """A scene of which only the acceleration is asked."""

    def wrench(self, rate_hz: float) -> Iterator[Array]:  # noqa: ARG002 - a scene is asked so
        """Nothing pulls."""
        return repeat(np.zeros((PIECE, 6)))

    def position_mm(self, rate_hz: float) -> Iterator[Array]:  # noqa: ARG002 - a scene is asked so
        """Nothing moves away."""
        return repeat(np.zeros((PIECE, 3)))


@dataclass(frozen=True)
class Lying(_Still):
    """At rest with one axis up (`+x` to `-z`): it feels one g along that axis."""

    up: str

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:  # noqa: ARG002 - a scene is asked so
        """Gravity, without end."""
        felt = np.zeros((PIECE, 3))
        felt[:, "xyz".index(self.up[1])] = GRAVITY_M_S2 if self.up[0] == "+" else -GRAVITY_M_S2
        return repeat(felt)


@dataclass(frozen=True)
class Fastened(_Still):
    """On a voice coil's twin, which moves along the sensor's x; z is up."""

    coil: Felt
    fresh: list[Array] = field(default_factory=list)

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:
        """What the coil does from now on, held between its milliseconds; the last value where nothing new is there."""
        self.fresh.clear()
        felt, passed, number = np.zeros(1), -1, 0  # felt[0] was felt in millisecond `passed`; before the first, rest.
        while True:
            self.coil.advance()
            felt = np.concatenate([felt, *self.fresh])
            self.fresh.clear()
            ready = max(number + 1, int(np.ceil((passed + len(felt)) * rate_hz / RATE_HZ)))
            at = np.minimum(np.arange(number, ready) * RATE_HZ // rate_hz - passed, len(felt) - 1).astype(int)
            yield np.stack([felt[at], np.zeros(len(at)), np.full(len(at), GRAVITY_M_S2)], axis=1)
            felt, passed, number = felt[at[-1] :], passed + int(at[-1]), ready


def fastened(coil: VoiceCoil, sensor: DaqSensor) -> Hastened:
    """The sensor's twin on the coil's twin, in one time. Raises DeviceError where only one of them is a twin."""
    output = coil.output
    if not isinstance(output, Felt) or sensor.driver != "twin":
        twin, real = (coil.name, sensor.name) if isinstance(output, Felt) else (sensor.name, coil.name)
        raise DeviceError(f"{twin} is a twin and {real} is not: neither feels the other; give both a real driver")
    hastened = Hastened.of(sensor)
    scene = Fastened(output)

    def shaken(volts: Array) -> None:
        output.shake(volts)
        scene.fresh.append(output.felt[-1])

    output.elapsed_s, output.heard = hastened.clock, shaken
    sensor.expect(scene)
    return hastened
