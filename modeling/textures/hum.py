"""Mains hum: lines at multiples of 50 or 60 Hz that keep their phase are found, and taken out by notches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modeling.textures.recording import Array

MAINS_HZ = (50.0, 60.0)
WANDERS = 0.004
"""Share by which mains frequency may differ from nominal: +-0.2 Hz of 50 (EN 50160 allows 1 %, for 99.5 % of time)."""
STANDS_OUT, BESIDE = 16.0, 6.0
"""A line has this many times the power that lies around it; less where another one of the same mains is clear."""
STEADY = 0.6
"""Mean agreement of amplitude and phase between neighbouring segments: 1 for a steady line, about 0 for noise."""
SEGMENTS, SEGMENT_S = 4, 0.4
"""At most so many segments, none shorter."""
AROUND_HZ = 8.0
NOTCH_HZ = 2.0
"""Width of a notch where it is 3 dB down."""
SHORTEST_S = 1.0
"""In less, a line of hum is as wide as what it should be told from."""
FINER = 8
"""The spectrum is computed at so many points per resolution."""
USED, MULTIPLES = 0.48, 5
"""Share of the rate up to which lines are looked for; multiples that the mains' frequency is told by."""


@dataclass(frozen=True)
class Line:
    """A line of hum: its frequency, RMS in m/s^2, and power over that of what lies around it."""

    frequency_hz: float
    rms_m_s2: float
    stands_out: float


@dataclass(frozen=True)
class Hum:
    """The lines that were taken out, nominal frequency of their mains, and their notches' share of the power."""

    mains_hz: float
    lines: tuple[Line, ...]
    removed_rms_m_s2: float
    removed_share: float

    def note(self) -> str:
        """What was done, in a sentence."""
        at = ", ".join(f"{line.frequency_hz:.2f}" for line in self.lines)
        return (
            f"mains hum of {self.mains_hz:g} Hz found and removed at {at} Hz by notches {NOTCH_HZ:g} Hz wide:"
            f" {self.removed_rms_m_s2:.3g} m/s^2 RMS, {self.removed_share:.1%} of the power; whatever the texture had"
            " within them is gone as well"
        )


def without_hum(vibration: Array, rate_hz: float) -> tuple[Array, Hum | None]:
    """An acceleration (n,) or axes (n, k) without mains hum, and what was removed; None where there is none.

    Hum is lines at whole multiples of one frequency near 50 or 60 Hz that stand out at least 12 dB from what lies
    within 8 Hz and keep amplitude and phase from one quarter of the recording to the next. A texture's own content,
    even there, changes with the hand; where the hand was driven at one speed over a regular pattern it might not, so
    the notes say what was taken. Recordings below 1 s are left as they are.
    """
    axes = vibration[:, None] if vibration.ndim == 1 else vibration
    if len(axes) < SHORTEST_S * rate_hz or not axes.any():
        return vibration, None
    found = [(mains, _lines(axes, rate_hz, mains)) for mains in MAINS_HZ]
    mains, lines = max(found, key=lambda each: sum(line.rms_m_s2**2 for line in each[1]))
    if not lines:
        return vibration, None
    clean = notched(axes, rate_hz, [line.frequency_hz for line in lines])
    taken = float(np.sqrt(((axes - clean) ** 2).sum(axis=1).mean()))
    whole = float(((axes - axes.mean(axis=0)) ** 2).sum(axis=1).mean())
    return clean.reshape(vibration.shape), Hum(mains, lines, taken, taken**2 / whole)


def notched(axes: Array, rate_hz: float, frequencies_hz: Sequence[float]) -> Array:
    """(n, k) without what lies within `NOTCH_HZ` about each frequency, without delay.

    The steady part of each line is fitted and taken off first, so that the notches have nothing to ring with at the
    ends of a short recording.
    """
    from scipy.signal import filtfilt, iirnotch

    found = axes - _steady_part(axes, rate_hz, frequencies_hz)
    for frequency_hz in frequencies_hz:
        # Both ways together are 3 dB down where each is 1.5 dB down: a notch of width b is so at 0.64 b.
        width = NOTCH_HZ * math.sqrt(math.sqrt(2.0) - 1.0)
        b, a = iirnotch(frequency_hz, frequency_hz / width, rate_hz)
        pad = min(len(found) - 1, math.ceil(rate_hz / NOTCH_HZ))
        found = np.asarray(filtfilt(b, a, found, axis=0, padlen=pad))
    return found


def _steady_part(axes: Array, rate_hz: float, frequencies_hz: Sequence[float]) -> Array:
    """The least-squares sum of steady sines of these frequencies."""
    angle = 2 * math.pi * np.outer(np.arange(len(axes)) / rate_hz, frequencies_hz)
    waves = np.hstack([np.cos(angle), np.sin(angle), np.ones((len(axes), 1))])
    weights = np.linalg.lstsq(waves, axes, rcond=None)[0]
    return np.asarray(waves[:, :-1] @ weights[:-1])


@dataclass(frozen=True)
class _Spectrum:
    """Power (half a sine's squared amplitude, all axes together) every `step_hz`, Hann-windowed, finely padded."""

    power: Array
    step_hz: float
    resolution_hz: float

    def at(self, frequency_hz: Array) -> Array:
        """The power at frequencies, by the nearest that was computed."""
        return np.asarray(self.power[np.rint(frequency_hz / self.step_hz).astype(int)])

    def floor(self, near_hz: float) -> float:
        """The mean power of noise around a frequency, from the median beside it (ln 2 of an exponential's mean)."""
        apart = max(3.0 * self.resolution_hz, NOTCH_HZ / 2)
        beside = np.linspace(apart, AROUND_HZ, 48)
        return float(np.median(self.at(near_hz + np.r_[-beside, beside]))) / math.log(2) + np.finfo(float).tiny

    def peak(self, near_hz: float) -> tuple[float, float]:
        """Frequency and power of the highest point within half the resolution, between points by a parabola."""
        reach = max(1, round(0.5 * self.resolution_hz / self.step_hz))
        first = round(near_hz / self.step_hz) - reach
        top = first + int(np.argmax(self.power[first : first + 2 * reach + 1]))
        left, middle, right = np.log(self.power[top - 1 : top + 2] + np.finfo(float).tiny)
        bend = left - 2 * middle + right
        moved = 0.5 * (left - right) / bend if bend < 0 else 0.0
        return (top + float(np.clip(moved, -0.5, 0.5))) * self.step_hz, float(self.power[top])


def _spectrum(axes: Array, rate_hz: float) -> _Spectrum:
    n = len(axes)
    taper = np.hanning(n + 2)[1:-1]
    points = 2 ** math.ceil(math.log2(n * FINER))
    found = np.fft.rfft((axes - axes.mean(axis=0)) * (taper / taper.sum())[:, None], points, axis=0)
    return _Spectrum((np.abs(found) ** 2).sum(axis=1), rate_hz / points, rate_hz / n)


def _lines(axes: Array, rate_hz: float, mains_hz: float) -> tuple[Line, ...]:
    """The multiples of one frequency near the mains' at which a line stands; beside a clear one, fainter ones too."""
    seen = _spectrum(axes, rate_hz)
    own_hz = _own_frequency(seen, rate_hz, mains_hz)
    found = [_line(seen, multiple * own_hz) for multiple in range(1, int(USED * rate_hz / mains_hz) + 1)]
    steady = [line for line in found if line.stands_out >= BESIDE and _steadiness(axes, rate_hz, line) >= STEADY]
    return tuple(steady) if any(line.stands_out >= STANDS_OUT for line in steady) else ()


def _own_frequency(seen: _Spectrum, rate_hz: float, mains_hz: float) -> float:
    """Of the frequencies that the mains may have, the one whose multiples stand out most."""
    reach = WANDERS * mains_hz
    tried = np.linspace(mains_hz - reach, mains_hz + reach, 2 * math.ceil(MULTIPLES * reach / seen.step_hz) + 1)
    used = [each for each in range(1, MULTIPLES + 1) if each * mains_hz < USED * rate_hz]
    score = sum(seen.at(each * tried) / seen.floor(each * mains_hz) for each in used)
    return float(tried[int(np.argmax(score))])


def _line(seen: _Spectrum, near_hz: float) -> Line:
    frequency_hz, power = seen.peak(near_hz)
    return Line(frequency_hz, math.sqrt(2 * power), power / seen.floor(near_hz))


def _steadiness(axes: Array, rate_hz: float, line: Line) -> float:
    """How far amplitude and phase of one stretch go on in the next, 0 to 1; slow drift of the mains does not count."""
    turns: NDArray[np.complex128] = np.exp(-2j * math.pi * line.frequency_hz * np.arange(len(axes)) / rate_hz)
    count = min(SEGMENTS, max(2, int(len(axes) / (SEGMENT_S * rate_hz))))
    each = np.stack([part.mean(axis=0) for part in np.array_split(axes * turns[:, None], count)])
    agreed = (each[1:] * each[:-1].conj()).sum()
    size = 0.5 * (np.abs(each[1:]) ** 2 + np.abs(each[:-1]) ** 2).sum()
    return float(agreed.real / size) if size else 0.0
