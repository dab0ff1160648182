"""A voice coil on a bench of virtual time, and an accelerometer fastened to it."""

from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from palpate.devices.actuator.device import make
from palpate.devices.actuator.settings import Settings
from palpate.devices.device import Block, Signal


@dataclass
class Clock:
    s: float = 0.0

    def __call__(self):
        return self.s

    def ns(self):
        return round(self.s * 1e9)


def coil(clock, folder=None, **changes):
    device = make("coil", Settings(**{"kind": "voice_coil", "driver": "twin", **changes}), folder, clock)
    device.open()
    return device


@dataclass
class Accelerometer:
    """Three axes at 3 kHz that hold the twin's acceleration between its milliseconds; a read takes 2 ms of the clock.

    `spoilt` changes the rows before they are given.
    """

    coil: object
    clock: Clock
    spoilt: object = staticmethod(lambda rows: rows)
    rate_hz: int = 3000
    given: int = 0
    taken: int = 0
    """How many of the twin's pieces have been given."""
    name: str = "vibration"
    signals: tuple = field(init=False)

    def __post_init__(self):
        self.signals = (Signal("acceleration", ("x", "y", "z"), ("m/s^2",) * 3, self.rate_hz),)

    def start(self, now_ns):
        self.given = self.taken = 0

    def stop(self):
        pass

    def read(self, timeout_s):
        self.clock.s += timeout_s
        self.coil.output.advance()
        pieces = list(islice(self.coil.output.felt, self.taken, None))
        self.taken += len(pieces)
        samples = np.repeat(np.concatenate([np.zeros(0), *pieces]), self.rate_hz // 1000)
        self.given += len(samples)
        rows = self.spoilt(np.outer(samples, [0.2, -0.3, 0.93]) + np.array([0.0, 0.0, 9.81]))
        return {"acceleration": [Block(self.given - len(samples), rows.astype("<f4").tobytes(), self.clock.ns())]}
