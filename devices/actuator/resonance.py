"""The voice coil's twin: a mass on a spring that is shaken through a delay, and a noisy sensor on it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from palpate.devices.actuator.queue import RATE_HZ, Array


@dataclass(frozen=True)
class Coil:
    """Acceleration per volt far above the resonance, the resonance, its damping ratio, the loop's delay, the noise."""

    gain_m_s2_V: float = 20.0
    resonance_Hz: float = 60.0
    damping: float = 0.15
    delay: int = 3
    noise_m_s2: float = 0.02

    def weights(self) -> tuple[Array, Array]:
        """The filter g s^2 / (s^2 + 2 d w s + w^2) at 1 kHz (bilinear, exact at the resonance), then the delay."""
        k = 1 / np.tan(np.pi * self.resonance_Hz / RATE_HZ)
        over = k * k + 2 * self.damping * k + 1
        b = self.gain_m_s2_V * k * k * np.array([1.0, -2.0, 1.0]) / over
        a = np.array([1.0, (2 - 2 * k * k) / over, (k * k - 2 * self.damping * k + 1) / over])
        return np.concatenate([np.zeros(self.delay), b]), a


@dataclass
class Shaken:
    """What an accelerometer on the coil gives, one part after the other."""

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
        """Acceleration in m/s^2, as long as what was played."""
        from scipy.signal import lfilter

        moved, self._state = lfilter(*self._weights, volts, zi=self._state)
        felt: Array = moved + self.coil.noise_m_s2 * self._noise.standard_normal(len(volts))
        return felt
