"""Ten minutes of every possible input: extremes, steps, lifting off, broken sensors, a corrupted window."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.signals.textures.voice import Voice, open_voice

NAN = math.nan
MOMENTS: tuple[tuple[float, float], ...] = (
    (10.5, 0.16), (300.0, 3.6), (10.5, 3.6), (300.0, 0.16), (100.0, 1.0), (0.0, 0.0), (1e6, 1.0), (100.0, 1e6),
    (NAN, 1.0), (100.0, NAN), (math.inf, -math.inf), (-1e6, -1e6), (45.0, 0.8),
)  # fmt: skip
"""Speed in mm/s and force in N; visited in steps, in random order."""
STEADY_MS = (20, 700)
SPOILT_TIMES = 60
"""How often the window is corrupted in total."""
SPOILT = (NAN, math.inf, 1e6, -1e6)
CALM = 100.0, 1.0
MEND_MS = 100


@dataclass
class Extremes:
    """The results of a run of extremes.

    The largest sample beyond the peak and the largest at rest (m/s^2), the number of samples that are not finite, the
    worst ratio of the level of 2 s to the usual one 100 ms after a repair, and counts.
    """

    beyond: float = 0.0
    at_rest: float = 0.0
    not_numbers: int = 0
    apart: float = 1.0
    steps: int = 0
    restarts: int = 0


def run_extremes(card: Path, minutes: float, seed: int = 1) -> Extremes:
    """Play all inputs as fast as possible. The window is corrupted 60 times, in the middle of a calm stroke."""
    voice, chance, extremes = open_voice(card, seed=seed), np.random.Generator(np.random.PCG64(seed)), Extremes()
    usual = _level([voice.step(*CALM) for _ in range(4000)][1000:])
    until, spoilt = round(minutes * 60_000), 0
    while extremes.steps < until:
        if extremes.steps >= spoilt * until // SPOILT_TIMES:
            _spoil(voice, SPOILT[spoilt % len(SPOILT)], usual, extremes)
            spoilt += 1
        speed, force = MOMENTS[int(chance.integers(len(MOMENTS)))]
        steps = int(chance.integers(*STEADY_MS))
        _record(voice, [voice.step(speed, force) for _ in range(steps)], extremes)
        if (speed, force) == (0.0, 0.0):
            extremes.at_rest = max(extremes.at_rest, *(abs(voice.step(0.0, 0.0)) for _ in range(10)))
    extremes.restarts = voice.tally.restarts
    return extremes


def _record(voice: Voice, samples: list[float], extremes: Extremes) -> None:
    extremes.steps += len(samples)
    extremes.not_numbers += sum(not math.isfinite(sample) for sample in samples)
    extremes.beyond = max(extremes.beyond, *(abs(sample) - voice.peak for sample in samples))


def _spoil(voice: Voice, wrong: float, usual: float, extremes: Extremes) -> None:
    """Play calmly, corrupt the whole window, wait 100 ms, and check the level that follows."""
    _record(voice, [voice.step(*CALM) for _ in range(500)], extremes)
    for window in windows(voice):
        window[:] = wrong
    _record(voice, [voice.step(*CALM) for _ in range(MEND_MS)], extremes)
    after = [voice.step(*CALM) for _ in range(2000)]
    _record(voice, after, extremes)
    ratio = _level(after) / usual if usual else 1.0
    extremes.apart = max(extremes.apart, ratio, 1 / ratio if ratio else math.inf)


def windows(voice: Voice) -> Iterator[NDArray[np.float64]]:
    """Yield the windows of past values that the model uses, if it has any."""
    window = getattr(voice.sounding_model, "window", None)
    if isinstance(window, np.ndarray):
        yield window


def _level(samples: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(samples))))
