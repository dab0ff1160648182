"""What a model is like that runs on its own output for a minute: its envelope, its cycles, its bounds."""

from __future__ import annotations

import numpy as np

from palpate.modeling.textures.metrics import level
from palpate.modeling.textures.recording import RATE_HZ, TextureDataError
from palpate.signals.arrays import Array

ENVELOPE_MS = 250
"""RMS in consecutive windows of so many milliseconds."""
CYCLE, LAGS_MS = 2000, (300, 1000)
"""Autocorrelation within windows of so many samples (2 s), at lags from 0.3 to 1 s."""
SHORTEST_MS = 900
"""A window shorter than this holds no autocorrelation at such lags worth the name."""
SOUNDS = 0.1
"""A window below this share of the whole signal's level counts as rest."""
GREATEST = 2.0
"""What is made may be at most so many times as great as the truth at its greatest."""


def envelope(signal: Array) -> Array:
    """RMS of a signal (n,) in consecutive windows of 250 ms; what is left over at the end is none."""
    size = round(ENVELOPE_MS * RATE_HZ / 1000)
    found: Array = np.sqrt(_windows(np.square(signal), size).mean(axis=1))
    return found


def slow(signal: Array) -> Array:
    """The means of a signal (n,) in the windows of `envelope`."""
    found: Array = _windows(signal, round(ENVELOPE_MS * RATE_HZ / 1000)).mean(axis=1)
    return found


def correlation(one: Array, other: Array) -> float | None:
    """Pearson's r of two rows (n,); None where there are fewer than three pairs, or where either does not vary."""
    if one.shape != other.shape:
        raise TextureDataError(f"rows of {one.shape} and {other.shape} have no correlation: one length is expected.")
    if len(one) < 3:
        return None
    off = [each - each.mean() for each in (one, other)]
    sizes = [float(np.linalg.norm(each)) for each in off]
    if any(size <= SAME * float(np.linalg.norm(each)) for size, each in zip(sizes, (one, other), strict=True)):
        return None
    return float(np.clip(off[0] @ off[1] / (sizes[0] * sizes[1]), -1.0, 1.0))


SAME = 1e-9
"""What varies by less than this of its size varies by rounding alone."""


def cycle(signal: Array, window: int = CYCLE) -> float | None:
    """How far a signal (n,) repeats itself: the greatest autocorrelation at lags of 0.3 to 1 s, 0 to 1.

    Within windows of 2 s (half overlapped, shorter for a shorter signal): at each lag, up to half the window, the
    products of samples so far apart over the root of both stretches' energies. The median over the windows that sound.
    A limit cycle comes near 1 even where its frequency moves with the hand; noise of a bandwidth B stays about
    (B * 1 s)^-1/2, and higher in shorter windows: compare what was found in equal ones. None for less than 0.9 s of
    signal, and for silence.
    """
    size = min(window, len(signal))
    whole = level(signal) if len(signal) else 0.0
    if size < round(SHORTEST_MS * RATE_HZ / 1000) or whole <= 0:
        return None
    starts = range(0, len(signal) - size + 1, max(1, size // 2))
    found = [_greatest(part) for at in starts if level(part := signal[at : at + size]) > SOUNDS * whole]
    return float(np.median(found)) if found else None


def _greatest(part: Array) -> float:
    """The greatest normalised autocorrelation of one window."""
    size = len(part)
    low, high = (round(each * RATE_HZ / 1000) for each in LAGS_MS)
    lags = np.arange(low, min(high, size // 2) + 1)
    spectrum = np.fft.rfft(part, 2 * size)
    products = np.fft.irfft(np.abs(spectrum) ** 2, 2 * size)[lags]
    energy = np.r_[0.0, np.cumsum(np.square(part))]
    sizes = np.sqrt(energy[size - lags] * (energy[size] - energy[lags]))
    return float(np.clip(np.max(products / np.maximum(sizes, np.finfo(float).tiny)), 0.0, 1.0))


def greatest_ratio(made: Array, truth: Array) -> float | None:
    """The greatest sample of what was made over the truth's; None where the truth is silent, infinite for no number."""
    most = float(np.abs(truth).max(initial=0.0))
    if most <= 0:
        return None
    return float(np.abs(made).max()) / most if np.isfinite(made).all() else float("inf")


def _windows(signal: Array, size: int) -> Array:
    count = len(signal) // size
    return signal[: count * size].reshape(count, size)
