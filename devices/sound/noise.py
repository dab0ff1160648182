"""Masking noise: a seamless loop, and the gain that turns it on and off."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from palpate.signals.arrays import Array

Colour = Literal["white", "pink"]
LOOP_S = 10
LOWEST_HZ, HIGHEST_HZ = 20.0, 20_000.0
END_S = 0.02
FULL_SCALE_RMS = 1 / math.sqrt(2)
"""0 dBFS is the level of a sine that just reaches full scale (AES17)."""


def rms_of(level_dbfs: float) -> float:
    """Return the RMS, relative to full scale 1, of a level in dBFS."""
    return float(FULL_SCALE_RMS * 10 ** (level_dbfs / 20))


def loop(colour: Colour, rate_hz: int, seed: int) -> Array:
    """Return ten seconds of noise of RMS 1 that loop seamlessly; a seed gives the same noise everywhere.

    It consists of whole periods: lines 0.1 Hz apart from 20 Hz to 20 kHz (or 0.45 of the rate), all of equal amplitude
    (white) or falling by 3 dB per octave (pink), with random phases; so its spectrum is exactly flat, not on average.
    """
    count = rate_hz * LOOP_S
    hz = np.fft.rfftfreq(count, 1 / rate_hz)
    inside = (hz >= LOWEST_HZ) & (hz <= min(HIGHEST_HZ, 0.45 * rate_hz))
    turns = np.random.PCG64(seed).random_raw(int(inside.sum())) / 2.0**64
    lines = np.zeros(len(hz), dtype=np.complex128)
    lines[inside] = np.exp(2j * np.pi * turns) * (1.0 if colour == "white" else 1 / np.sqrt(hz[inside]))
    samples: Array = np.fft.irfft(lines, count)
    return samples / float(np.sqrt(np.mean(samples**2)))


def a_weighted_db(colour: Colour, rate_hz: int) -> float:
    """Return the difference of the noise's A-weighted and unweighted levels, in dB (IEC 61672-1, Annex E).

    A meter set to A reads the unweighted level of the noise plus this.
    """
    hz = np.arange(LOWEST_HZ, min(HIGHEST_HZ, 0.45 * rate_hz), 1 / LOOP_S)
    square = hz**2
    gain = 12194.0**2 * square**2 / ((square + 20.6**2) * (square + 12194.0**2))
    gain /= np.sqrt((square + 107.7**2) * (square + 737.9**2))
    power = np.ones_like(hz) if colour == "white" else 1 / hz
    return 2.0 + 10 * math.log10(float(np.sum(power * gain**2) / np.sum(power)))


@dataclass
class Fader:
    """A gain that moves linearly to its target and never jumps."""

    gain: float = 0.0
    target: float = 0.0
    step: float = 0.0
    silent: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        if self.gain == 0.0:
            self.silent.set()

    def to(self, target: float, samples: int) -> None:
        """Ramp to the target at a slope of full scale in `samples`, so sooner from closer."""
        self.target, self.step = target, 1.0 / max(samples, 1)
        if target > 0:
            self.silent.clear()

    def next(self, count: int) -> Array:
        """Return the gains of the next samples."""
        if count < 1:
            return np.zeros(0)
        way = self.target - self.gain
        steps = np.minimum(np.arange(1, count + 1) * self.step, abs(way))
        gains: Array = np.where(steps < abs(way) - 1e-9, self.gain + math.copysign(1.0, way) * steps, self.target)
        self.gain = float(gains[-1])
        if self.gain == 0.0 and self.target == 0.0:
            self.silent.set()
        return gains


@dataclass
class Player:
    """A player of the loop at a level, through the fader.

    It ramps off by itself, within `END_S`, once it has sounded for `most_s`, or if `feed` was not called for `feed_s`,
    both in the output's own samples; `ended` then says why (`limit`, `heartbeat_lost`). After a lost heartbeat it may
    be turned on again, after the limit it may not.
    """

    samples: Array
    fader: Fader = field(default_factory=Fader)
    place: int = 0
    rate_hz: float = 48_000.0
    most_s: float = math.inf
    feed_s: float = math.inf
    sounded: int = 0
    """Number of samples that were not silent."""
    ended: str = ""
    _unfed: int = 0

    def feed(self) -> None:
        """Say that the session is alive."""
        self._unfed = 0

    def turn_on(self, samples: int) -> None:
        """Ramp on within so many samples, unless it has sounded for as long as it may."""
        if self.ended != "limit":
            self.ended, self._unfed = "", 0
            self.fader.to(1.0, samples)

    def fill(self, count: int) -> Array:
        """Return the next samples, repeating the loop as needed."""
        at = (self.place + np.arange(count)) % len(self.samples)
        self.place = (self.place + count) % len(self.samples)
        self._unfed += count
        if not self.ended and self.fader.target > 0:
            if self.sounded >= self.most_s * self.rate_hz:
                self._end("limit")
            elif self._unfed > self.feed_s * self.rate_hz:
                self._end("heartbeat_lost")
        gains = self.fader.next(count)
        self.sounded += int(np.count_nonzero(gains))
        part: Array = self.samples[at] * gains
        return part

    def _end(self, why: str) -> None:
        self.ended = why
        self.fader.to(0.0, round(END_S * self.rate_hz))
