"""Figures of the shipped texture models on their own output, under hands used in neither training nor selection."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from palpate.modeling.textures.drive import explored
from palpate.modeling.textures.free_run import CYCLE, ENVELOPE, GFC, LEVEL, Numbers, ceiling, free_run_scores
from palpate.modeling.textures.simulator import TextureSimulator
from palpate.protocols.bench import Case
from palpate.protocols.progress import Clock
from palpate.signals.textures.voice import play

AREA = "free running"
AGAIN, METHODS = "another realisation", ("foten_generative", "ar")
"""The best possible result, the default, and the method that it must beat."""
HANDS, QUICK_HANDS = range(301, 309), range(301, 302)
"""Seeds of explorations; 0, 101 to 106 and 201 to 208 were used while models were selected."""
SECONDS, QUICK_SECONDS = 60.0, 10.0
Cards = Mapping[str, Mapping[str, Path]]
Summary = Callable[[Sequence[float]], float]


def _off_one(every: Sequence[float]) -> float:
    return 1 - statistics.fmean(every)


LOOKS: tuple[tuple[str, str, Summary], ...] = (
    ("felt_dB", "felt distance, dB, mean of the hands", statistics.fmean),
    (
        "level",
        f"level off by, worst (at most {LEVEL[1] - 1:.2f})",
        lambda every: max(abs(level - 1) for level in every),
    ),
    ("smoothed_gfc", f"1 - smoothed GFC, worst (at most {1 - GFC:.2f})", lambda every: 1 - min(every)),
    ("envelope", f"1 - envelope correlation, mean (at most {1 - ENVELOPE:.2f})", _off_one),
    ("cycle_excess", f"repeats above the truth's, worst (at most {CYCLE:.1f})", lambda every: max(0.0, *every)),
)


@dataclass
class Hands:
    """One texture under all hands, evaluated on first use. `models` are cards by method."""

    simulator: TextureSimulator
    texture: str
    models: Mapping[str, Path]
    seeds: Sequence[int]
    seconds: float
    clock: Clock = time.perf_counter
    numbers: dict[str, list[Numbers]] = field(default_factory=dict)
    took: dict[str, list[float]] = field(default_factory=dict)

    def of(self, method: str) -> tuple[list[Numbers], list[float]]:
        """Return the figures of each hand's run, and the seconds of each run."""
        if not self.numbers:
            for seed in self.seeds:
                self._play(seed)
        return self.numbers[method], self.took[method]

    def _play(self, seed: int) -> None:
        began = self.clock()
        drive = explored(self.simulator, self.texture, self.seconds, seed)
        self._record(AGAIN, ceiling(drive), began)
        for method, card in self.models.items():
            began = self.clock()
            self._record(method, free_run_scores(play(card, drive.speed, drive.force, seed), drive), began)

    def _record(self, method: str, numbers: Numbers, began: float) -> None:
        self.took.setdefault(method, []).append(self.clock() - began)
        self.numbers.setdefault(method, []).append(numbers)


def cases(quick: bool, simulator: TextureSimulator, cards: Cards, clock: Clock = time.perf_counter) -> Iterator[Case]:
    """Yield the cases of each texture: the default method, autoregression, and the texture simulated again."""
    seeds, seconds = (QUICK_HANDS, QUICK_SECONDS) if quick else (HANDS, SECONDS)
    for texture, models in cards.items():
        chosen = {method: models[method] for method in METHODS if method in models}
        hands = Hands(simulator, texture, chosen, seeds, seconds, clock)
        input_name = f"{texture}, {len(seeds)} hands of {seconds:g} s"
        for name, kind, summary in LOOKS:
            for method in (AGAIN, *chosen):
                yield Case(
                    AREA, f"{texture}: {name}", method, input_name, len(seeds), kind, partial(hands.of, method),
                    partial(_summary, name, summary), 1, _median_s,
                )  # fmt: skip


def _summary(name: str, summary: Summary, answer: tuple[list[Numbers], list[float]]) -> float | None:
    known = [value for numbers in answer[0] if (value := numbers.get(name)) is not None]
    return summary(known) if known else None


def _median_s(answer: tuple[list[Numbers], list[float]]) -> float:
    return statistics.median(answer[1])
