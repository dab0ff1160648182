"""Streams with a known truth: a hand's motion sampled by a drifting clock, with random delays of arrival."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.signals.aligning.sine_errors import HAND_HZ
from palpate.signals.arrays import Array

GRID_HZ = 1000.0
SLOWEST_HZ, TONES = 0.2, 48
VIBRATES_FROM_HZ, VIBRATION = 60.0, 0.5
"""Streams of a sufficient rate also carry vibration, of half the motion's RMS, up to 0.45 of their rate."""
STARTS_S = 2.0
STAMPS_ERR_S = 1e-4
EDGE_S = 0.75
"""Seconds at each end that are not evaluated: half of the evaluation's filter, and the reach of every method."""


@dataclass(frozen=True)
class Kind:
    """A kind of stream: rate, drift, samples per block, and the mean delay of a block (exponential, least 0)."""

    name: str
    rate_hz: float
    drift_ppm: float
    block: int
    delay_s: float


KINDS = (
    Kind("8 kHz", 8000.0, 50.0, 80, 1e-3),
    Kind("3 kHz", 3000.0, -50.0, 30, 1e-3),
    Kind("120 Hz", 120.0, 50.0, 1, 4e-3),
    Kind("80 Hz", 80.0, -50.0, 1, 4e-3),
)


@dataclass(frozen=True)
class Known:
    """A simulated stream, determined by kind, seconds and seed."""

    kind: Kind
    seconds: float
    seed: int = 7

    @property
    def true_hz(self) -> float:
        """The device's actual rate, in Hz."""
        return self.kind.rate_hz * (1 + self.kind.drift_ppm * 1e-6)

    @cached_property
    def times_s(self) -> Array:
        """The time at which each sample was taken."""
        return STARTS_S + np.arange(int(self.seconds * self.kind.rate_hz)) / self.true_hz

    @cached_property
    def values(self) -> Array:
        """The samples (n, 1), rounded to float32 as in a ledger."""
        clean = self.motion(self.times_s) + self._vibration()
        return clean.astype(np.float32).astype(np.float64)[:, None]

    @cached_property
    def arrivals(self) -> tuple[tuple[int, float], ...]:
        """The last sample of each block, and its time of arrival; a late block holds up the later ones."""
        last = np.arange(self.kind.block - 1, len(self.times_s), self.kind.block)
        delays = np.random.default_rng([self.seed, 1]).exponential(self.kind.delay_s, len(last))
        arrived = np.maximum.accumulate(self.times_s[last] + delays)
        return tuple(zip(last.tolist(), arrived.tolist(), strict=True))

    @cached_property
    def stamps_s(self) -> Array:
        """The device's own times of each block's last sample, with errors in both directions."""
        last = np.array([n for n, _ in self.arrivals])
        noise = np.random.default_rng([self.seed, 3]).standard_normal(len(last))
        return np.asarray(self.times_s[last] + STAMPS_ERR_S * noise)

    @cached_property
    def grid_s(self) -> Array:
        """The grid's points that are far enough from both ends."""
        first, last = self.times_s[0] + EDGE_S, self.times_s[-1] - EDGE_S
        return np.arange(np.ceil(first * GRID_HZ), np.floor(last * GRID_HZ)) / GRID_HZ

    def motion(self, at_s: Array) -> Array:
        """Return the truth at any time: tones of equal size from 0.2 to 25 Hz, RMS 1."""
        rng = np.random.default_rng([self.seed, 0])
        hz = np.linspace(SLOWEST_HZ, HAND_HZ, TONES)
        phases = rng.uniform(0, 2 * np.pi, TONES)
        total = np.zeros_like(at_s)
        for frequency, phase in zip(hz, phases, strict=True):
            total += np.cos(2 * np.pi * frequency * at_s + phase)
        return np.asarray(total * np.sqrt(2 / TONES))

    def percent_wrong(self, values: Array) -> float:
        """Return the RMS error of values (m,) on the grid, low-passed at 25 Hz, in percent of the motion's RMS."""
        truth = _below_25_hz(self.motion(self.grid_s))
        return float(100 * _rms(_below_25_hz(values) - truth) / _rms(truth))

    def _vibration(self) -> Array:
        """Return noise with a flat spectrum, which needs no truth because the evaluation filters it away."""
        count = len(self.times_s)
        if self.kind.rate_hz * 0.45 <= VIBRATES_FROM_HZ:
            return np.zeros(count)
        rng = np.random.default_rng([self.seed, 2])
        hz = np.fft.rfftfreq(count, 1 / self.kind.rate_hz)
        in_band = (hz >= VIBRATES_FROM_HZ) & (hz <= 0.45 * self.kind.rate_hz)
        noise = np.fft.irfft(np.where(in_band, rng.normal(size=len(hz)) + 1j * rng.normal(size=len(hz)), 0), count)
        return np.asarray(VIBRATION * noise / _rms(noise))


def _below_25_hz(values: Array) -> Array:
    """Return the values low-passed (zero-phase, 0.01 % up to 25 Hz, 80 dB from 35 Hz on), without the filter's ends."""
    from scipy.signal import fftconvolve, firwin

    return np.asarray(fftconvolve(values, firwin(503, 30.0, window=("kaiser", 7.857), fs=GRID_HZ), mode="valid"))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
