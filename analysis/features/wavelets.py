"""A segment's discrete wavelet transform in four numbers a band: the second alternative to cepstra (thesis 3.6.7)."""

from __future__ import annotations

import numpy as np

from palpate.analysis.features.spectra import decibels, windowed
from palpate.signals.arrays import Array

WAVELET, LEVELS = "db4", 5
"""Daubechies' with four vanishing moments; at 1 kHz its bands part at 250, 125, 62.5, 31.25 and 15.6 Hz."""
STATISTICS = ("mean size", "standard deviation", "power in dB", "entropy")


def wavelets(vibration: Array) -> Array:
    """Segments (s, 500) in m/s^2 to `STATISTICS` of each of 6 bands (s, 24), the slowest (the approximation) first.

    A segment is under Hann's window here too: at bare ends the slowest bands would hold what the ends' mirror images
    make of faster ones. Of a band's coefficients: the mean of their absolute values, their standard deviation and mean
    power (Gueler and Uebeyli 2005; power in dB with the floor of spectra.FLOOR), and the Shannon entropy in nats of how
    their energy is shared out (Rosso et al. 2001), 0 where there is none.
    """
    from pywt import wavedec

    bands = wavedec(windowed(vibration), WAVELET, mode="symmetric", level=LEVELS, axis=-1)
    return np.concatenate([_statistics(np.asarray(band)) for band in bands], axis=1)


def _statistics(band: Array) -> Array:
    power = band**2
    return np.stack(
        [np.abs(band).mean(axis=1), band.std(axis=1), decibels(power.mean(axis=1)), _entropy(power)], axis=1
    )


def _entropy(power: Array) -> Array:
    from scipy.special import entr

    energy = power.sum(axis=1, keepdims=True)
    shares = np.divide(power, energy, out=np.zeros_like(power), where=energy > 0)
    return np.asarray(entr(shares).sum(axis=1))
