"""Figures to reach for the renderer: deadlines at 1 kHz with the other core busy, bounds, the overhead of a step."""

from __future__ import annotations

import functools
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.render.extremes import Extremes, run_extremes
from benchmarks.render.model import measured_card
from palpate.devices.render.hand_simulated import simulated_hand
from palpate.devices.render.job import Job
from palpate.devices.render.process import Rendering
from palpate.protocols.bench import Case
from palpate.signals.models.card import Card
from palpate.signals.models.fastest import Runs, fastest
from palpate.signals.models.file import read_model
from palpate.signals.models.runtime import Model
from palpate.signals.textures.sounds import Sounds
from palpate.signals.textures.voice import open_voice

PACED_S, PACED_QUICK_S = 60.0, 3.0
MINUTES, MINUTES_QUICK = 10.0, 0.1
STEPS = 20_000
BUSY = "while True: pass"
Record = Mapping[str, Any]


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of deadlines by priority, of ten minutes of extremes, and of the overhead of a step."""
    folder = Path(mkdtemp(prefix="palpate-bench-"))
    card = measured_card(folder)
    yield from _deadlines(card, PACED_QUICK_S if quick else PACED_S)
    yield from _extremes(card, MINUTES_QUICK if quick else MINUTES)
    yield from _around(card, STEPS // 10 if quick else STEPS)


def _deadlines(card: Path, seconds: float) -> Iterator[Case]:
    looks: tuple[tuple[str, str, Callable[[Record], float | None], str], ...] = (
        ("underruns", "underruns", lambda record: float(record["output"]["underruns"]), "p99_us"),
        ("late without a buffer", "share later than 1 ms", lambda record: record["ready"]["late_share"], "p99_us"),
        ("longest wait", "ms from due to ready", lambda record: record["ready"]["worst_us"] / 1e3, "worst_us"),
        ("taken by the host", "s of all processors", lambda record: record["outside"]["stolen_s"], "worst_us"),
        ("kept waiting by others", "s of the loop", lambda record: record["outside"]["waited_s"], "worst_us"),
    )
    for real_time in (False, True):
        once = functools.cache(partial(paced, card, seconds, real_time))
        method = "real-time priority" if real_time else "normal priority"
        record = f"{card.stem}, 1 kHz for {seconds:g} s, buffer 10 ms, another core busy"
        for case, kind, error, at in looks:
            yield Case(
                "render", case, method, record, round(seconds * 1000), kind, once, _allowed(error, real_time), 1,
                lambda record, at=at: record["ready"][at] * 1e-6,  # type: ignore[misc]
            )  # fmt: skip


def _allowed(error: Callable[[Record], float | None], real_time: bool) -> Callable[[Record], float | None]:
    """Return an error function that gives None where real-time priority was refused."""
    return lambda record: None if real_time and not record["priority"].startswith("real-time") else error(record)


def paced(card: Path, seconds: float, real_time: bool, busy: int = 1) -> Record:
    """Return the record of a paced run beside `busy` processes that compute."""
    hand = simulated_hand(seconds, 1)
    job = Job(Sounds(card, 1), hand, real_time=real_time, seconds=seconds)
    with beside(busy), Rendering(job) as running:
        return running.wait(seconds + 60.0)


@contextmanager
def beside(count: int) -> Iterator[None]:
    """Run `count` processes that keep the processor busy."""
    processes = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _extremes(card: Path, minutes: float) -> Iterator[Case]:
    once = functools.cache(partial(run_extremes, card, minutes))
    looks: tuple[tuple[str, Callable[[Extremes], float]], ...] = (
        ("m/s^2 beyond the peak", lambda extremes: max(0.0, extremes.beyond)),
        ("m/s^2 at rest", lambda extremes: extremes.at_rest),
        ("samples that are not numbers", lambda extremes: float(extremes.not_numbers)),
        ("level 100 ms after spoiling, dB apart", lambda extremes: 20 * float(np.log10(extremes.apart))),
    )
    input_name = f"{card.stem}, {minutes:g} min: extremes, steps, lifting off, NaN, 1e6, spoilt windows"
    for kind, error in looks:
        yield Case("render", "free running", "voice", input_name, round(minutes * 60_000), kind, once, error, 1)


class Nothing:
    """A model that answers at once, so that only the overhead around a model is measured."""

    runtime = "nothing"

    def __init__(self, card: Card) -> None:
        """Take a model's card."""
        self.card = card
        self._answer = np.array([0.0, -30.0][: card.gives.size])

    def run(self, window: NDArray[np.float64]) -> NDArray[np.float64]:  # noqa: ARG002 - that is the point
        """Return a mean of 0, without noise."""
        return self._answer


def _around(card: Path, steps: int) -> Iterator[Case]:
    """Yield the cases of the median time of one step of a voice, with and without its model."""
    model = read_model(card)
    ways: dict[str, Callable[[Model], Runs]] = {
        "voice without its model": lambda read: Nothing(read.card),
        "voice with its model": fastest,
    }
    for method, runs in ways.items():
        yield Case(
            "render", "one step", method, card.stem, steps, "m/s^2 beyond the peak",
            lambda runs=runs: stepped(model, runs, steps), lambda answer: max(0.0, answer[1]), 1,  # type: ignore[misc]
            lambda answer: float(answer[0]),
        )  # fmt: skip


def stepped(model: Model, runs: Callable[[Model], Runs], steps: int) -> tuple[float, float]:
    """Return the median seconds of a step, and how far the largest sample lies beyond the peak."""
    voice = open_voice(model, seed=1, runs=runs)
    took, largest = [], 0.0
    for _ in range(steps):
        start = time.perf_counter_ns()
        sample = voice.step(100.0, 1.0)
        took.append(time.perf_counter_ns() - start)
        largest = max(largest, abs(sample))
    return statistics.median(took) * 1e-9, largest - voice.peak
