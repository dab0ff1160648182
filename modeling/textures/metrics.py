"""Scores of acceleration signals: in time, in spectra (thesis 4.6.1), by perception, and in a free run of a minute."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from palpate.modeling.textures.recording import RATE_HZ, TextureDataError
from palpate.signals.arrays import Array
from palpate.signals.vibration_threshold import BANDS_HZ, band_edges_hz, threshold_m_s2

SMOOTHED = 256
"""Samples of the Hann windows whose spectra are averaged: 3.9 Hz apart, equivalent noise bandwidth 5.9 Hz."""
BLOCK = 1000
"""Samples of the blocks whose raw spectra are compared one by one."""
ENVELOPE_MS = 250
"""Milliseconds of the consecutive windows whose RMS is the envelope."""
CYCLE, LAGS_MS = 2000, (300, 1000)
"""Samples of the windows of the autocorrelation (2 s), and its range of lags (0.3 to 1 s)."""
SHORTEST_MS = 900
"""A shorter window gives no meaningful autocorrelation at such lags."""
SOUNDS = 0.1
"""A window below this share of the whole signal's level counts as rest."""
GREATEST = 2.0
"""The greatest ratio of a generated signal's peak to the truth's."""
SAME = 1e-9
"""Variation below this share of the size is rounding."""


def demand_alike(one: Array, other: Array) -> None:
    """Raise TextureDataError unless two signals are (n,) of one length, not empty, and finite."""
    if one.ndim != 1 or one.shape != other.shape or not one.size:
        raise TextureDataError(f"signals of shape {one.shape} and {other.shape}: two of one length (n,) are expected.")
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise TextureDataError("a signal holds a number that is not finite: it cannot be analysed.")


def mae(actual: Array, answered: Array) -> float:
    """Return the mean absolute difference of two signals (n,), in their unit."""
    demand_alike(actual, answered)
    return float(np.mean(np.abs(actual - answered)))


def explained(actual: Array, answered: Array) -> float | None:
    """Return the share of the variance that a prediction explains, at most 1; None where nothing varies."""
    demand_alike(actual, answered)
    whole = float(np.sum((actual - actual.mean()) ** 2))
    return None if whole <= 0 else 1 - float(np.sum((actual - answered) ** 2)) / whole


def level(signal: Array) -> float:
    """Return the RMS of a signal (n,), in its unit."""
    return float(np.sqrt(np.mean(np.square(signal))))


def level_ratio(generated: Array, truth: Array) -> float | None:
    """Return the RMS of a generated signal over that of the truth; None where the truth is silent."""
    whole = level(truth)
    return None if whole <= 0 else level(generated) / whole


def goodness(one: Array, other: Array) -> float | None:
    """Return equation 4.11 for two amplitude spectra (k,): the cosine of their angle, 0 to 1, independent of level.

    None where either is zero (Hernandez-Andres, Romero and Lee 2001).
    """
    sizes = [float(np.linalg.norm(signal)) for signal in (one, other)]
    if min(sizes) <= 0:
        return None
    return min(1.0, float(np.abs(np.dot(one / sizes[0], other / sizes[1]))))


def gfc(actual: Array, answered: Array) -> float | None:
    """Return equation 4.11 over the raw DFT amplitudes of two whole signals (n,), 0 to 1."""
    demand_alike(actual, answered)
    return goodness(np.abs(np.fft.rfft(actual)), np.abs(np.fft.rfft(answered)))


def raw_gfc(truth: Array, generated: Array) -> float | None:
    """Return the mean of equation 4.11 over blocks of 1 s, raw DFT amplitudes; None if all are silent in one."""
    demand_alike(truth, generated)
    pairs = zip(blocks(truth, BLOCK), blocks(generated, BLOCK), strict=True)
    values = [share for a, b in pairs if (share := gfc(a, b)) is not None]
    return float(np.mean(values)) if values else None


def smoothed_gfc(truth: Array, generated: Array) -> float | None:
    """Return equation 4.11 over the square roots of Welch spectra (`density`) of signals of any length, 0 to 1."""
    one, other = (np.sqrt(density(signal)[1]) for signal in (truth, generated))
    return goodness(one, other)


def density(signal: Array) -> tuple[Array, Array]:
    """Return frequencies (Hz) and power spectral density (unit^2/Hz) by Welch's method, both (129,).

    Hann windows of 256 samples, half overlapped, nothing subtracted. Raises TextureDataError for fewer samples.
    """
    from scipy.signal import welch

    if signal.ndim != 1 or len(signal) < SMOOTHED or not np.isfinite(signal).all():
        raise TextureDataError(f"a spectrum needs {SMOOTHED} finite samples; {signal.shape} were found.")
    hertz, power = welch(signal, RATE_HZ, nperseg=SMOOTHED, noverlap=SMOOTHED // 2, detrend=False)
    return hertz, power


def blocks(signal: Array, size: int) -> Iterator[Array]:
    """Yield consecutive blocks of `size` samples without the remainder, or the whole signal where it is shorter."""
    if len(signal) < size:
        yield signal
        return
    yield from (signal[start : start + size] for start in range(0, len(signal) - size + 1, size))


def mean_of(values: Iterable[float | None]) -> float | None:
    """Return the mean of the numbers among them; None where there are none."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def felt_levels(signal: Array) -> Array:
    """Return the level (bands,), in dB above threshold and at least 0, of each third octave of an acceleration (n,).

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
    """Return the share (bands, bins) of each bin of a spectrum within each third octave; bins are evenly spaced."""
    step = float(hertz[1])
    edges = np.array([band_edges_hz(middle) for middle in BANDS_HZ])
    low, high = edges[:, :1], edges[:, 1:]
    within = np.minimum(hertz + step / 2, high) - np.maximum(hertz - step / 2, low)
    return np.asarray(np.clip(within / step, 0.0, 1.0))


def felt_distance(truth: Array, generated: Array) -> float:
    """Return the RMS difference in dB between the two signals' levels above the threshold, over all third octaves.

    0 where no third octave differs in level; imperceptible levels count as the threshold.
    """
    off = felt_levels(truth) - felt_levels(generated)
    return float(np.sqrt(np.mean(off**2)))


def envelope(signal: Array) -> Array:
    """Return the RMS of a signal (n,) in consecutive windows of 250 ms, without the remainder."""
    size = round(ENVELOPE_MS * RATE_HZ / 1000)
    result: Array = np.sqrt(_windows(np.square(signal), size).mean(axis=1))
    return result


def slow(signal: Array) -> Array:
    """Return the means of a signal (n,) in the windows of `envelope`."""
    result: Array = _windows(signal, round(ENVELOPE_MS * RATE_HZ / 1000)).mean(axis=1)
    return result


def correlation(one: Array, other: Array) -> float | None:
    """Return Pearson's r of two rows (n,); None for fewer than three pairs, or where either does not vary."""
    if one.shape != other.shape:
        raise TextureDataError(f"rows of {one.shape} and {other.shape} have no correlation: one length is expected.")
    if len(one) < 3:
        return None
    off = [signal - signal.mean() for signal in (one, other)]
    sizes = [float(np.linalg.norm(signal)) for signal in off]
    if any(size <= SAME * float(np.linalg.norm(signal)) for size, signal in zip(sizes, (one, other), strict=True)):
        return None
    return float(np.clip(off[0] @ off[1] / (sizes[0] * sizes[1]), -1.0, 1.0))


def cycle(signal: Array, window: int = CYCLE) -> float | None:
    """Return how far a signal (n,) repeats itself: the greatest autocorrelation at lags of 0.3 to 1 s, 0 to 1.

    Within windows of 2 s (half overlapped, shorter for a shorter signal): at each lag, up to half the window, the
    products of samples so far apart over the root of both stretches' energies. The median over the windows that sound.
    A limit cycle comes near 1 even where its frequency moves with the hand; noise of a bandwidth B stays about (B * 1
    s)^-1/2, and higher in shorter windows, so only results of equal windows can be compared. None for less than 0.9 s
    of signal, and for silence.
    """
    size = min(window, len(signal))
    whole = level(signal) if len(signal) else 0.0
    if size < round(SHORTEST_MS * RATE_HZ / 1000) or whole <= 0:
        return None
    starts = range(0, len(signal) - size + 1, max(1, size // 2))
    greatest = [
        _greatest_autocorrelation(part) for at in starts if level(part := signal[at : at + size]) > SOUNDS * whole
    ]
    return float(np.median(greatest)) if greatest else None


def _greatest_autocorrelation(part: Array) -> float:
    """Return the greatest normalised autocorrelation of one window."""
    size = len(part)
    low, high = (round(lag_ms * RATE_HZ / 1000) for lag_ms in LAGS_MS)
    lags = np.arange(low, min(high, size // 2) + 1)
    spectrum = np.fft.rfft(part, 2 * size)
    products = np.fft.irfft(np.abs(spectrum) ** 2, 2 * size)[lags]
    energy = np.r_[0.0, np.cumsum(np.square(part))]
    sizes = np.sqrt(energy[size - lags] * (energy[size] - energy[lags]))
    return float(np.clip(np.max(products / np.maximum(sizes, np.finfo(float).tiny)), 0.0, 1.0))


def greatest_ratio(generated: Array, truth: Array) -> float | None:
    """Return the greatest sample over the truth's; None where the truth is silent, infinity for NaN."""
    most = float(np.abs(truth).max(initial=0.0))
    if most <= 0:
        return None
    return float(np.abs(generated).max()) / most if np.isfinite(generated).all() else float("inf")


def _windows(signal: Array, size: int) -> Array:
    count = len(signal) // size
    return signal[: count * size].reshape(count, size)
