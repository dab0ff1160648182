"""Figures of touch from the sensors on: streams of known content, resampled to 1 kHz, filtered, and their features."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.memory import peak_bytes
from palpate.analysis.features.touch import RATE_HZ, TRIM_S, Touch
from palpate.analysis.features.touch_features import touch_features
from palpate.modeling.attributes.feature_times import SENSORS_HZ, felt_at, tones
from palpate.modeling.attributes.reading_touch import filtering, touch_of
from palpate.modeling.textures.preparing import Touched
from palpate.modeling.training.jobs import run_jobs
from palpate.protocols.bench import Case

AREA = "features of touch"
SECONDS, QUICK_SECONDS = 60.0, 10.0
ERROR = "vibration against what was felt, percent RMS"
STUDY, QUICK_STUDY = 50, 4
"""Number of textures of a study."""
WORKERS = 2
MEMORY = "largest memory of a process, MB"


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of one texture's three sensors (3, 8 and 0.12 kHz), and of fifty textures by two processes.

    60 s each, or four textures of 10 s if `quick`. The signals are computed beforehand: no ledger is read.
    """
    seconds, repeats = (QUICK_SECONDS, 1) if quick else (SECONDS, 3)
    touched = tones(seconds)
    ways: dict[str, Callable[[], Touch]] = {
        "as shipped": partial(_compute_features, touched, remove_hum=True),
        "hum not looked for": partial(_compute_features, touched, remove_hum=False),
    }
    for name, run in ways.items():
        yield Case(
            AREA, "from sensors to features", name, f"{seconds:g} s", round(seconds * SENSORS_HZ["force"]), ERROR, run,
            _percent_wrong, repeats,
        )  # fmt: skip
    yield from _study(QUICK_STUDY if quick else STUDY, seconds)


@dataclass(frozen=True)
class _Texture:
    name: str
    seconds: float


@dataclass(frozen=True)
class TextureCost:
    """The error of a texture's vibration, in percent, and its process's peak memory in MB."""

    percent: float
    peak_MB: float


def _study(count: int, seconds: float) -> Iterator[Case]:
    """Yield the cases of all textures of a study, each a job; memory is that of the same run."""
    jobs = [_Texture(f"recording {place + 1}", seconds) for place in range(count)]

    @functools.cache
    def run() -> tuple[list[TextureCost], float]:
        began = time.perf_counter()
        costs = run_jobs(_one, jobs, workers=WORKERS)
        return costs, time.perf_counter() - began

    looks: dict[str, Callable[[TextureCost], float]] = {
        ERROR: lambda cost: cost.percent, MEMORY: lambda cost: cost.peak_MB
    }  # fmt: skip
    for kind, look in looks.items():
        yield Case(
            AREA, "features of a study's recordings", "as shipped", f"{count} x {seconds:g} s, {WORKERS} processes",
            count * round(seconds * SENSORS_HZ["force"]), kind, run,
            partial(_greatest, look), seconds=lambda answer: answer[1],
        )  # fmt: skip


def _greatest(look: Callable[[TextureCost], float], answer: tuple[list[TextureCost], float]) -> float:
    return max(look(cost) for cost in answer[0])


def _one(texture: _Texture) -> TextureCost:
    percent = _percent_wrong(_compute_features(_tones_once(texture.seconds), remove_hum=True))
    return TextureCost(percent, peak_bytes() / 2**20)


@functools.cache
def _tones_once(seconds: float) -> Touched:
    """Return the signals, which a process computes once so that their cost hardly counts."""
    return tones(seconds)


def _compute_features(touched: Touched, remove_hum: bool) -> Touch:
    """Compute all features and return them with their inputs, to be evaluated."""
    touch, _ = touch_of("made up", [touched], filtering(remove_hum=remove_hum))
    touch_features(touch)
    return touch


def _percent_wrong(touch: Touch) -> float:
    """Return the error in percent; the truth begins `TRIM_S` after the first sample."""
    (stretch,) = touch.stretches
    expected = felt_at(TRIM_S + np.arange(len(stretch.axes)) / RATE_HZ)
    return float(100 * np.sqrt(((stretch.axes - expected) ** 2).sum() / (expected**2).sum()))
