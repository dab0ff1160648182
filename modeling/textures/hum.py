"""Detection of mains hum (multiples of 50 or 60 Hz in the mains' phase), and its removal by tracking notches.

The phase of the mains is that of one frequency near 50 or 60 Hz that wanders slowly, estimated from all its multiples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.signals.arrays import Array, Complex

WANDERS = 0.004
"""Share by which mains frequency may differ from nominal: +-0.2 Hz of 50 (EN 50160 allows 1 %, for 99.5 % of time)."""
USED = 0.48
"""Share of the rate up to which multiples are examined."""
TELLING = 5
"""Number of multiples by which an initial frequency is estimated."""
MAINS_FINER = 8
"""Number of points of a spectrum per resolution."""
PART_S = 2.0
"""Seconds of the parts whose spectra are averaged: the mains wander less within them."""
STEP_S, KNOT_S = 0.25, 2.5
"""Seconds between estimates of the phase, and between the knots of the cubic spline that follows it."""
CLEAR, BESIDE_HZ = 4.0, 10.0
"""A multiple determines the phase if it has this many times the power at this distance to either side, step by step."""
LEAKS = 1e-6
"""Share of all power that may be leakage of a stronger line."""
MAINS_HZ = (50.0, 60.0)
STANDS_OUT, BESIDE = 16.0, 6.0
"""A line has this many times the power around it; less if another line of the same mains is clear."""
STEADY = 0.6
"""Mean agreement of amplitude and phase between neighbouring segments: 1 for a steady line, about 0 for noise."""
SEGMENTS, SEGMENT_S = 4, 0.4
"""The greatest number of segments, and their least duration."""
AROUND_HZ = 8.0
NOTCH_HZ = 2.0
"""Width of a notch at -3 dB."""
SHORTEST_S = 1.0
"""In a shorter recording, a line of hum is too wide to be distinguished."""
FINER = 2
"""Number of points of a spectrum per resolution."""
WANDERS_HZ = 0.05
"""The deviation of the mains' frequency above which it counts as wandering."""


def multiples_of(mains_hz: float, rate_hz: float) -> range:
    """Return the multiples 1, 2, ... of the mains up to `USED` of the rate."""
    return range(1, int(USED * rate_hz / mains_hz) + 1)


def demodulated(axes: Array, cycles: Array, multiple: float) -> Complex:
    """Return axes (n, k) demodulated by a phase of cycles (n,) times a multiple."""
    still: Complex = axes * np.exp(-2j * math.pi * multiple * cycles)[:, None]
    return still


def demodulated_multiples(axes: Array, rate_hz: float, mains_hz: float, cycles: Array) -> Iterator[tuple[int, Complex]]:
    """Yield each multiple of the mains, with the axes (n, k) demodulated by it."""
    back = demodulated(np.ones((len(axes), 1)), cycles, 1)
    held = axes.astype(np.complex128)
    for multiple in multiples_of(mains_hz, rate_hz):
        held = held * back
        yield multiple, held


def phases(axes: Array, rate_hz: float, mains_hz: float) -> Iterator[Array]:
    """Yield candidates of the mains' phase (n,) in axes (n, k), in cycles.

    A constant frequency is estimated from the whole and from parts of 2 s; each is also tracked as it wanders, if its
    multiples are clear enough. A phase that wanders more than mains do is left out.
    """
    seconds = np.arange(len(axes)) / rate_hz
    for part in {len(axes), min(len(axes), round(PART_S * rate_hz))}:
        # of the frequencies that the mains may have, take the one whose multiples stand out most from their neighbours;
        # the power is that of all axes together, averaged over parts that overlap by half
        points = 2 ** math.ceil(math.log2(part * MAINS_FINER))
        taper = np.hanning(part + 2)[1:-1, None]
        starts = range(0, len(axes) - part + 1, max(1, part // 2))
        summed = sum(
            (np.abs(np.fft.rfft(axes[at : at + part] * taper, points, axis=0)) ** 2).sum(axis=1) for at in starts
        )
        step_hz, power = rate_hz / points, np.asarray(summed)
        reach = WANDERS * mains_hz
        tried = np.linspace(mains_hz - reach, mains_hz + reach, 2 * math.ceil(TELLING * reach / step_hz) + 1)
        score = np.zeros(len(tried))
        for multiple in [number for number in multiples_of(mains_hz, rate_hz) if number <= TELLING]:
            at = np.rint(multiple * tried / step_hz).astype(int)
            beside = np.rint((multiple * mains_hz + np.r_[-8:-2:13j, 2:8:13j]) / step_hz).astype(int)
            score += power[at] / (np.median(power[beside]) + np.finfo(float).tiny)
        cycles = float(tried[int(np.argmax(score))]) * seconds
        for wanders in (False, True, True):
            away = _phase_error(axes, rate_hz, mains_hz, cycles, wanders)
            cycles = cycles + away
            if np.abs(np.diff(cycles) * rate_hz - mains_hz).max() <= 2 * WANDERS * mains_hz:
                yield cycles
            if not away.any():
                break


def _phase_error(axes: Array, rate_hz: float, mains_hz: float, cycles: Array, wanders: bool) -> Array:
    """Return the error (n,), in cycles, of an approximate phase of the mains: a line, or a spline where it wanders."""
    from scipy.interpolate import LSQUnivariateSpline

    count = int(len(axes) / (STEP_S * rate_hz))
    beside = demodulated(np.ones((len(axes), 1)), np.arange(len(axes)) / rate_hz, BESIDE_HZ)
    leaks = LEAKS * float((axes**2).sum(axis=1).mean())
    strengths = [
        _phase_steps(*turning, beside, count, leaks)
        for turning in demodulated_multiples(axes, rate_hz, mains_hz, cycles)
    ]
    weight = sum(strength[0] for strength in strengths)
    if count < 4 or not weight > 0:
        return np.zeros(len(axes))
    # Each multiple turns by so many times the cycles of the first; the clearer and higher, the better it tells.
    away = np.r_[0.0, np.cumsum(sum(clear * turns for clear, turns in strengths) / weight)]
    at = (np.arange(count) + 0.5) * len(axes) / count
    pieces = max(1, round(len(axes) / rate_hz / KNOT_S)) if wanders else 1
    knots = np.linspace(at[0], at[-1], pieces + 1)[1:-1]
    bent = LSQUnivariateSpline(at, away, knots, k=min(3, count // 3) if wanders else 1)
    return np.asarray(bent(np.arange(len(axes))))


def _phase_steps(multiple: int, held: Complex, beside: Complex, count: int, leaks: float) -> tuple[float, Array]:
    """Return the weight of a multiple, and its phase steps (count - 1,) in cycles of the first."""
    still = _step_means(held, count)
    others = [_step_means(held * way, count) for way in (beside, beside.conj())]
    noise = float(np.mean([(np.abs(other) ** 2).sum(axis=1).mean() for other in others])) + leaks
    clear = float((np.abs(still) ** 2).sum(axis=1).mean()) / noise
    turns = np.angle((still[1:] * still[:-1].conj()).sum(axis=1)) / (2 * math.pi * multiple)
    return (clear * multiple**2 if clear > CLEAR else 0.0), turns


def _step_means(values: Complex, count: int) -> Complex:
    """Return means (count, k) of equal stretches, weighted by a raised cosine against leakage of other multiples."""
    edges = np.linspace(0, len(values), count + 1).astype(int)
    lengths = np.diff(edges)
    within = (np.arange(len(values)) - np.repeat(edges[:-1], lengths) + 0.5) / np.repeat(lengths, lengths)
    weighed = values * (2 * np.sin(math.pi * within) ** 2)[:, None]
    return np.asarray(np.add.reduceat(weighed, edges[:-1], axis=0) / lengths[:, None])


@dataclass(frozen=True)
class Line:
    """A line of hum: its multiple of the mains, frequency, RMS in m/s^2, and ratio to the power around it."""

    multiple: int
    frequency_hz: float
    rms_m_s2: float
    stands_out: float


@dataclass(frozen=True)
class Hum:
    """The removed lines, the nominal frequency of their mains, and the notches' share of the power.

    `cycles` (n,) is the phase of the mains.
    """

    mains_hz: float
    lines: tuple[Line, ...]
    removed_rms_m_s2: float
    removed_share: float
    cycles: Array

    def between_hz(self) -> tuple[float, float]:
        """Return the least and the greatest frequency of the mains."""
        pace = np.diff(self.cycles) * self.lines[0].frequency_hz * (len(self.cycles) - 1)
        first = pace / (self.lines[0].multiple * (self.cycles[-1] - self.cycles[0]))
        return float(first.min()), float(first.max())

    def note(self) -> str:
        """Return a sentence that says what was removed."""
        at = ", ".join(f"{line.frequency_hz:.2f}" for line in self.lines)
        low, high = self.between_hz()
        wanders = f" (the mains wander from {low:.2f} to {high:.2f} Hz)" if high - low > WANDERS_HZ else ""
        return (
            f"mains hum of {self.mains_hz:g} Hz found and removed at {at} Hz{wanders} by notches {NOTCH_HZ:g} Hz wide:"
            f" {self.removed_rms_m_s2:.3g} m/s^2 RMS, {self.removed_share:.1%} of the power; whatever the texture had"
            " within them is gone as well"
        )


def without_hum(vibration: Array, rate_hz: float) -> tuple[Array, Hum | None]:
    """Return an acceleration (n,) or axes (n, k) without mains hum, and the removed hum; None where there is none.

    Hum is lines at whole multiples of one frequency near 50 or 60 Hz, tracked as it wanders, that stand out at least 12
    dB from the power within 8 Hz and have the same amplitude and phase from one quarter of the recording to the next. A
    texture's own content, even there, changes with the hand; it might not if the hand was driven at one speed over a
    regular pattern, so the notes say what was removed. Recordings below 1 s are not changed.
    """
    axes = vibration[:, None] if vibration.ndim == 1 else vibration
    if len(axes) < SHORTEST_S * rate_hz or not axes.any():
        return vibration, None
    # nominal frequency, phase and lines of what each mains may have been
    candidates = [
        (mains_hz, cycles, lines)
        for mains_hz in MAINS_HZ
        for cycles in phases(axes, rate_hz, mains_hz)
        if (lines := _lines_at(axes, rate_hz, mains_hz, cycles))
    ]
    if not candidates:
        return vibration, None
    # the phase that is followed best holds most of the lines still
    mains_hz, cycles, lines = max(candidates, key=lambda candidate: sum(line.rms_m_s2**2 for line in candidate[2]))
    clean = notched(axes, rate_hz, cycles, [line.multiple for line in lines])
    taken = float(((axes - clean) ** 2).sum(axis=1).mean())
    whole = float(((axes - axes.mean(axis=0)) ** 2).sum(axis=1).mean())
    return clean.reshape(vibration.shape), Hum(mains_hz, lines, math.sqrt(taken), taken / whole, cycles)


def before_filter(
    vibration: Array, felt: Array, hum: Hum, rate_hz: float, filtered: Callable[[Array], Array]
) -> Array:  # fmt: skip
    """Return axes (n, k) filtered, without the hum that was detected in `felt`, the axes filtered before.

    A filter extends a signal by mirroring it about its last value, which does not fit hum and rings at both ends. So
    the steady part of the hum is removed before the filter, and only the rest after it.
    """
    multiples = [line.multiple for line in hum.lines]
    steady = _steady_part(felt, hum.cycles, multiples)
    return notched(filtered(vibration - steady), rate_hz, hum.cycles, multiples)


def notched(axes: Array, rate_hz: float, cycles: Array, multiples: Sequence[int]) -> Array:
    """Return axes (n, k) with notches of `NOTCH_HZ` at multiples of a frequency with phase `cycles`, without delay.

    The steady part of each line is fitted and subtracted first, so that the notches do not ring at the ends of a short
    recording.
    """
    from scipy.signal import butter, filtfilt

    cleaned = axes - _steady_part(axes, cycles, multiples)
    # What is kept of an offset f, both ways together, is x^2 / (1 + x^2), x = f / edge: 3 dB down at x = 1.55.
    edge_hz = NOTCH_HZ / 2 * math.sqrt(math.sqrt(2.0) - 1.0)
    b, a = butter(1, edge_hz, fs=rate_hz)
    pad = min(len(cleaned) - 1, math.ceil(rate_hz / NOTCH_HZ))
    for multiple in multiples:
        slow = filtfilt(b, a, demodulated(cleaned, cycles, multiple), axis=0, padtype="even", padlen=pad)
        cleaned = cleaned - 2 * demodulated(slow, cycles, -multiple).real
    return np.asarray(cleaned)


def _steady_part(axes: Array, cycles: Array, multiples: Sequence[int]) -> Array:
    """Return the least-squares sum of the multiples, each with one amplitude and phase throughout."""
    angle = 2 * math.pi * np.outer(cycles, multiples)
    waves = np.hstack([np.cos(angle), np.sin(angle), np.ones((len(axes), 1))])
    weights = np.linalg.lstsq(waves, axes, rcond=None)[0]
    return np.asarray(waves[:, :-1] @ weights[:-1])


def _lines_at(axes: Array, rate_hz: float, mains_hz: float, cycles: Array) -> tuple[Line, ...]:
    """Return the multiples of the mains that are lines; next to a clear one, fainter ones count too."""
    own_hz = float(cycles[-1] - cycles[0]) * rate_hz / (len(cycles) - 1)
    lines = []
    for multiple, still in demodulated_multiples(axes, rate_hz, mains_hz, cycles):
        power, stands_out = _line_power(still, rate_hz)
        if stands_out >= BESIDE and _steadiness(still, rate_hz) >= STEADY:
            lines.append(Line(multiple, multiple * own_hz, math.sqrt(2 * power), stands_out))
    return tuple(lines) if any(line.stands_out >= STANDS_OUT for line in lines) else ()


def _line_power(still: Complex, rate_hz: float) -> tuple[float, float]:
    """Return the power of a demodulated line (half the squared amplitude, all axes), and its ratio to the noise.

    The power of noise is estimated by the median within 8 Hz to either side (ln 2 of an exponential's mean).
    """
    from scipy.fft import fft, next_fast_len

    n = len(still)
    taper = np.hanning(n + 2)[1:-1]
    power = (np.abs(fft(still * (taper / taper.sum())[:, None], next_fast_len(FINER * n), axis=0)) ** 2).sum(axis=1)
    step_hz, resolution_hz = rate_hz / len(power), rate_hz / n
    beside = np.rint(np.linspace(max(3.0 * resolution_hz, NOTCH_HZ / 2), AROUND_HZ, 48) / step_hz).astype(int)
    reach = max(1, round(0.5 * resolution_hz / step_hz))
    peak = float(power[np.arange(-reach, reach + 1)].max())
    noise = float(np.median(power[np.r_[-beside, beside]])) / math.log(2) + np.finfo(float).tiny
    return peak, peak / noise


def _steadiness(still: Complex, rate_hz: float) -> float:
    """Return how well amplitude and phase agree between one stretch and the next, 0 to 1."""
    count = min(SEGMENTS, max(2, int(len(still) / (SEGMENT_S * rate_hz))))
    means = np.stack([part.mean(axis=0) for part in np.array_split(still, count)])
    agreed = (means[1:] * means[:-1].conj()).sum()
    size = 0.5 * (np.abs(means[1:]) ** 2 + np.abs(means[:-1]) ** 2).sum()
    return float(agreed.real / size) if size else 0.0
