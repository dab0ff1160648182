"""The allowed range of a texture model's inputs, and of its outputs."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.signals.models.card import Texture

WIDER = 0.1
"""A model is run beyond the speeds and forces of its training by up to this share of their span."""
FASTEST_MM_S, FIRMEST_N = 300.0, 3.6
"""Greatest speed and force of a hand (thesis 4.5.3)."""
LOUD_OF_PEAK, LOUD_OF_RMS = 0.7, 10.0
OFF_OF_PEAK, OFF_OF_RMS = 0.5, 5.0
"""The smaller of the two applies. Of the six simulated textures, over 20 s, the level of 16 ms reaches 0.53 of the peak
(1.25 times the largest sample) and 4.9 of the RMS, the mean of 16 ms 0.20 and 1.8.
"""


@dataclass(frozen=True)
class Range:
    """Allowed speed in mm/s, force in N, acceleration in m/s^2. `loud` is a level that no stretch of the texture has.

    A texture has no mean over tens of milliseconds, since recordings are high-passed at 20 Hz: beyond `off` the model
    is stuck at an end.
    """

    speed: tuple[float, float]
    force: tuple[float, float]
    peak: float
    loud: float
    off: float

    @staticmethod
    def of(texture: Texture) -> Range:
        """Return the range of a card, widened a little."""
        level, peak = texture.rms_m_s2, texture.peak_m_s2
        return Range(
            _wider(texture.speed_mm_s, FASTEST_MM_S),
            _wider(texture.force_N, FIRMEST_N),
            peak,
            min(LOUD_OF_PEAK * peak, LOUD_OF_RMS * level) if level > 0 else LOUD_OF_PEAK * peak,
            min(OFF_OF_PEAK * peak, OFF_OF_RMS * level) if level > 0 else OFF_OF_PEAK * peak,
        )


def _wider(trained: tuple[float, float], most: float) -> tuple[float, float]:
    low, high = min(trained), max(trained)
    more = WIDER * (high - low)
    return max(0.0, low - more), max(low, min(most, high + more))
