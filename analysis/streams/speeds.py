"""Speed of a stream of positions on the grid: by a method that states its noise, its bias and how late it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.analysis.streams.recorded import Stream, StreamError
from palpate.signals.aligning.aligned import align
from palpate.signals.aligning.errors import sine_error
from palpate.signals.aligning.methods import METHODS, Method
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.aligning.speed import Slope, floor_mm_s, slope, velocity
from palpate.signals.arrays import Array

AXES = ("x", "y", "z")
MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
WINDOW, DEGREE = 7, 2
"""A parabola over seven samples: of all windows about the best for a hand's stroke at 120 Hz (docs/reference)."""
SINES_HZ = (1.5, 5.0, 25.0)
FOURTH = 70.0
"""Sum of the squares of 1, 4, 6, 4, 1: the variance of the fourth difference of white noise of variance 1."""


@dataclass(frozen=True)
class SpeedWanted:
    """Of which streams the speed is wanted, over how many samples, and whether nothing may be taken from the future."""

    streams: tuple[str, ...] = ()
    window: int = WINDOW
    causal: bool = False


NO_SPEED = SpeedWanted()


@dataclass(frozen=True)
class Moving:
    """Velocities (m, axes) of a stream on the grid in mm/s, NaN where they are not known, and how they were made."""

    stream: Stream
    axes: tuple[str, ...]
    velocities: Array
    estimate: Slope
    method: Method
    grid_hz: float
    noise_mm: float | None

    def columns(self) -> dict[str, Array]:
        """STREAM_vx and so on, then STREAM_speed: their length, never below 0."""
        each = {f"{self.stream.name}_v{axis}": self.velocities[:, place] for place, axis in enumerate(self.axes)}
        return {**each, f"{self.stream.name}_speed": np.linalg.norm(self.velocities, axis=1)}

    def account(self) -> dict[str, Any]:
        """The method, its window, its delay, its noise and its bias, as JSON data."""
        one, rates = self.estimate, (self.stream.timing.rate_hz, self.grid_hz)
        ahead_s = one.wait_s + self.method.ahead_s(*rates)
        return {
            "columns": list(self.columns()), "unit": "mm/s", "causal": ahead_s == 0.0,
            "method": "slope at the {} of a parabola fitted to the window (Savitzky and Golay 1964)".format(
                "newest sample" if one.place == "end" else "middle"
            ),
            "degree": one.degree, "window": one.window, "window_s": (one.window - 1) / one.rate_hz,
            "rate_hz": one.rate_hz, "aligned_by": self.method.name,
            "delay_s": round(one.lag_s + self.method.delay_s(*rates), 12),
            "known_after_s": one.wait_s, "ahead_s": ahead_s if np.isfinite(ahead_s) else None,
            "noise_gain_per_s": one.noise_gain_per_s,
            "bias": {"of_derivative": one.bias_order, "times": one.bias, "unit": f"s^{one.bias_order - 1}"},
            "relative_error_of_a_sine": {f"{hz:g} Hz": abs(one.response(hz) - 1) for hz in self._sines_hz()},
            "relative_error_of_aligning_it": {f"{hz:g} Hz": self._aligning_error(hz) for hz in self._sines_hz()},
            **self._noise(),
            "empty_rows": int(np.isnan(self.velocities[:, 0]).sum()),
        }  # fmt: skip

    def _sines_hz(self) -> Iterator[float]:
        return (hz for hz in SINES_HZ if hz < self.estimate.rate_hz / 2)

    def _aligning_error(self, hz: float) -> float:
        return sine_error(self.method.name, self.stream.rate_hz, self.grid_hz, hz)

    def _noise(self) -> dict[str, Any]:
        """What the recording's own noise does to it; nulls where it is too short to tell."""
        if self.noise_mm is None:
            return {"noise_mm": None, "noise_mm_s": None, "at_rest_mm_s": None}
        return {
            "noise_mm": self.noise_mm, "noise_mm_s": self.noise_mm * self.estimate.noise_gain_per_s,
            "at_rest_mm_s": floor_mm_s(self.noise_mm, self.estimate, len(self.axes)),
        }  # fmt: skip


def moving(
    stream: Stream, times_s: Array, grid_s: Array, grid_hz: float, method: Method, wanted: SpeedWanted
) -> Moving:
    """The stream's velocity at its own sample times by its own measured rate, then aligned; no hole is bridged.

    Where nothing may be taken from the future, the last estimate is held until the next.

    Raises:
        StreamError: no lengths x, y, z in it, a window that cannot be, no stretch that is as long as the window.
    """
    axes, scale = _axes(stream)
    values = stream.values()
    positions = scale * values[:, [stream.channels.index(axis) for axis in axes]]
    used = METHODS["hold"] if wanted.causal else method
    rate_hz = stream.timing.rate_hz
    try:
        estimate = slope(wanted.window, DEGREE, rate_hz, "end" if wanted.causal else "middle")
        stretches = list(_stretches(positions, stream))
        told = np.concatenate([velocity(each, estimate) for each in stretches])
        found = align(times_s, told, grid_s, used, rate_hz=rate_hz, grid_hz=grid_hz, longest_gap_s=0.0)
    except AlignError as error:
        raise StreamError(f"{stream.where}: speed over {wanted.window} samples: {error}") from error
    return Moving(stream, axes, found.values, estimate, used, grid_hz, _noise_mm(stretches))


def _axes(stream: Stream) -> tuple[tuple[str, ...], float]:
    """Which channels are places, and how many mm their unit is."""
    units = dict(zip(stream.channels, stream.units, strict=True))
    axes = tuple(axis for axis in AXES if axis in units)
    told = ", ".join(f"{channel} in {unit}" for channel, unit in units.items())
    if len(axes) < 2 or len({units[axis] for axis in axes}) > 1 or units[axes[0]] not in MM:
        raise StreamError(
            f"{stream.where}: a speed needs two or three of x, y, z in one unit of mm, cm, m; it has {told}"
        )
    if "speed" in units:
        raise StreamError(f"{stream.where}: it has a channel `speed` already, as its device measured it")
    return axes, MM[units[axes[0]]]


def _stretches(positions: Array, stream: Stream) -> Iterator[Array]:
    """Positions between lost samples."""
    yield from np.split(positions, np.flatnonzero(np.diff(stream.numbers()) > 1) + 1)


def _noise_mm(stretches: list[Array]) -> float | None:
    """SD of an axis at least as large as the noise, from fourth differences: movement is smooth, noise is not."""
    fourth = np.concatenate([np.diff(each, 4, axis=0) for each in stretches if len(each) > 4] or [np.empty((0, 2))])
    seen = fourth[np.isfinite(fourth).all(axis=1)]
    if not len(seen):
        return None
    robust = 1.4826 * np.median(np.abs(seen), axis=0)  # of a normal distribution: a few jerks do not count
    return float(np.sqrt((robust**2).mean() / FOURTH))
