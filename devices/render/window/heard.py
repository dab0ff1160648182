"""What the window shows of the last second: the course of the output, its spectrum, and the hand as it is felt."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RATE_HZ = 1000
SHOWN = 1000
FRAME, HOP = 250, 125
"""Samples of the Hann windows that a spectrum is averaged over: lines are 4 Hz apart."""
LEAST_DB, MOST_DB = -60.0, 20.0
"""The spectrum's axis, in dB re 1 m/s^2 (RMS of each line)."""
SCALES = (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class Heard:
    """The last second: acceleration (m/s^2) as float64 bytes, speed and force now, RMS over what sounded of it."""

    acceleration: bytes = b""
    speed_mm_s: float = 0.0
    force_N: float = 0.0
    level_m_s2: float = 0.0

    @property
    def samples(self) -> Array:
        """The acceleration, oldest first."""
        return np.frombuffer(self.acceleration)


def heard(last: Array) -> Heard:
    """What is to be shown of (3, n): acceleration, speed, force at 1 kHz."""
    if not last.shape[1]:
        return Heard()
    shown = np.ascontiguousarray(last[:, -SHOWN:])
    sounds = shown[0][shown[0] != 0]
    level = float(np.sqrt(np.mean(sounds**2))) if sounds.size else 0.0
    return Heard(shown[0].tobytes(), round(float(shown[1, -1])), round(float(shown[2, -1]), 2), level)


def columns(samples: Array, width: int) -> tuple[Array, Array]:
    """Lowest and highest value in each column of pixels; the newest sample in the last one."""
    last = np.zeros(SHOWN)
    if len(samples):
        last[-len(samples) :] = samples
    edges = np.linspace(0, SHOWN, width + 1).astype(int)
    starts = np.minimum(edges[:-1], SHOWN - 1)
    # A column reaches back to the last sample of the one before, so that the line has no gaps.
    back = np.maximum(starts - 1, 0)
    low = np.minimum(np.minimum.reduceat(last, starts), last[back])
    high = np.maximum(np.maximum.reduceat(last, starts), last[back])
    return low, high


def spectrum_dB(samples: Array) -> Array:
    """RMS of each line, 0 to 500 Hz in steps of 4, in dB re 1 m/s^2; within the axis."""
    if len(samples) < FRAME:
        return np.full(FRAME // 2 + 1, LEAST_DB)
    window = np.hanning(FRAME + 1)[:-1]
    starts = range(0, len(samples) - FRAME + 1, HOP)
    pieces = np.array([samples[start : start + FRAME] for start in starts]) * window
    power = 2 * (np.abs(np.fft.rfft(pieces)) ** 2).mean(axis=0) / (FRAME * float(window @ window))
    return np.asarray(np.clip(10 * np.log10(np.maximum(power, 1e-30)), LEAST_DB, MOST_DB))


def scale_for(greatest: float) -> float:
    """The end of an axis that holds a value: 1, 2 or 5 times a power of ten."""
    if not greatest > 0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(greatest))
    return next(step * decade for step in (*SCALES, 10.0) if step * decade >= greatest * (1 - 1e-9))
