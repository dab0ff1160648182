"""How different two vibrations feel: third-octave levels above the vibrotactile threshold."""

from __future__ import annotations

import math

import numpy as np

from palpate.modeling.textures.metrics import density
from palpate.protocols.vibration_threshold import BANDS_HZ, band_edges_hz, threshold_m_s2
from palpate.signals.arrays import Array


def felt_levels(signal: Array) -> Array:
    """The level (bands,) in dB above the threshold of each third octave of an acceleration (n,) in m/s^2, at least 0.

    Raises TextureDataError for a signal that is too short for a spectrum (256 samples).
    """
    hertz, power = density(signal)
    step = float(hertz[1])
    levels = []
    for middle, share in zip(BANDS_HZ, third_octaves(hertz), strict=True):
        square = float(np.sum(share * power) * step)
        over = math.sqrt(square) / threshold_m_s2(middle)
        levels.append(20 * math.log10(over) if over > 1 else 0.0)
    return np.array(levels)


def third_octaves(hertz: Array) -> Array:
    """(bands, bins): the share of each bin of a spectrum that lies within each third octave; bins are evenly apart."""
    step = float(hertz[1])
    edges = np.array([band_edges_hz(middle) for middle in BANDS_HZ])
    low, high = edges[:, :1], edges[:, 1:]
    within = np.minimum(hertz + step / 2, high) - np.maximum(hertz - step / 2, low)
    return np.asarray(np.clip(within / step, 0.0, 1.0))


def felt_distance(truth: Array, made: Array) -> float:
    """The RMS difference in dB between the two signals' levels above the threshold, over all third octaves.

    0 where no third octave differs in level; what is not felt counts as at the threshold.
    """
    off = felt_levels(truth) - felt_levels(made)
    return float(np.sqrt(np.mean(off**2)))
