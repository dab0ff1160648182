"""Resample from the scene's own rate to any rate of a sensor: band-limited first, then interpolated."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from palpate.signals.arrays import Array

BAND_HZ = (1800.0, 2200.0)
"""A scene keeps frequencies below the first and nothing above the second."""
SHARE = (0.38, 0.5)
"""The same for a slow sensor, in shares of its rate."""
STOP_DB = 70.0
POINTS = 10
"""Number of samples of the interpolation (Lagrange)."""


def at_rate(pieces: Iterator[Array], internal_hz: float, rate_hz: float) -> Iterator[Array]:
    """Yield rows (n, channels) at a rate from endless pieces at the internal rate, beginning at the same time.

    Before the first row the signal counts as equal to it. There is no delay: the filter is symmetric and looks ahead.
    """
    taps = low_pass(internal_hz, rate_hz)
    thin = max(1, int(internal_hz / (8 * min(rate_hz, internal_hz / 8))))
    return _between(_thinned(pieces, taps, thin), internal_hz / thin, rate_hz)


def low_pass(internal_hz: float, rate_hz: float) -> Array:
    """Return a symmetric filter of odd length (Kaiser window) that keeps the band a sensor of this rate can show."""
    from scipy.signal import firwin, kaiserord

    low, high = (min(share * rate_hz, band) for share, band in zip(SHARE, BAND_HZ, strict=True))
    count, beta = kaiserord(STOP_DB, 2 * (high - low) / internal_hz)
    return np.asarray(firwin(count | 1, (low + high) / 2, window=("kaiser", beta), fs=internal_hz), dtype=np.float64)


def _thinned(pieces: Iterator[Array], taps: Array, thin: int) -> Iterator[Array]:
    """Yield the filtered pieces with only every `thin`-th row."""
    from scipy.signal import oaconvolve

    buffer, skip = None, 0
    for piece in pieces:
        buffer = np.concatenate([np.repeat(piece[:1], len(taps) // 2, axis=0) if buffer is None else buffer, piece])
        if len(buffer) < len(taps):
            continue
        smooth = oaconvolve(buffer, taps[:, np.newaxis], mode="valid", axes=0)
        yield smooth[skip::thin]
        skip = (skip - len(smooth)) % thin
        buffer = buffer[len(smooth) :]


def _between(pieces: Iterator[Array], have_hz: float, want_hz: float) -> Iterator[Array]:
    """Yield rows interpolated at the requested rate; the rows before the first count as equal to it."""
    before = POINTS // 2 - 1
    buffer, start, row = None, -before, 0
    step = have_hz / want_hz
    for piece in pieces:
        buffer = np.concatenate([np.repeat(piece[:1], before, axis=0) if buffer is None else buffer, piece])
        last = math.floor((start + len(buffer) - POINTS + before) / step)
        if last < row:
            continue
        # Lagrange's polynomial through the points around each place.
        places = np.arange(row, last + 1, dtype=np.float64) * step - start
        whole = np.floor(places).astype(np.int64)
        first = whole - (POINTS // 2 - 1)
        values = np.zeros((len(places), buffer.shape[1]))
        for point, weight in enumerate(weights(places - whole)):
            values += weight[:, np.newaxis] * buffer[first + point]
        yield values
        row = last + 1
        drop = min(max(0, math.floor(row * step) - before - start), len(buffer))
        buffer, start = buffer[drop:], start + drop


def weights(share: Array) -> list[Array]:
    """Return the weights of the interpolation points, at `share` of a step after the middle point."""
    offsets = [n - (POINTS // 2 - 1) for n in range(POINTS)]
    away = [share - offset for offset in offsets]
    factors = []
    for n, one in enumerate(offsets):
        rest = math.prod(one - other for other in offsets if other != one)
        product = np.full_like(share, 1 / rest)
        for m, factor in enumerate(away):
            if m != n:
                product = product * factor
        factors.append(product)
    return factors
