"""Cepstral coefficients of a segment: 40 frames of 13 (thesis 3.4.1; the choices that it leaves open are named)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.features.segments import SEGMENT
from palpate.analysis.features.spectra import decibels, windowed
from palpate.analysis.features.touch import RATE_HZ
from palpate.signals.arrays import Array

FRAME_S = 0.025
FRAME = round(FRAME_S * RATE_HZ)
HOP = FRAME / 2
"""Half a frame is 12.5 samples: frames start at round(12.5 i), halves to the even side."""
FRAMES = round(SEGMENT / HOP)
COEFFICIENTS = FRAME // 2 + 1
"""13, as many as the bins of a frame's spectrum, and as there are mel bands."""


def starts() -> NDArray[np.int64]:
    """Where each of the 40 frames begins in a segment padded by 12 zeros on either side: it is centred there."""
    return np.asarray(np.rint(HOP * np.arange(FRAMES)), dtype=np.int64)


def frames(vibration: Array) -> Array:
    """Segments (s, 500) under Hann's window, split into frames (s, 40, 25)."""
    padded = np.pad(windowed(vibration), ((0, 0), (FRAME // 2, FRAME // 2)))
    return np.asarray(padded[:, starts()[:, None] + np.arange(FRAME)])


def mfcc(vibration: Array) -> Array:
    """Segments (s, 500) in m/s^2 to coefficients (s, 40, 13): time first, coefficient 0 (the level) first.

    The power of each frame's 13 bins, librosa's mel bands (13, Slaney's scale and norm, 0 to 500 Hz), decibels with a
    floor, and librosa's orthonormal cosine transform. A frame has no window of its own: the segment had one.
    """
    from librosa.feature import melspectrogram
    from librosa.feature import mfcc as cepstra
    from scipy.fft import rfft

    power = np.abs(rfft(frames(vibration), axis=-1)) ** 2
    bands = melspectrogram(S=power.swapaxes(1, 2), sr=RATE_HZ, n_fft=FRAME, n_mels=COEFFICIENTS, power=2.0)
    return np.asarray(cepstra(S=decibels(bands), n_mfcc=COEFFICIENTS).swapaxes(1, 2))
