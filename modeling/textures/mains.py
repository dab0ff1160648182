"""The phase of the mains: one frequency near 50 or 60 Hz that wanders slowly, told by all its multiples at once."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from palpate.signals.arrays import Array, Complex

WANDERS = 0.004
"""Share by which mains frequency may differ from nominal: +-0.2 Hz of 50 (EN 50160 allows 1 %, for 99.5 % of time)."""
USED = 0.48
"""Share of the rate up to which multiples are looked at."""
TELLING = 5
"""Multiples by which a first frequency is told."""
FINER = 8
"""Spectra are computed at so many points per resolution."""
PART_S = 2.0
"""Of spectra that are averaged: the mains wander less in them."""
STEP_S, KNOT_S = 0.25, 2.5
"""The phase is looked at so often; a cubic spline with knots so far apart follows it."""
CLEAR, BESIDE_HZ = 4.0, 10.0
"""A multiple tells the phase where it has so many times the power so far to either side, step by step."""
LEAKS = 1e-6
"""Share of all power that may be a stronger line's, far from it."""


def multiples_of(mains_hz: float, rate_hz: float) -> range:
    """1, 2, ... up to the last multiple that is looked at."""
    return range(1, int(USED * rate_hz / mains_hz) + 1)


def turned(axes: Array, cycles: Array, multiple: float) -> Complex:
    """(n, k) with what turns by so many cycles (n,), times a multiple, held still."""
    still: Complex = axes * np.exp(-2j * math.pi * multiple * cycles)[:, None]
    return still


def each_turned(axes: Array, rate_hz: float, mains_hz: float, cycles: Array) -> Iterator[tuple[int, Complex]]:
    """Each multiple of the mains, and (n, k) with it held still."""
    back = turned(np.ones((len(axes), 1)), cycles, 1)
    held = axes.astype(np.complex128)
    for multiple in multiples_of(mains_hz, rate_hz):
        held = held * back
        yield multiple, held


def phases(axes: Array, rate_hz: float, mains_hz: float) -> Iterator[Array]:
    """What the phase (n,) of the mains in axes (n, k) may have been, in cycles.

    A steady frequency; and, followed as they wander where their multiples are clear enough, that one, and one told by
    parts of 2 s. A phase that wanders further than mains do is not given.
    """
    seconds = np.arange(len(axes)) / rate_hz
    for part in {len(axes), min(len(axes), round(PART_S * rate_hz))}:
        cycles = _own_frequency(axes, rate_hz, mains_hz, part) * seconds
        for wanders in (False, True, True):
            away = _away(axes, rate_hz, mains_hz, cycles, wanders)
            cycles = cycles + away
            if np.abs(np.diff(cycles) * rate_hz - mains_hz).max() <= 2 * WANDERS * mains_hz:
                yield cycles
            if not away.any():
                break


def _own_frequency(axes: Array, rate_hz: float, mains_hz: float, part: int) -> float:
    """Of the frequencies that the mains may have, the one whose multiples stand out most from what lies beside."""
    step_hz, power = _spectrum(axes, rate_hz, part)
    reach = WANDERS * mains_hz
    tried = np.linspace(mains_hz - reach, mains_hz + reach, 2 * math.ceil(TELLING * reach / step_hz) + 1)
    score = np.zeros(len(tried))
    for multiple in [each for each in multiples_of(mains_hz, rate_hz) if each <= TELLING]:
        at = np.rint(multiple * tried / step_hz).astype(int)
        beside = np.rint((multiple * mains_hz + np.r_[-8:-2:13j, 2:8:13j]) / step_hz).astype(int)
        score += power[at] / (np.median(power[beside]) + np.finfo(float).tiny)
    return float(tried[int(np.argmax(score))])


def _spectrum(axes: Array, rate_hz: float, part: int) -> tuple[float, Array]:
    """The step in Hz, and the power, all axes together, averaged over parts of that length that overlap by half."""
    points = 2 ** math.ceil(math.log2(part * FINER))
    taper = np.hanning(part + 2)[1:-1, None]
    starts = range(0, len(axes) - part + 1, max(1, part // 2))
    found = sum((np.abs(np.fft.rfft(axes[at : at + part] * taper, points, axis=0)) ** 2).sum(axis=1) for at in starts)
    return rate_hz / points, np.asarray(found)


def _away(axes: Array, rate_hz: float, mains_hz: float, cycles: Array, wanders: bool) -> Array:
    """By how many cycles (n,) the phase of the mains runs away from one that is nearly right: straight, or bent."""
    from scipy.interpolate import LSQUnivariateSpline

    count = int(len(axes) / (STEP_S * rate_hz))
    beside = turned(np.ones((len(axes), 1)), np.arange(len(axes)) / rate_hz, BESIDE_HZ)
    leaks = LEAKS * float((axes**2).sum(axis=1).mean())
    told = [_turning(*each, beside, count, leaks) for each in each_turned(axes, rate_hz, mains_hz, cycles)]
    weight = sum(each[0] for each in told)
    if count < 4 or not weight > 0:
        return np.zeros(len(axes))
    # Each multiple turns by so many times the cycles of the first; the clearer and higher, the better it tells.
    away = np.r_[0.0, np.cumsum(sum(clear * turns for clear, turns in told) / weight)]
    at = (np.arange(count) + 0.5) * len(axes) / count
    pieces = max(1, round(len(axes) / rate_hz / KNOT_S)) if wanders else 1
    knots = np.linspace(at[0], at[-1], pieces + 1)[1:-1]
    bent = LSQUnivariateSpline(at, away, knots, k=min(3, count // 3) if wanders else 1)
    return np.asarray(bent(np.arange(len(axes))))


def _turning(multiple: int, held: Complex, beside: Complex, count: int, leaks: float) -> tuple[float, Array]:
    """How much a multiple tells, and by how many cycles of the first it turns from step to step (count - 1,)."""
    still = _steps(held, count)
    others = [_steps(held * way, count) for way in (beside, beside.conj())]
    noise = float(np.mean([(np.abs(each) ** 2).sum(axis=1).mean() for each in others])) + leaks
    clear = float((np.abs(still) ** 2).sum(axis=1).mean()) / noise
    turns = np.angle((still[1:] * still[:-1].conj()).sum(axis=1)) / (2 * math.pi * multiple)
    return (clear * multiple**2 if clear > CLEAR else 0.0), turns


def _steps(values: Complex, count: int) -> Complex:
    """The means (count, k) of so many stretches, weighed by a raised cosine: no other multiple leaks into them."""
    edges = np.linspace(0, len(values), count + 1).astype(int)
    lengths = np.diff(edges)
    within = (np.arange(len(values)) - np.repeat(edges[:-1], lengths) + 0.5) / np.repeat(lengths, lengths)
    weighed = values * (2 * np.sin(math.pi * within) ** 2)[:, None]
    return np.asarray(np.add.reduceat(weighed, edges[:-1], axis=0) / lengths[:, None])
