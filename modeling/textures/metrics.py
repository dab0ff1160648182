"""How near one acceleration signal comes to another: in time, and in amplitude spectra (thesis 4.6.1)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from palpate.modeling.textures.recording import RATE_HZ, TextureDataError
from palpate.signals.arrays import Array

SMOOTHED = 256
"""Samples of the Hann windows whose spectra are averaged: 3.9 Hz apart, an equivalent noise bandwidth of 5.9 Hz."""
BLOCK = 1000
"""Samples of the blocks whose raw spectra are compared one by one."""


def demand_alike(one: Array, other: Array) -> None:
    """Raises TextureDataError where two signals are not (n,) of one length, empty, or not finite."""
    if one.ndim != 1 or one.shape != other.shape or not one.size:
        raise TextureDataError(f"signals of shape {one.shape} and {other.shape}: two of one length (n,) are expected.")
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise TextureDataError("a signal holds a number that is not finite: nothing can be said of it.")


def mae(actual: Array, answered: Array) -> float:
    """The mean absolute difference of two signals (n,), in their unit."""
    demand_alike(actual, answered)
    return float(np.mean(np.abs(actual - answered)))


def explained(actual: Array, answered: Array) -> float | None:
    """The share of the variance that an answer explains, at most 1; None where nothing varies."""
    demand_alike(actual, answered)
    whole = float(np.sum((actual - actual.mean()) ** 2))
    return None if whole <= 0 else 1 - float(np.sum((actual - answered) ** 2)) / whole


def level(signal: Array) -> float:
    """The RMS of a signal (n,), in its unit."""
    return float(np.sqrt(np.mean(np.square(signal))))


def level_ratio(made: Array, truth: Array) -> float | None:
    """RMS of what was made over that of the truth; None where the truth is silent."""
    whole = level(truth)
    return None if whole <= 0 else level(made) / whole


def goodness(one: Array, other: Array) -> float | None:
    """Equation 4.11 for two amplitude spectra (k,): the cosine of the angle between them, 0 to 1, blind to level.

    None where either is nothing at all (Hernandez-Andres, Romero and Lee 2001).
    """
    sizes = [float(np.linalg.norm(each)) for each in (one, other)]
    if min(sizes) <= 0:
        return None
    return min(1.0, float(np.abs(np.dot(one / sizes[0], other / sizes[1]))))


def gfc(actual: Array, answered: Array) -> float | None:
    """Equation 4.11 over the raw DFT amplitudes of two whole signals (n,), 0 to 1."""
    demand_alike(actual, answered)
    return goodness(np.abs(np.fft.rfft(actual)), np.abs(np.fft.rfft(answered)))


def raw_gfc(truth: Array, made: Array) -> float | None:
    """The mean of equation 4.11 over blocks of 1 s, raw DFT amplitudes; None where no block sounds in both."""
    demand_alike(truth, made)
    pairs = zip(blocks(truth, BLOCK), blocks(made, BLOCK), strict=True)
    found = [each for a, b in pairs if (each := gfc(a, b)) is not None]
    return float(np.mean(found)) if found else None


def smoothed_gfc(truth: Array, made: Array) -> float | None:
    """Equation 4.11 over the square roots of Welch spectra (`density`), so over signals of any two lengths, 0 to 1."""
    one, other = (np.sqrt(density(each)[1]) for each in (truth, made))
    return goodness(one, other)


def density(signal: Array) -> tuple[Array, Array]:
    """Frequencies (Hz) and power spectral density (unit^2/Hz) by Welch's method, both (129,).

    Hann windows of 256 samples, half overlapped, nothing subtracted. Raises TextureDataError for fewer samples.
    """
    from scipy.signal import welch

    if signal.ndim != 1 or len(signal) < SMOOTHED or not np.isfinite(signal).all():
        raise TextureDataError(f"a spectrum needs {SMOOTHED} finite samples; {signal.shape} were found.")
    hertz, found = welch(signal, RATE_HZ, nperseg=SMOOTHED, noverlap=SMOOTHED // 2, detrend=False)
    return hertz, found


def blocks(signal: Array, size: int) -> Iterator[Array]:
    """Consecutive blocks of `size` samples (what is left over at the end is none), or the whole where it is shorter."""
    if len(signal) < size:
        yield signal
        return
    yield from (signal[start : start + size] for start in range(0, len(signal) - size + 1, size))


def mean_of(values: Iterable[float | None]) -> float | None:
    """The mean of the numbers among them; None where there are none."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
