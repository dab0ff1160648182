"""How different two vibrations feel: third-octave levels above the vibrotactile threshold."""

from __future__ import annotations

import math

import numpy as np

from modeling.textures.metrics import density
from modeling.textures.recording import Array
from protocols.vibration_threshold import BANDS_HZ, band_edges_hz, threshold_m_s2


def felt_levels(signal: Array) -> Array:
    """The level (bands,) in dB above the threshold of each third octave of an acceleration (n,) in m/s^2, at least 0.

    Raises TextureDataError for a signal that is too short for a spectrum (256 samples).
    """
    hertz, power = density(signal)
    step = float(hertz[1])
    levels = []
    for middle in BANDS_HZ:
        low, high = band_edges_hz(middle)
        share = np.clip((np.minimum(hertz + step / 2, high) - np.maximum(hertz - step / 2, low)) / step, 0.0, 1.0)
        square = float(np.sum(share * power) * step)
        over = math.sqrt(square) / threshold_m_s2(middle)
        levels.append(20 * math.log10(over) if over > 1 else 0.0)
    return np.array(levels)


def felt_distance(truth: Array, made: Array) -> float:
    """The RMS difference in dB between the two signals' levels above the threshold, over all third octaves.

    0 where no third octave differs in level; what is not felt counts as at the threshold.
    """
    off = felt_levels(truth) - felt_levels(made)
    return float(np.sqrt(np.mean(off**2)))
