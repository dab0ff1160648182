"""Outputs that drive a voice coil: a DAQ card, a sound card, and a twin.

A sound card gets samples at its own rate, without images of the signal above 600 Hz. The twin is a mass on a spring
that is shaken through a delay, with a noisy sensor on it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.actuator.analog_out import AnalogOut
from palpate.devices.actuator.queue import RATE_HZ
from palpate.devices.sound.card import Card
from palpate.devices.sound.output import Fill, Output, Tape
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from palpate.devices.actuator.settings import Settings

REACH = 20
"""Number of samples at 1 kHz that each output sample is computed from."""
CUT_HZ, KAISER_BETA = 500.0, 5.0
DELAY_S = REACH / 2 / RATE_HZ
KEPT_S = 20
"""Seconds that a twin remembers."""
RANGE_V = 10.0


def bank(up: int) -> Array:
    """Return a windowed sinc (Kaiser, beta 5, cut at 500 Hz) of 20 ms as a row of 20 weights for each phase.

    Flat within 0.02 dB up to 400 Hz, images (from 600 Hz) 54 dB down, delay 10 ms.
    """
    t = np.arange(up * REACH) - up * REACH / 2
    taps = np.sinc(2 * CUT_HZ / RATE_HZ * t / up) * np.kaiser(up * REACH + 1, KAISER_BETA)[:-1]
    phases = taps.reshape(REACH, up).T
    output: Array = phases / phases.sum(axis=1, keepdims=True)
    return output


@dataclass
class Upsampler:
    """An upsampler from 1 kHz to `rate_hz`, whose parts of any length join without a seam."""

    rate_hz: int
    source: Callable[[int], Array]
    _bank: Array = field(init=False)
    _up: int = field(init=False)
    _down: int = field(init=False)
    _past: Array = field(default_factory=lambda: np.zeros(REACH))
    _at: int = field(init=False)

    def __post_init__(self) -> None:
        shared = math.gcd(self.rate_hz, RATE_HZ)
        self._up, self._down = self.rate_hz // shared, RATE_HZ // shared
        self._bank, self._at = bank(self._up), self._up

    def fill(self, count: int) -> Array:
        """Return the next samples at the card's rate."""
        places = self._at + np.arange(count) * self._down
        newest, phase = places // self._up, places % self._up
        needed = int(newest[-1]) if count else 0
        got = self.source(needed) if needed else np.zeros(0)
        past = np.concatenate([self._past, got])
        windows = np.lib.stride_tricks.sliding_window_view(past, REACH)
        output: Array = np.einsum("nk,nk->n", windows[newest], self._bank[phase][:, ::-1])
        self._past, self._at = past[-REACH:], self._at + count * self._down - needed * self._up
        return output


@dataclass(frozen=True)
class Coil:
    """The model of a coil: acceleration per volt far above the resonance, resonance, damping ratio, loop delay,
    noise.
    """

    gain_m_s2_V: float = 20.0
    resonance_Hz: float = 60.0
    damping: float = 0.15
    delay: int = 3
    noise_m_s2: float = 0.02
    rate_hz: float = RATE_HZ

    def weights(self) -> tuple[Array, Array]:
        """Return the filter g s^2 / (s^2 + 2 d w s + w^2) at the rate (bilinear, exact at resonance), then the delay
        in samples.
        """
        k = 1 / np.tan(np.pi * self.resonance_Hz / self.rate_hz)
        over = k * k + 2 * self.damping * k + 1
        b = self.gain_m_s2_V * k * k * np.array([1.0, -2.0, 1.0]) / over
        a = np.array([1.0, (2 - 2 * k * k) / over, (k * k - 2 * self.damping * k + 1) / over])
        return np.concatenate([np.zeros(self.delay), b]), a


@dataclass
class Shaken:
    """A simulated accelerometer on the coil, computed one part after the other."""

    coil: Coil = field(default_factory=Coil)
    seed: int = 1
    _weights: tuple[Array, Array] = field(init=False)
    _state: Array = field(init=False)
    _noise: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self._weights = b, a = self.coil.weights()
        self._state = np.zeros(max(len(a), len(b)) - 1)
        self._noise = np.random.Generator(np.random.PCG64(self.seed))

    def felt(self, volts: Array) -> Array:
        """Return the acceleration in m/s^2 for these volts, as long as they are."""
        from scipy.signal import lfilter

        moved, self._state = lfilter(*self._weights, volts, zi=self._state)
        felt: Array = moved + self.coil.noise_m_s2 * self._noise.standard_normal(len(volts))
        return felt


@dataclass
class SoundOut(Card):
    """A sound card that plays volts at 1 kHz: full scale is `full_scale_V`; samples are converted to the card's rate.

    The limiter comes before the upsampling filter, which overshoots: `peak_V` is enforced after it too.
    """

    full_scale_V: float = 1.0
    peak_V: float = 1.0

    def start(self, fill: Fill) -> None:
        """Begin to play; the upsampling filter adds 10 ms to the card's latency."""
        super().start(self.raised(fill))
        self.latency_s += DELAY_S

    def raised(self, fill: Fill) -> Fill:
        """Convert a source of volts at 1 kHz to one of shares of the full scale at the card's rate."""
        upsampler = Upsampler(int(self.rate_hz), fill)
        return lambda count: upsampler.fill(count).clip(-self.peak_V, self.peak_V) / self.full_scale_V


@dataclass
class Felt(Tape):
    """The twin's output, which keeps the last 20 s of the volts played and the acceleration of the hand (m/s^2)."""

    shaken: Shaken = field(default_factory=Shaken)
    played: deque[Array] = field(default_factory=lambda: deque([np.zeros(0)]))
    felt: deque[Array] = field(default_factory=lambda: deque([np.zeros(0)]))
    kept: int = 0

    def shake(self, volts: Array) -> None:
        """Record what was played, in volts and as the coil's acceleration, keeping the last 20 s."""
        self.played.append(volts)
        self.felt.append(self.shaken.felt(volts))
        self.kept += len(volts)
        while self.kept > KEPT_S * self.rate_hz:
            self.kept -= len(self.played.popleft())
            self.felt.popleft()

    def whole(self) -> tuple[Array, Array]:
        """Return the kept volts, and the acceleration in m/s^2."""
        return np.concatenate(self.played), np.concatenate(self.felt)


def output_of(name: str, settings: Settings, elapsed_s: Callable[[], float]) -> Output:
    """Return the output that the settings name."""
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
    output = Felt(RATE_HZ, elapsed_s, lambda _volts: None, shaken=Shaken(seed=settings.seed))
    output.heard = output.shake
    return output
