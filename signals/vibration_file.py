"""Recorded or synthesised vibrations in files, in m/s^2: WAV of floating-point samples, or npz."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from palpate.protocols.files import file_sha256
from palpate.signals.arrays import Array

KEYS = ("m_s2", "rate_hz")
"""The arrays of an npz file: samples of shape (n,), and their rate."""


def read_acceleration(path: Path, sha256: str | None = None) -> tuple[Array, float]:
    """Return the samples in m/s^2, of shape (n,), and their rate in Hz.

    A WAV file has one channel of 32- or 64-bit floating point, because integers have no unit. Raises ValueError that
    says what was found, without the file's name.
    """
    if not path.is_file():
        raise ValueError(f"a WAV or npz file is expected, and there is no file {path}")
    if sha256 is not None and file_sha256(path) != sha256:
        raise ValueError("the file that the session was planned with is expected, and its SHA-256 differs")
    samples, rate_hz = _npz(path) if path.suffix == ".npz" else _wav(path)
    if samples.ndim != 1 or len(samples) < 2 or not np.isfinite(samples).all():
        raise ValueError(f"one channel of finite samples is expected, found an array of shape {samples.shape}")
    if not 100 <= rate_hz <= 1_000_000:
        raise ValueError(f"a rate of 100 to 1000000 Hz is expected, found {rate_hz:g}")
    return samples, rate_hz


def _npz(path: Path) -> tuple[Array, float]:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return np.asarray(arrays[KEYS[0]], np.float64), float(np.asarray(arrays[KEYS[1]]).item())
    except (KeyError, ValueError, OSError, zipfile.BadZipFile) as error:
        raise ValueError(f"an npz file with the arrays {' and '.join(KEYS)} is expected ({error})") from None


def _wav(path: Path) -> tuple[Array, float]:
    from scipy.io import wavfile

    try:
        rate_hz, samples = wavfile.read(path)
    except (ValueError, OSError) as error:
        raise ValueError(f"a WAV file is expected ({error})") from None
    if samples.dtype.kind != "f":
        raise ValueError(f"floating-point samples in m/s^2 are expected, found {samples.dtype}, which has no unit")
    return np.asarray(samples, np.float64), float(rate_hz)


def resampled_in_band(samples: Array, count: int, rate_hz: float, low_hz: float, high_hz: float) -> Array:
    """Return the samples' lines from `low_hz` to `high_hz` as `count` samples at another rate; exact for one period."""
    lines = np.fft.rfft(samples - samples.mean()) * (count / len(samples))
    hz = np.arange(len(lines)) * rate_hz / count
    wide = np.zeros(count // 2 + 1, dtype=np.complex128)
    most = min(len(lines), len(wide))
    inside = (hz[:most] >= low_hz) & (hz[:most] <= high_hz)
    wide[:most][inside] = lines[:most][inside]
    return np.asarray(np.fft.irfft(wide, count), np.float64)
