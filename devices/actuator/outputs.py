"""What a voice coil can be driven by: a DAQ card, a sound card, its twin."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.actuator.analog_out import AnalogOut
from palpate.devices.actuator.queue import RATE_HZ, Array
from palpate.devices.actuator.resonance import Shaken
from palpate.devices.actuator.upsample import DELAY_S, Upsampler
from palpate.devices.sound.card import Card
from palpate.devices.sound.output import Fill, Output, Tape

if TYPE_CHECKING:
    from palpate.devices.actuator.settings import Settings

KEPT_S = 20
"""How much a twin remembers."""
RANGE_V = 10.0


@dataclass
class SoundOut(Card):
    """A sound card that plays volts at 1 kHz: full scale is `full_scale_V`, and the rate is raised on the way.

    The limiter stands before the upsampling filter, which swings beyond its samples: `peak_V` is kept after it too.
    """

    full_scale_V: float = 1.0
    peak_V: float = 1.0

    def start(self, fill: Fill) -> None:
        """Begin to play; the upsampling filter adds 10 ms to the card's latency."""
        super().start(self.raised(fill))
        self.latency_s += DELAY_S

    def raised(self, fill: Fill) -> Fill:
        """Volts at 1 kHz to shares of the full scale at the card's rate."""
        upsampler = Upsampler(int(self.rate_hz), fill)
        return lambda count: upsampler.fill(count).clip(-self.peak_V, self.peak_V) / self.full_scale_V


@dataclass
class Felt(Tape):
    """The twin's output: it keeps the last 20 s of what was played (volts) and what it did to the hand (m/s^2)."""

    shaken: Shaken = field(default_factory=Shaken)
    played: deque[Array] = field(default_factory=lambda: deque([np.zeros(0)]))
    felt: deque[Array] = field(default_factory=lambda: deque([np.zeros(0)]))
    kept: int = 0

    def shake(self, volts: Array) -> None:
        """What the coil does with what was played."""
        self.played.append(volts)
        self.felt.append(self.shaken.felt(volts))
        self.kept += len(volts)
        while self.kept > KEPT_S * RATE_HZ:
            self.kept -= len(self.played.popleft())
            self.felt.popleft()

    def whole(self) -> tuple[Array, Array]:
        """Volts and m/s^2 that it remembers."""
        return np.concatenate(self.played), np.concatenate(self.felt)


def output_of(name: str, settings: Settings, elapsed_s: Callable[[], float]) -> Output:
    """The output that the settings name."""
    if settings.driver == "nidaqmx":
        return AnalogOut(name, settings.channel, RANGE_V, settings.ahead_ms * RATE_HZ // 1000)
    if settings.driver == "sound":
        return SoundOut(
            name,
            settings.device,
            settings.card_rate_hz,
            full_scale_V=settings.full_scale_V,
            peak_V=settings.peak_V,
        )
    made = Felt(RATE_HZ, elapsed_s, lambda _volts: None, shaken=Shaken(seed=settings.seed))
    made.heard = made.shake
    return made
