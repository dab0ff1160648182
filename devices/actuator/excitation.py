"""What an actuator is shaken with to be identified: all frequencies of interest, again and again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from palpate.devices.actuator.queue import RATE_HZ
from palpate.signals.arrays import Array

Kind = Literal["multisine", "sweep"]
PERIOD = RATE_HZ
"""Samples of one period: lines 1 Hz apart."""
LOWEST_HZ, HIGHEST_HZ = 5, 490


@dataclass(frozen=True)
class Excitation:
    """Samples at 1 kHz, in volts, and where the periods begin that are measured: the response has settled there."""

    samples: Array
    begins: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.samples)


def excitation(kind: Kind, level_V: float, seed: int, measured: int = 8) -> Excitation:
    """`measured` periods of 1 s that peak at `level_V`, each of lines from 5 to 490 Hz.

    A multisine has random phases, others in every pair of periods, so that distortion shows as a loss of coherence; a
    sweep is the same logarithmic one throughout. What is measured is led in by a period of its own that is not.
    """
    pairs = [_multisine(seed, n) if kind == "multisine" else _sweep() for n in range((measured + 1) // 2)]
    parts = [np.tile(period * (level_V / np.abs(period).max()), 3) for period in pairs]
    begins = [3 * PERIOD * n + PERIOD * k for n in range(len(pairs)) for k in (1, 2)]
    return Excitation(np.concatenate([*parts, np.zeros(PERIOD // 4)]), tuple(begins[:measured]))


def _multisine(seed: int, number: int) -> Array:
    count = HIGHEST_HZ - LOWEST_HZ + 1
    return _made_of(np.random.PCG64([seed, number]).random_raw(count) / 2.0**64, np.ones(count))


def _sweep() -> Array:
    """A logarithmic sweep, made of its lines, so that no line is missing and it goes on into itself."""
    hz = np.arange(LOWEST_HZ, HIGHEST_HZ + 1)
    sounds_at_s = np.log(hz / LOWEST_HZ) / np.log(HIGHEST_HZ / LOWEST_HZ)
    return _made_of(-np.cumsum(sounds_at_s), 1 / np.sqrt(hz))


def _made_of(turns: Array, sizes: Array) -> Array:
    lines = np.zeros(PERIOD // 2 + 1, dtype=np.complex128)
    lines[LOWEST_HZ : HIGHEST_HZ + 1] = sizes * np.exp(2j * np.pi * turns)
    made: Array = np.fft.irfft(lines, PERIOD)
    return made
