"""The feed-forward filter that makes an actuator's response flat (thesis 4.5.2; McMahan and Kuchenbecker 2014)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.devices.actuator.queue import RATE_HZ
from palpate.devices.actuator.response import Response, ResponseError
from palpate.signals.arrays import Array, Complex

TAPS = 256
GRID = 4096
GRID_HZ = np.arange(GRID // 2 + 1) * RATE_HZ / GRID
LEAST_SHARE = 0.1
"""Gain at 0 Hz relative to that at the band's lower edge: what lies below the band is not amplified in vain."""


@dataclass(frozen=True)
class Wish:
    """The band to make flat, and the gain that the filter may have at most, relative to its median one."""

    low_Hz: float = 20.0
    high_Hz: float = 450.0
    boost_dB: float = 24.0


@dataclass(frozen=True)
class Inverse:
    """Weights of a finite filter, so stable: volts for a wished acceleration. Figures hold for the measured response.

    `gain` is the response's median in the band, in units per volt. `ripple_dB` is how far the compensated response
    lies from flat at most, up or down, `before_dB` the same without the filter. `delay_ms` goes from a wish to its
    movement, the loop's own delay included; `added_ms` is the filter's part. `limited_Hz` are the lines in the band
    where the response is so small that the gain limit left it small.
    """

    taps: Array
    gain: float
    ripple_dB: float
    before_dB: float
    delay_ms: float
    added_ms: float
    limited_Hz: tuple[float, ...]


def invert(response: Response, wish: Wish) -> Inverse:
    """The minimum-phase filter whose gain is the regularised inverse of the response's: flat, and almost no delay.

    A hand feels a vibration's strength and not its phase, so the gain is made flat and the phase is left to be what
    costs least time. Each line is regularised by its squared standard error: what was not measured well is not
    amplified. Raises ResponseError where the band holds no response.
    """
    inside = response.inside(wish.low_Hz, wish.high_Hz)
    gain = float(np.median(np.abs(response.response[inside]))) if inside.any() else 0.0
    if not gain > 0:
        raise ResponseError(f"no response from {wish.low_Hz:g} to {wish.high_Hz:g} Hz to be made flat")
    hz, flat = response.hz[inside], response.response[inside] / gain
    size = np.abs(flat)
    wanted = size / (size**2 + (response.error[inside] / gain) ** 2)
    most = 10 ** (wish.boost_dB / 20)
    taps = minimum_phase(_everywhere(hz, np.minimum(wanted, most), wish.low_Hz))
    taps = taps * min(1.0, most / float(np.abs(np.fft.rfft(taps, GRID)).max()))
    limited = tuple(float(f) for f in hz[wanted > most])
    return _told(hz, flat, taps, gain, limited)


def _everywhere(hz: Array, wanted: Array, low_Hz: float) -> Array:
    """The gain on the whole grid: as at the band's edges beyond them, less towards 0 Hz."""
    return np.interp(GRID_HZ, hz, wanted) * np.clip(GRID_HZ / low_Hz, LEAST_SHARE, 1.0)


def minimum_phase(gain: Array) -> Array:
    """256 taps that have this gain on the grid and the least delay (Oppenheim and Schafer, 13.5: folded cepstrum)."""
    cepstrum = np.fft.irfft(np.log(np.maximum(gain, 1e-9)), GRID)
    cepstrum[1 : GRID // 2] *= 2
    cepstrum[GRID // 2 + 1 :] = 0
    whole: Array = np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), GRID)
    fade = np.ones(TAPS)
    fade[-TAPS // 4 :] = 0.5 + 0.5 * np.cos(np.pi * np.arange(TAPS // 4) / (TAPS // 4))
    return whole[:TAPS] * fade


def _told(hz: Array, flat: Complex, taps: Array, gain: float, limited: tuple[float, ...]) -> Inverse:
    reached = flat * gain_at(taps, hz)
    own, whole = _delay_ms(hz, flat), _delay_ms(hz, reached)
    ripple, before = _ripple_dB(reached), _ripple_dB(flat)
    return Inverse(taps / gain, gain, ripple, before, whole, whole - own, limited)


def gain_at(taps: Array, hz: Array) -> Complex:
    """A filter's response at these frequencies."""
    turns = np.exp(-2j * np.pi * np.outer(hz, np.arange(len(taps))) / RATE_HZ)
    return np.asarray(turns @ taps, dtype=np.complex128)


def _ripple_dB(response: Complex) -> float:
    return float(np.abs(20 * np.log10(np.maximum(np.abs(response), 1e-12))).max())


def _delay_ms(hz: Array, response: Complex) -> float:
    """Where the envelope of the band's impulse response is largest, to a tenth of a millisecond."""
    times_s = np.arange(0, GRID) / (10 * RATE_HZ)
    envelope = np.abs(np.exp(2j * np.pi * np.outer(times_s, hz)) @ response)
    return float(1000 * times_s[envelope.argmax()])
