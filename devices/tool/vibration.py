"""The vibration that a texture excites in the tool: its level grows with speed and force, its pitch with speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from devices.tool.texture import Texture

PITCH_HZ = (25.0, 400.0)
"""Where the spectrum's peak may lie: inside the band that the thesis keeps (20 to 500 Hz, 3.4.1)."""
REFERENCE_MM_S, REFERENCE_N = 100.0, 1.0
SPEED_POWER, FORCE_POWER = 0.8, 0.5


@dataclass
class Resonator:
    """Two poles that colour white noise; its output has unit variance whatever pitch and bandwidth are."""

    rate_hz: float
    last: float = 0.0
    before: float = 0.0

    def run(self, white: Sequence[float], pitch_hz: float, bandwidth_hz: float) -> list[float]:
        """Colour some samples; the state goes on from the call before."""
        radius = math.exp(-math.pi * bandwidth_hz / self.rate_hz)
        turn, square = 2 * math.pi * pitch_hz / self.rate_hz, radius * radius
        near = 2 * radius * math.cos(turn)
        # The stationary variance of this AR(2) process for white noise of variance 1, inverted.
        gain = math.sqrt((1 - square) * (1 + square**2 - 2 * square * math.cos(2 * turn)) / (1 + square))
        last, before, coloured = self.last, self.before, []
        for each in white:
            last, before = gain * each + near * last - square * before, last
            coloured.append(last)
        self.last, self.before = last, before
        return coloured


def level_m_s2(texture: Texture, speed_mm_s: float, force_N: float) -> float:
    """RMS of the vibration at a speed and a force; none at rest."""
    faster, harder = speed_mm_s / REFERENCE_MM_S, force_N / REFERENCE_N
    return texture.level_m_s2 * math.pow(faster, SPEED_POWER) * math.pow(harder, FORCE_POWER)


def pitch_hz(texture: Texture, speed_mm_s: float) -> float:
    """Bumps that the tip passes in a second, inside the tool's band."""
    return min(max(speed_mm_s / texture.wavelength_mm, PITCH_HZ[0]), PITCH_HZ[1])
