"""Convert requested accelerations to voltages, sample by sample, within the coil's limits of peak and heat."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from palpate.devices.actuator.calibration import Calibration
from palpate.devices.actuator.queue import RATE_HZ
from palpate.signals.arrays import Array

EASE = 0.75
"""Share of the thermal limit from which on the output is turned down."""


@dataclass
class Compensation:
    """The filter of a calibration with its past samples; accelerations beyond `peak_m_s2` are limited and counted."""

    taps: Array
    peak_m_s2: float
    limited: int = 0
    _past: Array = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def of(calibration: Calibration, peak_m_s2: float) -> Compensation:
        """Return the compensation of a calibration, at rest."""
        made = Compensation(np.array(calibration.filter), peak_m_s2)
        made.begin()
        return made

    def begin(self) -> None:
        """Forget the past samples."""
        self._past = np.zeros(len(self.taps) - 1)

    def volts(self, wished: Array) -> Array:
        """Return the voltages for these accelerations, which follow the ones before."""
        held = np.clip(wished, -self.peak_m_s2, self.peak_m_s2)
        self.limited += int(np.count_nonzero(held != wished))
        whole = np.concatenate([self._past, held])
        self._past = whole[len(whole) - len(self.taps) + 1 :]
        return np.convolve(whole, self.taps, mode="valid")


@dataclass
class Limiter:
    """A limiter that keeps every sample within the peak, and the RMS over the thermal window within its limit.

    The heat is the square of the played samples, averaged with the window's time constant. From three quarters of the
    limit on, the gain falls linearly to zero at the limit: a signal that is too loud is turned down smoothly and stays
    between 0.87 and 1 of the RMS limit. `limited` counts the samples that were changed.
    """

    peak: float
    rms: float
    window_s: float
    heat: float = 0.0
    limited: int = 0

    def limit(self, samples: Array) -> Array:
        """Return the samples within the limits; they must be finite."""
        keep = math.exp(-1 / (self.window_s * RATE_HZ))
        full = self.rms**2
        clipped = np.clip(samples, -self.peak, self.peak)
        out = clipped.copy()
        for place, value in enumerate(clipped.tolist()):
            cooled = keep * self.heat
            gain = min(1.0, max(0.0, (full - self.heat) / (full * (1 - EASE))))
            most = math.sqrt(max(0.0, (full - cooled) / (1 - keep)))
            played = max(-most, min(most, gain * value))
            self.heat = cooled + (1 - keep) * played * played
            out[place] = played
        self.limited += int(np.count_nonzero(out != samples))
        return out
