"""Error and time of a tracker's speed, by window and by the place in the window."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.speed_table import Stroke, simulated
from palpate.protocols.bench import Case
from palpate.signals.aligning.speed import Place, slope, velocity
from palpate.signals.arrays import Array

STROKES = {
    "a hand's stroke": Stroke(),
    "a door's handle": Stroke(amplitude_mm=400, frequency_hz=0.2, noise_mm=0.2, rate_hz=80.0),
}
WINDOWS = (3, 5, 7, 9, 13, 21)
METHODS: dict[str, tuple[int, Place]] = {
    "parabola, middle (known half a window later)": (2, "middle"),
    "parabola, end": (2, "end"),
    "line, end": (1, "end"),
}


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of each method and window on a hand's stroke at 120 Hz and on a door's handle at 80 Hz."""
    seconds = 60.0 if quick else 600.0
    for name, stroke in STROKES.items():
        for window in WINDOWS:
            for method in METHODS:
                yield _case(name, stroke, method, window, seconds)


def _case(name: str, stroke: Stroke, method: str, window: int, seconds: float) -> Case:
    positions, truth = simulated(stroke, seconds, seed=1)
    degree, place = METHODS[method]
    estimate = slope(window, degree, stroke.rate_hz, place)
    movement = f"{stroke.amplitude_mm:g} mm at {stroke.frequency_hz:g} Hz, noise {stroke.noise_mm:g} mm"
    kind = f"RMS mm/s: {movement}, from {stroke.rate_hz:g} Hz"

    def error(speed: Array) -> float:
        return math.sqrt(float(np.nanmean((speed[:, 0] - truth) ** 2)))

    run = partial(velocity, positions, estimate)
    return Case("tracker", name, method, f"{window} samples", len(truth), kind, run, error)
