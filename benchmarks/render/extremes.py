"""Ten minutes of everything that can come in: extremes, steps, lifting off, broken sensors, a spoilt window."""

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
"""Speed in mm/s and force in N; gone through in steps, in an order that is drawn."""
HELD_MS = (20, 700)
SPOILT_TIMES = 60
"""In all."""
SPOILT = (NAN, math.inf, 1e6, -1e6)
CALM = 100.0, 1.0
MEND_MS = 100


@dataclass
class Extremes:
    """What came of it: the largest sample beyond the peak and the largest at rest (m/s^2), samples that were no
    numbers, how far the level of 2 s was from usual after 100 ms of mending (ratio, the worst), and counts."""

    beyond: float = 0.0
    at_rest: float = 0.0
    not_numbers: int = 0
    apart: float = 1.0
    steps: int = 0
    restarts: int = 0


def run_extremes(card: Path, minutes: float, seed: int = 1) -> Extremes:
    """Play it all, as fast as it goes. The window is spoilt 60 times, in the middle of a calm stroke."""
    voice, chance, found = open_voice(card, seed=seed), np.random.Generator(np.random.PCG64(seed)), Extremes()
    usual = _level([voice.step(*CALM) for _ in range(4000)][1000:])
    until, spoilt = round(minutes * 60_000), 0
    while found.steps < until:
        if found.steps >= spoilt * until // SPOILT_TIMES:
            _spoil(voice, SPOILT[spoilt % len(SPOILT)], usual, found)
            spoilt += 1
        speed, force = MOMENTS[int(chance.integers(len(MOMENTS)))]
        held = int(chance.integers(*HELD_MS))
        _judge(voice, [voice.step(speed, force) for _ in range(held)], found)
        if (speed, force) == (0.0, 0.0):
            found.at_rest = max(found.at_rest, *(abs(voice.step(0.0, 0.0)) for _ in range(10)))
    found.restarts = voice.tally.restarts
    return found


def _judge(voice: Voice, samples: list[float], found: Extremes) -> None:
    found.steps += len(samples)
    found.not_numbers += sum(not math.isfinite(each) for each in samples)
    found.beyond = max(found.beyond, *(abs(each) - voice.peak for each in samples))


def _spoil(voice: Voice, wrong: float, usual: float, found: Extremes) -> None:
    """Play calmly, spoil the whole window, wait 100 ms, and check the level of what follows."""
    _judge(voice, [voice.step(*CALM) for _ in range(500)], found)
    for window in windows(voice):
        window[:] = wrong
    _judge(voice, [voice.step(*CALM) for _ in range(MEND_MS)], found)
    after = [voice.step(*CALM) for _ in range(2000)]
    _judge(voice, after, found)
    ratio = _level(after) / usual if usual else 1.0
    found.apart = max(found.apart, ratio, 1 / ratio if ratio else math.inf)


def windows(voice: Voice) -> Iterator[NDArray[np.float64]]:
    """Yield the windows that the model looks back on, where it has any."""
    window = getattr(voice.sounding_model, "window", None)
    if isinstance(window, np.ndarray):
        yield window


def _level(samples: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(samples))))
