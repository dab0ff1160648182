"""The error of a speed against its window: long windows reduce the noise and blur the movement."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.signals.aligning.speed import Place, Slope, slope, velocity
from palpate.signals.arrays import Array


@dataclass(frozen=True)
class Stroke:
    """A hand that strokes back and forth: amplitude in mm and frequency in Hz, and the tracker's noise in mm."""

    amplitude_mm: float = 40.0
    frequency_hz: float = 1.5
    noise_mm: float = 0.05
    rate_hz: float = 120.0

    @property
    def fastest_mm_s(self) -> float:
        """The highest speed of the stroke."""
        return 2 * math.pi * self.frequency_hz * self.amplitude_mm


@dataclass(frozen=True)
class Line:
    """The RMS errors of the velocity for one window, in mm/s, by theory and as measured on a simulated stroke."""

    estimate: Slope
    noise_mm_s: float
    blur_mm_s: float
    expected_mm_s: float
    measured_mm_s: float


def table(
    stroke: Stroke,
    windows: Sequence[int],
    degree: int = 2,
    place: Place = "middle",
    seconds: float = 600.0,
    seed: int = 1,
) -> Iterator[Line]:
    """Yield the error of each window for that stroke along one axis, against the velocity at the same instant."""
    positions, truth = simulated(stroke, seconds, seed)
    for window in windows:
        estimate = slope(window, degree, stroke.rate_hz, place)
        wrong = velocity(positions, estimate)[:, 0] - truth
        noise, blur = expected(stroke, estimate)
        yield Line(estimate, noise, blur, math.hypot(noise, blur), float(np.sqrt(np.nanmean(wrong**2))))


def expected(stroke: Stroke, estimate: Slope) -> tuple[float, float]:
    """Return the velocity's RMS noise, and the share of the movement that the window removes: |response - 1|."""
    blur = abs(estimate.response(stroke.frequency_hz) - 1) * stroke.fastest_mm_s / math.sqrt(2)
    return stroke.noise_mm * estimate.noise_gain_per_s, blur


def simulated(stroke: Stroke, seconds: float, seed: int) -> tuple[Array, Array]:
    """Return noisy positions of shape (n, 1) in mm, and true velocities of shape (n,) in mm/s."""
    phase = 2 * math.pi * stroke.frequency_hz * np.arange(round(seconds * stroke.rate_hz)) / stroke.rate_hz
    noise = stroke.noise_mm * np.random.default_rng(seed).standard_normal(len(phase))
    return (stroke.amplitude_mm * np.sin(phase) + noise)[:, None], stroke.fastest_mm_s * np.cos(phase)
