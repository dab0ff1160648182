"""Figures of the door models: every method's error on grouped folds beside the times of an answer and of training.

Everything is trained once, before the first row, by one process per core; rows about training have the seconds that
were measured then.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.precomputed import constant, precomputed_case
from palpate.modeling.doors.ceiling import Ceiling, noise_ceiling
from palpate.modeling.doors.evaluation.evaluate import floors
from palpate.modeling.doors.evaluation.method_rows import attainable, loop_rows, method_rows
from palpate.modeling.doors.evaluation.tables import Row
from palpate.modeling.doors.plausibility import corners
from palpate.modeling.doors.rated import Rated
from palpate.modeling.doors.reading import simulated_ratings
from palpate.modeling.doors.registry import DEFAULT, THESIS, Direction
from palpate.modeling.doors.results import DoorOptions, DoorResults, domain_for, evaluate_methods
from palpate.protocols.bench import Case
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array
from palpate.signals.models.file import read_model
from palpate.signals.models.runtime import Model

AREA = "doors"
QUICK_FOLDS, FOLDS = 2, 5
QUICK_PEOPLE, PEOPLE = 8, 40
ANSWERS = 500
"""Number of single answers for a 99th percentile."""
SINGLE = 25
"""Least number of timed single answers: the first few of a large network wait for memory."""


@dataclass(frozen=True)
class Trained:
    """The results of one training run: all figures, the folder of the exported models, the total time."""

    rated: Rated
    results: DoorResults
    folder: Path
    seconds: float
    workers: int

    @property
    def input_name(self) -> str:
        """The data, as named in a row."""
        data, folds = self.rated.data, len(self.results.domain.splits["grouped"])
        return f"{len(data)} profiles x {len(self.rated.individual.people)} people, {folds} folds"

    def rows(self, way: Direction) -> list[Row]:
        """Return the numbers of each method of a direction."""
        return list(method_rows(self.results, way))

    def model(self, way: Direction, method: str) -> Model | None:
        """Return the first fold's model from its file; None for a method without a file."""
        card = self.folder / f"{way}-{method}.json"
        return read_model(card) if card.exists() else None


def cases(quick: bool, options: DoorOptions | None = None, rated: Rated | None = None) -> Iterator[Case]:
    """Yield every figure of this area; `quick` uses fewer people and folds, and few epochs of the networks.

    Without `options` every method is trained; without `rated` people are simulated.
    """
    with tempfile.TemporaryDirectory() as folder:
        people = QUICK_PEOPLE if quick else PEOPLE
        trained = train_all(quick, Path(folder), options, rated or simulated_ratings(people))
        yield from _forward(trained)
        yield from _inverse(trained)
        yield from _floors(trained)
        yield from _slowest(trained)
        yield from _training(trained)


def train_all(
    quick: bool, folder: Path, options: DoorOptions | None, rated: Rated, clock: Clock = time.perf_counter
) -> Trained:
    """Train and evaluate every method once; the exported models stay in the folder."""
    base = options or DoorOptions(quick=quick, folds=QUICK_FOLDS if quick else FOLDS)
    train_options = replace(base, beside=False, work=folder / "jobs", files=folder / "models")
    start = clock()
    results = evaluate_methods(domain_for(rated.data, train_options), train_options)
    workers = train_options.workers or os.cpu_count() or 1
    return Trained(rated, results, folder / "models", clock() - start, workers)


def method_name(way: Direction, method: str) -> str:
    """Return a method's name in the table; the shipped defaults, the reference of the others' times, are marked."""
    return f"palpate, {method}" if method == DEFAULT[way] else method


def _forward(trained: Trained) -> Iterator[Case]:
    kind, case = "MAE of mean ratings, 0 to 100, grouped folds", "force to feeling"
    forces = trained.rated.data.force_N
    for row in trained.rows("forward"):
        yield _answer(trained, case, "forward", row, kind, row["mae"], forces)
    yield Case(AREA, case, "a perfect predictor (noise ceiling)", trained.input_name, len(trained.rated.data), kind,
               partial(noise_ceiling, trained.rated), _ceiling_mae, 1)  # fmt: skip


def _ceiling_mae(ceiling: Ceiling) -> float:
    return float(ceiling.mae[-1])


def _inverse(trained: Trained) -> Iterator[Case]:
    wishes = trained.results.domain.scaling.rating_up(trained.rated.data.rating)
    ends = corners(wishes.shape[1])
    for name, kind in (
        ("loop_fresh", "loop: mean off the wish, 0 to 100, by fresh simulated people"),
        ("loop_attainable", "loop, wishes that can be had: mean off the wish, 0 to 100, by fresh simulated people"),
        ("loop_judge", "loop: mean off the wish, 0 to 100, by the forward model"),
        ("waveform_mae", "waveform MAE, % of the range of forces, grouped folds"),
    ):
        for row in trained.rows("inverse"):
            yield _answer(trained, "feeling to force", "inverse", row, kind, row[name], wishes)
    kind = "loop, wishes that can be had: of the attribute that is farthest off"
    for row, worst in zip(trained.rows("inverse"), _farthest(trained), strict=True):
        yield _answer(trained, "feeling to force", "inverse", row, kind, worst, wishes)
    kind = "corners that come to a profile beyond the limits"
    for row in trained.rows("inverse"):
        yield _answer(
            trained, f"{len(ends)} corners", "inverse", row, kind, row["corners_unplayable"], ends, at_once=True
        )


def _farthest(trained: Trained) -> list[float]:
    methods = trained.results.methods("inverse")
    within = attainable(methods)
    return [max(row["loop_attainable"] for row in loop_rows(method, within)) for method in methods]


def _floors(trained: Trained) -> Iterator[Case]:
    kind = "waveform MAE, % of the range of forces, grouped folds"
    for row in floors(trained.results.domain):
        run = partial(floors, trained.results.domain)
        yield _case(trained, "feeling to force", f"floor: {row['what']}", kind, run, row["mae"], 1)


def _slowest(trained: Trained) -> Iterator[Case]:
    """Yield the 99th percentile of single answers, for which a person at the slider waits."""
    wishes = trained.results.domain.scaling.rating_up(trained.rated.data.rating)
    directions: tuple[tuple[Direction, str, Array], ...] = (
        ("forward", "a prediction", trained.rated.data.force_N), ("inverse", "a slider's move to its profile", wishes),
    )  # fmt: skip
    for way, what, inputs in directions:
        for method in (row["method"] for row in trained.rows(way)):
            if (model := trained.model(way, method)) is None:
                continue
            run = partial(_one, model, inputs)
            yield Case(AREA, what, method_name(way, method), trained.input_name, 1,
                       f"ms, 99th percentile of {ANSWERS}", run, partial(_p99, model, inputs), SINGLE)  # fmt: skip


def _training(trained: Trained) -> Iterator[Case]:
    """Yield the cases of each method's training: its result and the seconds of all folds together."""
    note = f"time of training, sum over the folds, {trained.workers} at a time"
    forward, inverse = trained.rows("forward"), trained.rows("inverse")
    for row in forward:
        kind = f"MAE of mean ratings, 0 to 100; {note}"
        method = method_name("forward", row["method"])
        yield _known_case(trained, "training, force to feeling", method, kind, row["mae"], row["train_s"])
    kind, case = f"loop: mean off the wish, 0 to 100, by fresh simulated people; {note}", "training, feeling to force"
    for row in inverse:
        yield _known_case(trained, case, method_name("inverse", row["method"]), kind, row["loop_fresh"], row["train_s"])
    networks = [row for row in (*forward, *inverse) if row["method"] == THESIS]
    if len(networks) > 1:
        both = sum(row["train_s"] for row in networks)
        yield _known_case(trained, case, "both networks of the thesis", kind, networks[1]["loop_fresh"], both)
    if inverse:
        least = min(row["loop_fresh"] for row in inverse)
        whole = "the least loop error; time from the first training to the last answer"
        yield _known_case(trained, case, "all methods", whole, least, trained.seconds)


def _case(
    trained: Trained,
    case: str,
    method: str,
    kind: str,
    run: Callable[[], object],
    error: float | None,
    repeats: int = SINGLE,
) -> Case:
    return Case(AREA, case, method, trained.input_name, len(trained.rated.data), kind, run, constant(error), repeats)


def _answer(
    trained: Trained, case: str, way: Direction, row: Row, kind: str, error: float | None, inputs: Array,
    at_once: bool = False,
) -> Case:  # fmt: skip
    """Return a case with a method's error and the time of its file for one answer, or for all at once (`at_once`).

    A method without a file answered during its evaluation; its time is from then.
    """
    method, model = method_name(way, row["method"]), trained.model(way, row["method"])
    if model is None:
        seconds = 1e-3 * row["trained_ms"] * (len(inputs) if at_once else 1)
        return _known_case(trained, case, f"{method} (no file)", kind, error, seconds)
    run = partial(model.run, inputs if at_once else inputs[0])
    return _case(trained, case, method, kind, run, error, 1 if at_once else SINGLE)


def _known_case(trained: Trained, case: str, method: str, kind: str, error: float | None, seconds: float) -> Case:
    n = len(trained.rated.data)
    return precomputed_case(AREA, case, method, trained.input_name, n, kind, error, seconds)


def _one(model: Model, inputs: Array) -> Array:
    """Return the model's answer to the first row."""
    return model.run(inputs[0])


def _p99(model: Model, inputs: Array, _answer: object, clock: Clock = time.perf_counter) -> float:
    times = []
    for i in range(ANSWERS):
        start = clock()
        model.run(inputs[i % len(inputs)])
        times.append(clock() - start)
    return 1e3 * float(np.percentile(times, 99))
