"""Methods to put a stream on a grid, with their delays and the bounds of their errors.

Hold, nearest, linear, PCHIP and cubic spline take times (n,), values (n, channels) and the requested times (m,) within
the first and the last time, and return values (m, channels). None of them filters: frequencies above half the grid's
rate are folded down.

Band-limited resampling is a windowed sinc at any rate and phase, low-passed before the rate is lowered: Kaiser's window
and his estimate of its length (Oppenheim and Schafer, Discrete-Time Signal Processing, 7.5.3); the kernel is tabulated
at up to `PHASES` phases of a sample and linear between them (Smith and Gossett 1984, A flexible sampling-rate
conversion method), an error of about 2e-6 of the signal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, pi

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from palpate.protocols.did_you_mean import nearest as closest
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.arrays import Array

SAME_S = 1e-9
"""Times closer than this are one time: far below any sensor's step, far above the rounding of session times."""


def hold(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Return the last sample at or before each time; causal, and late by half a sample step on average."""
    before = np.searchsorted(times_s, grid_s + SAME_S, side="right") - 1
    return np.asarray(values[np.maximum(before, 0)])


def nearest(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Return the sample closest in time, the earlier of two at the same distance."""
    after = np.clip(np.searchsorted(times_s, grid_s), 1, len(times_s) - 1)
    earlier = grid_s - times_s[after - 1] <= times_s[after] - grid_s
    return np.asarray(values[np.where(earlier, after - 1, after)])


def linear(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Interpolate by the straight line between the two samples around each time."""
    return np.stack([np.interp(grid_s, times_s, channel) for channel in values.T], axis=1)


def pchip(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Interpolate by piecewise cubic Hermite polynomials, monotone where the samples are (Fritsch and Butland 1984)."""
    from scipy.interpolate import PchipInterpolator

    return np.asarray(PchipInterpolator(times_s, values, axis=0)(_inside(times_s, grid_s)))


def cubic(times_s: Array, values: Array, grid_s: Array) -> Array:
    """Interpolate by a cubic spline with continuous curvature, not-a-knot at its ends."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(times_s, values, axis=0)(_inside(times_s, grid_s)))


def _inside(times_s: Array, grid_s: Array) -> Array:
    """Return the grid's times clipped to the samples' range, so that rounding makes no polynomial extrapolate."""
    return np.clip(grid_s, times_s[0], times_s[-1])


REJECTION_DB = 80.0
"""Attenuation in the stop band; the pass band is right within 0.01 %."""
PASSES_UP, PASSES_DOWN = 0.8, 0.9
"""Share of the lower of both Nyquist frequencies up to which the signal is kept where the rate rises, or falls."""
ALIKE = 0.9
"""A stream of at least this share of the grid's rate is kept up to `PASSES_DOWN` as well, as vibration needs."""
FALLS = 1.01
PHASES = 512
PIECE = 256
"""Grid points computed at a time, so that memory stays small for a stream of any length."""
EVEN = 1e-3
"""Greatest deviation of a sample from even spacing, in steps."""


@dataclass(frozen=True)
class Band:
    """A kernel's pass band and stop band, and its reach to either side in samples of the stream."""

    passes_hz: float
    stops_hz: float
    reach: int


def band(rate_hz: float, grid_hz: float) -> Band:
    """Return the band that is kept when resampling from one rate to the other.

    Where the rate falls by more than clocks drift, everything above half the grid's rate is removed. Otherwise only the
    stream's own images are removed.
    """
    falls = rate_hz > FALLS * grid_hz
    nyquist = (grid_hz if falls else rate_hz) / 2
    share = PASSES_DOWN if rate_hz >= ALIKE * grid_hz else PASSES_UP
    passes, stops = share * nyquist, nyquist if falls else (2 - share) * nyquist
    taps = (REJECTION_DB - 7.95) / (2.285 * 2 * pi * (stops - passes) / rate_hz)
    return Band(passes, stops, ceil(taps / 2) + 1)


def bandlimited(times_s: Array, values: Array, wanted_s: Array, rate_hz: float, grid_hz: float) -> Array:
    """Return values (m, channels) at the requested times, from samples at even times (n,); samples may be missing.

    Missing samples are filled in by PCHIP first. Beyond its ends the signal is mirrored about its last value, so the
    error is larger within `band().reach` samples of an end.

    Raises:
        AlignError: times that are not evenly spaced.
    """
    # Each sample's place on an even grid, and the grid's step in seconds.
    places = np.r_[0.0, np.cumsum(np.rint(np.diff(times_s) * rate_hz))]  # step by step: no drift adds up
    if places[-1] < 1:
        raise AlignError(
            f"samples closer than the {1 / rate_hz:g} s of a step: band-limited resampling needs even times"
        )
    step_s = float((times_s[-1] - times_s[0]) / places[-1])
    off = np.abs((times_s - times_s[0]) / step_s - places)
    worst = int(off.argmax())
    if off[worst] > EVEN or (np.diff(places) < 1).any():
        raise AlignError(
            f"sample {worst + 1} lies {off[worst]:.3g} steps off an even grid of {1 / step_s:g} Hz: band-limited "
            "resampling needs even times; use pchip or cubic, or times from a fitted clock"
        )
    whole = places[-1] == len(places) - 1
    full = values if whole else pchip(places, values, np.arange(places[-1] + 1))
    passband = band(1 / step_s, grid_hz)
    weights = _kernel(passband, step_s)
    padded = np.pad(full, ((passband.reach, passband.reach), (0, 0)), mode="reflect", reflect_type="odd")
    at = np.clip((wanted_s - times_s[0]) / step_s, 0, len(full) - 1)
    resampled = np.empty((len(at), values.shape[1]))
    for start in range(0, len(at), PIECE):
        resampled[start : start + PIECE] = _convolved(padded, weights, at[start : start + PIECE], passband.reach)
    return resampled


def _kernel(passband: Band, step_s: float) -> Array:
    """Return the weights (phases + 1, 2 reach) of the samples around a point, by its phase; each row sums to 1."""
    cut = (passband.passes_hz + passband.stops_hz) * step_s  # of the stream's Nyquist frequency
    beta = 0.1102 * (REJECTION_DB - 8.7)
    phases = ceil(PHASES * min(cut, 1.0))  # a kernel that is wider needs fewer
    phase = np.arange(phases + 1)[:, None] / phases
    from_point = np.arange(1 - passband.reach, passband.reach + 1)[None, :] - phase
    inside = np.clip(1 - (from_point / passband.reach) ** 2, 0, None)
    weights = np.sinc(cut * from_point) * np.i0(beta * np.sqrt(inside))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _convolved(padded: Array, weights: Array, at: Array, reach: int) -> Array:
    """Return the weighted sums of the samples around each position; `at` is in samples, before padding."""
    before = np.minimum(at.astype(np.int64), len(padded) - 2 * reach - 1)
    phases = len(weights) - 1
    phase = (at - before) * phases
    row = np.minimum(phase.astype(np.int64), phases - 1)
    share = (phase - row)[:, None]
    of_points = weights[row] * (1 - share) + weights[row + 1] * share
    around = sliding_window_view(padded, 2 * reach, axis=0)
    return np.stack([np.einsum("mk,mk->m", of_points, around[before + 1, c]) for c in range(padded.shape[1])], axis=1)


Run = Callable[[Array, Array, Array, float, float], Array]
"""times (n,), values (n, channels), requested times (m,), the stream's rate, the grid's rate -> (m, channels)."""
Reach = Callable[[float, float], float]


@dataclass(frozen=True)
class Method:
    """A method to align a stream. T is the stream's step, x' and x'' the signal's derivatives.

    `delay_s` is the average delay of the result (0: zero-phase) and `ahead_s` how much of the future it uses, both as
    functions of the stream's and the grid's rate. `bound` is its greatest error for a signal that the stream's rate can
    represent.
    """

    name: str
    description: str
    bound: str
    run: Run
    delay_s: Reach
    ahead_s: Reach
    filters: bool = False

    @property
    def causal(self) -> bool:
        """Return whether the method uses nothing from the future, at any rate."""
        return self.ahead_s(1.0, 1.0) == 0.0


def _plain(run: Callable[[Array, Array, Array], Array]) -> Run:
    return lambda times_s, values, wanted_s, _rate_hz, _grid_hz: run(times_s, values, wanted_s)


def _steps(count: float) -> Reach:
    return lambda rate_hz, _grid_hz: count / rate_hz


def _band_reach(rate_hz: float, grid_hz: float) -> float:
    return band(rate_hz, grid_hz).reach / rate_hz


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method("hold", "the last sample", "max|x'| T", _plain(hold), _steps(0.5), _steps(0)),
        Method("nearest", "the sample closest in time", "max|x'| T / 2", _plain(nearest), _steps(0), _steps(0.5)),
        Method("linear", "straight lines", "max|x''| T^2 / 8", _plain(linear), _steps(0), _steps(1)),
        Method("pchip", "monotone cubics, no overshoot", "max|x''| T^2 / 8, at peaks; O(T^3) elsewhere", _plain(pchip),
               _steps(0), _steps(2)),
        Method("cubic", "cubic spline", "5/384 max|x''''| T^4", _plain(cubic), _steps(0), lambda *_: float("inf")),
        Method("bandlimited", "windowed sinc, 80 dB", "1e-4 of the signal in the pass band, away from edges",
               bandlimited, _steps(0), _band_reach, filters=True),
    )
}  # fmt: skip


def method_named(name: str) -> Method:
    """Return the method of that name. Raises AlignError that suggests the nearest known name."""
    if name not in METHODS:
        raise AlignError(f"there is no method {name!r}; {closest(name, METHODS)}")
    return METHODS[name]
