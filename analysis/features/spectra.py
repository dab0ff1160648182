"""A segment's window, and its spectrum in decibels: the first alternative to cepstra (thesis 3.6.7)."""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array

FLOOR = 1e-10
"""Powers below are taken for it (librosa's own floor): silence is -100 dB re 1 (m/s^2)^2 of a spectrum's bin."""


def windowed(vibration: Array) -> Array:
    """Segments (..., n) under Hann's window, the periodic one that spectra are made with."""
    from librosa.filters import get_window

    return np.asarray(vibration * get_window("hann", vibration.shape[-1], fftbins=True))


def decibels(power: Array) -> Array:
    """10 log10 of powers, none below `FLOOR`; one value knows nothing of another (no `top_db`)."""
    from librosa import power_to_db

    return np.asarray(power_to_db(power, ref=1.0, amin=FLOOR, top_db=None))


def spectrum(vibration: Array) -> Array:
    """Segments (s, 500) to the power in dB (s, 250) of their discrete Fourier transform at 2, 4, ... 500 Hz."""
    from scipy.fft import rfft

    return decibels(np.abs(rfft(windowed(vibration), axis=-1)[..., 1:]) ** 2)
