"""Three axes of vibration combined into one: DFT321, spectrum by spectrum (thesis 4.3.3; Landin et al. 2010).

The spectrum of a whole exploration holds no times: each frequency is scaled by one number, which rings from end to end
and spreads the energy of fast strokes into rests. So explorations are mapped in short frames (`one_axis`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from palpate.signals.arrays import Array
from palpate.signals.filters import SignalError, demand_finite

FRAME_S = 0.064
"""Long enough to separate 20 Hz from its neighbours, short enough for a hand's movement; docs/reference/texture-data.md
has the errors at other lengths.
"""


def dft321(axes: Array) -> Array:
    """Return several axes (n, k) combined into one (n,) by one spectrum: the energy of all, the phase of their sum.

    |A(f)| is the root of the axes' summed squares, so that energy is kept; its phase is that of the sum of the axes
    (Landin, Romano, McMahan and Kuchenbecker 2010); 0 where they cancel out. A single axis is returned as it is. Remove
    gravity first. Raises SignalError.
    """
    if axes.ndim != 2 or axes.shape[1] < 1:
        raise SignalError(f"axes of shape {axes.shape}: (samples, axes) are expected")
    demand_finite(axes, least=1)
    return np.array(axes[:, 0]) if axes.shape[1] == 1 else _mapped(axes)


def one_axis(axes: Array, rate_hz: float, frame_s: float = FRAME_S) -> Array:
    """Return several axes (n, k) combined into one (n,) by DFT321 in frames that overlap by half.

    Energy is kept where and when it was. Frames are weighted by half a sine before and after, so that a single axis is
    returned unchanged. The energy lost by the overlap is restored, frame by frame and then in total, to that of the
    axes. Raises SignalError.
    """
    if axes.ndim == 2 and axes.shape[1] == 1:
        return dft321(axes)
    frame = 2 * max(1, round(frame_s * rate_hz / 2))
    if axes.ndim != 2 or len(axes) <= frame:
        return dft321(axes)
    demand_finite(axes)
    scale = 2.0 ** math.frexp(float(np.abs(axes).max()))[1]  # a power of two: exact, and no square overflows
    scaled = axes / scale
    signal = _overlapped(scaled, frame)
    target, actual = (_nearby(power, frame) for power in ((scaled**2).sum(axis=1), signal**2))
    signal *= np.sqrt(np.divide(target, actual, out=np.ones_like(actual), where=actual > TINY * actual.max()))
    energy = float((signal**2).sum())
    whole = math.sqrt(float((scaled**2).sum()) / energy) if energy else 1.0
    return np.asarray(signal * whole * scale)


TINY = 1e-20
"""Power below this share of the largest is rounding and is not amplified."""


def _overlapped(axes: Array, frame: int) -> Array:
    half = frame // 2
    weight = np.sin(math.pi * (np.arange(frame) + 0.5) / frame)
    padded = np.pad(axes, ((half, 2 * frame), (0, 0)))
    pieces = sliding_window_view(padded, frame, axis=0)[::half].transpose(0, 2, 1) * weight[:, None]
    mapped = _mapped(pieces) * weight
    signal = np.zeros(half * (len(pieces) + 1))
    for number, piece in enumerate(mapped):
        signal[number * half : number * half + frame] += piece
    return signal[half : half + len(axes)]


def _mapped(axes: Array) -> Array:
    """Map axes (..., n, k) to one (..., n)."""
    largest = float(np.abs(axes).max())
    scale = 2.0 ** math.frexp(largest)[1] if largest else 1.0
    spectra = np.fft.rfft(axes / scale, axis=-2)
    size = np.sqrt((spectra.real**2 + spectra.imag**2).sum(axis=-1))
    total = spectra.sum(axis=-1)
    length = np.abs(total)
    none = length == 0
    direction = np.where(none, 1.0, total / np.where(none, 1.0, length))
    return np.asarray(np.fft.irfft(size * direction, axes.shape[-2], axis=-1) * scale)


def _nearby(power: Array, frame: int) -> Array:
    """Return the mean of the power within half a frame to either side, the nearest weighing most."""
    weight = np.hanning(frame + 1)[1:]
    return np.maximum(np.convolve(power, weight / weight.sum(), "same"), 0.0)
