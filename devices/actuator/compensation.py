"""Wished accelerations become voltages, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from palpate.devices.actuator.calibration import Calibration
from palpate.devices.actuator.queue import Array


@dataclass
class Compensation:
    """The filter of a calibration with its past; wishes beyond `peak_m_s2` are limited to it and counted."""

    taps: Array
    peak_m_s2: float
    limited: int = 0
    _past: Array = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def of(calibration: Calibration, peak_m_s2: float) -> Compensation:
        """The compensation that a calibration holds, at rest."""
        made = Compensation(np.array(calibration.filter), peak_m_s2)
        made.begin()
        return made

    def begin(self) -> None:
        """Forget what was played."""
        self._past = np.zeros(len(self.taps) - 1)

    def volts(self, wished: Array) -> Array:
        """The voltages for these accelerations, which follow on those before."""
        held = np.clip(wished, -self.peak_m_s2, self.peak_m_s2)
        self.limited += int(np.count_nonzero(held != wished))
        whole = np.concatenate([self._past, held])
        self._past = whole[len(whole) - len(self.taps) + 1 :]
        return np.convolve(whole, self.taps, mode="valid")
