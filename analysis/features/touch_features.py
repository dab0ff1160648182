"""Features of touch for models: one row per segment, by kind (thesis 3.4.1, 3.6.7, Table 3.5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.features.touch import RATE_HZ, SEGMENT, Touch, contact, segments
from palpate.signals.arrays import Array

FRAME_S = 0.025
FRAME = round(FRAME_S * RATE_HZ)
HOP = FRAME / 2
"""Samples between frames, half a frame: frames start at round(12.5 i), halves rounded to even."""
FRAMES = round(SEGMENT / HOP)
COEFFICIENTS = FRAME // 2 + 1
"""Number of coefficients, which equals the bins of a frame's spectrum and the mel bands."""
HAND_STATISTICS = ("speed min", "speed max", "speed mean", "force min", "force max", "force mean")
FLOOR = 1e-10
"""The least power (librosa's own floor): silence is -100 dB re 1 (m/s^2)^2 in a spectrum's bin."""
WAVELET, WAVELET_LEVELS = "db4", 5
"""Daubechies' wavelet with four vanishing moments; at 1 kHz its bands divide at 250, 125, 62.5, 31.25 and 15.6 Hz."""
WAVELET_STATISTICS = ("mean size", "standard deviation", "power in dB", "entropy")
SIZES = {
    "mfcc": FRAMES * COEFFICIENTS,
    "hand": 6,
    "dft": SEGMENT // 2,
    "dwt": (WAVELET_LEVELS + 1) * len(WAVELET_STATISTICS),
}
"""Numbers in a row of each kind: 520, 6, 250, 24. `mfcc` and `hand` are the thesis' 526."""


def starts() -> NDArray[np.int64]:
    """Return the start of each of the 40 frames in a segment padded by 12 zeros on either side."""
    return np.asarray(np.rint(HOP * np.arange(FRAMES)), dtype=np.int64)


def frames(vibration: Array) -> Array:
    """Return segments (s, 500) under Hann's window, divided into frames (s, 40, 25)."""
    padded = np.pad(windowed(vibration), ((0, 0), (FRAME // 2, FRAME // 2)))
    return np.asarray(padded[:, starts()[:, None] + np.arange(FRAME)])


def mfcc(vibration: Array) -> Array:
    """Return cepstral coefficients (s, 40, 13), by time and number (0 is the level), of segments (s, 500) in m/s^2.

    They are the power of each frame's 13 bins, librosa's mel bands (13, Slaney's scale and norm, 0 to 500 Hz), decibels
    with a floor, and librosa's orthonormal cosine transform. Frames have no window of their own, since the segment had
    one.
    """
    from librosa.feature import melspectrogram
    from librosa.feature import mfcc as cepstra
    from scipy.fft import rfft

    power = np.abs(rfft(frames(vibration), axis=-1)) ** 2
    bands = melspectrogram(S=power.swapaxes(1, 2), sr=RATE_HZ, n_fft=FRAME, n_mels=COEFFICIENTS, power=2.0)
    return np.asarray(cepstra(S=decibels(bands), n_mfcc=COEFFICIENTS).swapaxes(1, 2))


def hand(speed_mm_s: Array, force_N: Array) -> Array:
    """Return `HAND_STATISTICS` (s, 6) of the speed in mm/s and the normal force in N of segments (s, n)."""
    columns = [statistic(signal, axis=1) for signal in (speed_mm_s, force_N) for statistic in (np.min, np.max, np.mean)]
    return np.stack(columns, axis=1)


def windowed(vibration: Array) -> Array:
    """Return segments (..., n) under the periodic Hann window."""
    from librosa.filters import get_window

    return np.asarray(vibration * get_window("hann", vibration.shape[-1], fftbins=True))


def decibels(power: Array) -> Array:
    """Return 10 log10 of powers, at least `FLOOR`; each value is independent of the others (no `top_db`)."""
    from librosa import power_to_db

    return np.asarray(power_to_db(power, ref=1.0, amin=FLOOR, top_db=None))


def spectrum(vibration: Array) -> Array:
    """Return the power in dB (s, 250) of the discrete Fourier transform of segments (s, 500) at 2, 4, ..., 500 Hz."""
    from scipy.fft import rfft

    return decibels(np.abs(rfft(windowed(vibration), axis=-1)[..., 1:]) ** 2)


def wavelets(vibration: Array) -> Array:
    """Return `WAVELET_STATISTICS` of each of 6 bands (s, 24) of segments (s, 500) in m/s^2, the slowest band first.

    Hann's window is applied here too: otherwise mirroring at the ends would put faster components into the slowest
    bands. The statistics of a band's coefficients are the mean of their absolute values, their standard deviation and
    mean power (Gueler and Uebeyli 2005; power in dB with the floor `FLOOR`), and the Shannon entropy in nats of the
    distribution of their energy (Rosso et al. 2001), 0 without energy.
    """
    from pywt import wavedec
    from scipy.special import entr

    bands = wavedec(windowed(vibration), WAVELET, mode="symmetric", level=WAVELET_LEVELS, axis=-1)
    statistics = []
    for band in map(np.asarray, bands):
        power = band**2
        energy = power.sum(axis=1, keepdims=True)
        shares = np.divide(power, energy, out=np.zeros_like(power), where=energy > 0)
        entropy = np.asarray(entr(shares).sum(axis=1))
        statistics += [np.abs(band).mean(axis=1), band.std(axis=1), decibels(power.mean(axis=1)), entropy]
    return np.stack(statistics, axis=1)


def touch_features(touch: Touch) -> dict[str, NDArray[np.float32]]:
    """Return a row for each segment with contact, by kind: mfcc (s, 520), hand (s, 6), dft (s, 250), dwt (s, 24).

    A row of `mfcc` reshaped to (40, 13) is time by coefficient. Raises FeatureError where no stretch is as long as a
    segment, and where there is no contact.
    """
    cut = segments(touch).only(contact(touch))
    kinds = {
        "mfcc": mfcc(cut.vibration).reshape(len(cut.vibration), -1),
        "hand": hand(cut.speed_mm_s, cut.force_N),
        "dft": spectrum(cut.vibration),
        "dwt": wavelets(cut.vibration),
    }
    return {kind: rows.astype(np.float32) for kind, rows in kinds.items()}
