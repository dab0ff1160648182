"""Sinks of samples: a voice coil, filled some milliseconds ahead, or an array."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from palpate.devices.actuator.device import VoiceCoil
from palpate.devices.actuator.outputs import Felt
from palpate.protocols.shell_command import shell_command
from palpate.signals.textures.sounds import RenderError

WHEN_LATE = "the last sample, dying away with a time constant of 2 ms"
"""What devices/actuator/queue.py plays if a sample is missing."""
MOST_AHEAD = 10
"""Greatest number of milliseconds that are played ahead: more would be felt as delay."""


class Sink(Protocol):
    """A sink of samples in m/s^2 at 1 kHz."""

    def free(self) -> int:
        """Return how many samples may be written now. Raises DeviceFault if the output failed."""

    def write(self, samples: Sequence[float]) -> None:
        """Play samples after those in the queue. Raises DeviceFault."""


@dataclass
class Coil:
    """An open, started voice coil, kept `ahead` samples ahead.

    If it was not identified, samples are multiplied by `gain_V` (V per m/s^2), without compensation.
    """

    coil: VoiceCoil
    ahead: int = MOST_AHEAD
    gain_V: float | None = None

    def __post_init__(self) -> None:
        """Raise RenderError if `ahead` is out of its range."""
        if not 1 <= self.ahead <= min(MOST_AHEAD, self.coil.queue.capacity):
            most = min(MOST_AHEAD, self.coil.queue.capacity)
            raise RenderError(f"{self.coil.name}: {self.ahead} ms ahead; 1 to {most} are expected.")

    def free(self) -> int:
        """Return how many samples may be written now."""
        self.coil.check()
        return self.ahead - (self.coil.queue.capacity - self.coil.room)

    def write(self, samples: Sequence[float]) -> None:
        """Limit, compensate and queue the samples."""
        if self.gain_V is None:
            self.coil.write(samples)
        else:
            self.coil.drive(self.gain_V * np.asarray(samples))

    def record(self) -> Mapping[str, Any]:
        """Return underruns and their missing samples, limited samples, faults, how far ahead, compensated or not."""
        facts = {"ahead_ms": self.ahead, "compensated": self.gain_V is None, "when_late": WHEN_LATE}
        return {**self.coil.record(), **facts}


def on_coil(coil: VoiceCoil, ahead: int = MOST_AHEAD) -> Coil:
    """Return the sink of an open voice coil. Raises RenderError if a real one was never identified."""
    if coil.compensation is not None:
        return Coil(coil, ahead)
    if isinstance(coil.output, Felt):
        return Coil(coil, ahead, 1 / coil.output.shaken.coil.gain_m_s2_V)
    raise RenderError(
        f"{coil.name}: its response is not known, so an acceleration cannot be made volts. Identify it first: "
        f"{shell_command('rig', 'calibrate', coil.name)}"
    )


@dataclass
class RecordingSink:
    """A sink that stores all samples; one may be written per step, so that it follows the hand's pace."""

    samples: list[float] = field(default_factory=list)

    def free(self) -> int:
        """Return 1."""
        return 1

    def write(self, samples: Sequence[float]) -> None:
        """Store the samples."""
        self.samples.extend(samples)
