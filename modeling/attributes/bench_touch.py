"""Figures of touch from the sensors on: streams of known content brought to 1 kHz, filtered, and made features of."""

from __future__ import annotations

import functools
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from analysis.features.tactile import touch_features
from analysis.features.touch import RATE_HZ, TRIM_S, Array, Touch
from modeling.attributes.touching import filtering, touch_of
from modeling.textures.preparing import Touched
from modeling.textures.rates import evenly
from modeling.training.jobs import run_jobs
from protocols.bench import Case

AREA = "features of touch"
SECONDS, QUICK_SECONDS = 60.0, 10.0
TONES_HZ = (31.0, 47.0, 83.0, 127.0, 173.0, 229.0, 311.0, 389.0)
"""Within the band; none is a multiple of mains."""
ERROR = "vibration against what was felt, percent RMS"
SENSORS_HZ = {"acceleration": 3000.0, "force": 8000.0, "position": 120.0}
GRAVITY_M_S2 = 9.81
STUDY, QUICK_STUDY = 50, 4
"""Textures of a study."""
WORKERS = 2
MEMORY = "largest memory of a process, MB"


def cases(quick: bool) -> Iterator[Case]:
    """One texture from its three sensors (3, 8 and 0.12 kHz) to all its features, and fifty of them by two processes:
    60 s each, four of 10 s if `quick`. The signals are there already: no ledger is read."""
    seconds, repeats = (QUICK_SECONDS, 1) if quick else (SECONDS, 3)
    touched = tones(seconds)
    ways: dict[str, Callable[[], Touch]] = {
        "as shipped": partial(_featured, touched, remove_hum=True),
        "hum not looked for": partial(_featured, touched, remove_hum=False),
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
class _Made:
    """How far a texture's vibration was off, in percent, and what its process had of memory at most, in MB."""

    percent: float
    peak_MB: float


def _study(count: int, seconds: float) -> Iterator[Case]:
    """All textures of a study, each a job; memory is that of the same run."""
    jobs = [_Texture(f"recording {place + 1}", seconds) for place in range(count)]

    @functools.cache
    def run() -> tuple[list[_Made], float]:
        began = time.perf_counter()
        made = run_jobs(_one, jobs, workers=WORKERS)
        return made, time.perf_counter() - began

    looks: dict[str, Callable[[_Made], float]] = {ERROR: lambda made: made.percent, MEMORY: lambda made: made.peak_MB}
    for kind, look in looks.items():
        yield Case(
            AREA, "features of a study's recordings", "as shipped", f"{count} x {seconds:g} s, {WORKERS} processes",
            count * round(seconds * SENSORS_HZ["force"]), kind, run,
            partial(_greatest, look), seconds=lambda found: found[1],
        )  # fmt: skip


def _greatest(look: Callable[[_Made], float], found: tuple[list[_Made], float]) -> float:
    return max(look(each) for each in found[0])


def _one(texture: _Texture) -> _Made:
    percent = _percent_wrong(_featured(_tones_once(texture.seconds), remove_hum=True))
    return _Made(percent, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


@functools.cache
def _tones_once(seconds: float) -> Touched:
    """What a process makes once, so that it hardly counts."""
    return tones(seconds)


def tones(seconds: float) -> Touched:
    """A capture whose vibration is known at any time (`felt_at`), with gravity and a hand that strokes slowly."""
    at = {what: np.arange(round(seconds * rate_hz)) / rate_hz for what, rate_hz in SENSORS_HZ.items()}
    t = at["position"]
    place = np.stack([40 * np.sin(3 * t), 40 * np.cos(3 * t), 0 * t], axis=1)
    force = 1.2 + 0.5 * np.cos(2 * at["force"])
    signals = {
        "acceleration": felt_at(at["acceleration"]) + np.array([0, 0, GRAVITY_M_S2]),
        "force": np.stack([0 * force, 0 * force, force], axis=1), "position": place,
    }  # fmt: skip
    sampled = {what: evenly(what, values, SENSORS_HZ[what], "made up") for what, values in signals.items()}
    return Touched("made up", sampled["acceleration"], sampled["force"], position=sampled["position"])


def felt_at(times_s: Array) -> Array:
    """Acceleration (n, 3) in m/s^2: tones that swell and fade, each with its own phase on each axis."""
    chance = np.random.Generator(np.random.PCG64(0))
    found = np.zeros((len(times_s), 3))
    for hertz in TONES_HZ:
        swells = 1 + 0.5 * np.sin(2 * np.pi * chance.uniform(0.5, 2) * times_s + chance.uniform(0, 6))
        for axis in range(3):
            found[:, axis] += swells * np.sin(2 * np.pi * hertz * times_s + chance.uniform(0, 6))
    return found


def _featured(touched: Touched, remove_hum: bool) -> Touch:
    """All features are made, and what they were made of is handed on to be judged."""
    found, _ = touch_of("made up", [touched], filtering(remove_hum=remove_hum))
    touch_features(found)
    return found


def _percent_wrong(found: Touch) -> float:
    """The stretch begins `TRIM_S` after the first sample."""
    (stretch,) = found.stretches
    wanted = felt_at(TRIM_S + np.arange(len(stretch.axes)) / RATE_HZ)
    return float(100 * np.sqrt(((stretch.axes - wanted) ** 2).sum() / (wanted**2).sum()))
