"""Zero-phase filters for vibrations that a tool felt on a texture, and for the hand that moved it (thesis 4.3.3).

Simulated surfaces of `devices` and the data of models in `modeling` are filtered alike.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.protocols.wording import count
from palpate.signals.arrays import Array

BAND_HZ = (20.0, 1000.0)
"""Band of the vibration: above gravity and the hand's movement, below the noise."""
HAND_HZ = 25.0
"""Edge for speed and force: the hand makes no faster changes."""
NYQUIST_SHARE = 0.98
"""An upper edge at or above this share of half the rate has no effect and is left out."""
BAND_ORDER, HAND_ORDER = 4, 2
"""Orders of the Butterworth filters, per pass. The hand's is low so that a step of force overshoots by only 0.02."""
PADS = 3.0
"""Periods of an edge by which a signal is extended at its ends, mirrored about its last value."""


class SignalError(ValueError):
    """Signals that cannot be filtered or mapped to one axis; the message says what was found and what is expected."""


def demand_finite(signal: Array, least: int = 2) -> None:
    """Raise SignalError for fewer than `least` samples or a number that is not finite."""
    if signal.shape[0] < least:
        raise SignalError(f"{count(signal.shape[0], 'sample')}: at least {least} are needed")
    bad = np.argwhere(~np.isfinite(signal))
    if bad.size:
        place = tuple(bad[0])
        raise SignalError(f"sample {int(place[0]) + 1} is {signal[place]}: finite numbers are needed")


def low_pass(signal: Array, rate_hz: float, edge_hz: float = HAND_HZ, order: int = HAND_ORDER) -> Array:
    """Return the signal, (n,) or (n, channels), below an edge; zero-phase, 3 dB down at the edge over both passes.

    An edge at or above 0.98 of half the rate leaves the signal as it is. Raises SignalError.
    """
    demand_finite(signal)
    _demand_rate(rate_hz, edge_hz)
    if edge_hz >= NYQUIST_SHARE * rate_hz / 2:
        return signal.copy()
    start = np.asarray(signal[0], np.float64)  # far from zero no digits are lost
    return np.asarray(_both_ways(signal - start, rate_hz, edge_hz, "low", order) + start)


def band_pass(signal: Array, rate_hz: float, band_hz: tuple[float, float] = BAND_HZ, order: int = BAND_ORDER) -> Array:
    """Return the signal, (n,) or (n, channels), between two edges; zero-phase, 3 dB down at each over both passes.

    At or above 0.98 of half the rate the upper edge is left out (`has_upper_edge`), which leaves a high-pass. Raises
    SignalError, also where the lower edge is not below half the rate.
    """
    demand_finite(signal)
    low, high = band_hz
    _demand_rate(rate_hz, low)
    if not 0 < low < min(high, NYQUIST_SHARE * rate_hz / 2):
        raise SignalError(f"a band from {low:g} to {high:g} Hz at {rate_hz:g} Hz: there is no such band")
    away = np.asarray(signal, np.float64) - signal[0]  # a constant is silent exactly, however far from zero
    filtered = _both_ways(away - away.mean(axis=0), rate_hz, low, "high", order)
    return _both_ways(filtered, rate_hz, high, "low", order) if has_upper_edge(rate_hz, high) else filtered


def has_upper_edge(rate_hz: float, edge_hz: float = BAND_HZ[1]) -> bool:
    """Return whether an upper edge has any effect at that rate (the contradiction of thesis 3.4.1 and 4.3.3)."""
    return edge_hz < NYQUIST_SHARE * rate_hz / 2


def _both_ways(signal: Array, rate_hz: float, edge_hz: float, kind: str, order: int) -> Array:
    from scipy.signal import butter, sosfiltfilt

    warped = math.tan(math.pi * edge_hz / rate_hz)
    # Each pass is 1.5 dB down at the edge, so that both are 3 dB down there: the design's own edge moves by this.
    moved = (math.sqrt(2.0) - 1.0) ** (1 / (2 * order))
    own = warped / moved if kind == "low" else warped * moved
    sections = butter(order, 2 * math.atan(own) / math.pi, kind, output="sos")
    pad = min(signal.shape[0] - 1, math.ceil(PADS * rate_hz / edge_hz))
    return np.asarray(sosfiltfilt(sections, signal, axis=0, padlen=pad))


def _demand_rate(rate_hz: float, edge_hz: float) -> None:
    if not (math.isfinite(rate_hz) and rate_hz > 0 and edge_hz > 0):
        raise SignalError(f"{rate_hz} samples a second and an edge of {edge_hz} Hz: numbers above 0 are expected")
