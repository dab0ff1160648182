"""Training a lab's models on all its stimuli, with what cross-validation says of them in their cards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.evaluating import DIRECTIONS, Judged, Wanted, context_for, judge
from palpate.modeling.doors.evaluating_files import ports
from palpate.modeling.doors.evaluating_gathered import Gathered
from palpate.modeling.doors.evaluating_jobs import ALL, WHOLE, Job
from palpate.modeling.doors.evaluating_kept import forget_checkpoints
from palpate.modeling.doors.evaluating_run import trained, with_below
from palpate.modeling.doors.evaluation_overall import attainable, forward_row, inverse_row
from palpate.modeling.doors.folding import Fold
from palpate.modeling.doors.intervals import interval
from palpate.modeling.doors.methods import Fitted, Method
from palpate.modeling.doors.registry import Direction
from palpate.modeling.training.history import history_of
from palpate.modeling.training.threads import limited
from palpate.modeling.training.written import Written, write_trained
from palpate.protocols.progress import Report
from palpate.signals.doors.grid import POINTS

NAMES: Mapping[Direction, str] = {"forward": "door-perception", "inverse": "door-force"}
TITLES: Mapping[Direction, str] = {"forward": "How a door feels", "inverse": "A door for a feeling"}


@dataclass(frozen=True)
class Training:
    """What is trained, where it goes, and how."""

    methods: Mapping[Direction, str]
    folder: Path
    wanted: Wanted
    known: Mapping[Direction, Mapping[str, Method]] = field(default_factory=lambda: ALL)


def train_pair(data: DoorData, asked: Training, report: Report) -> dict[Direction, Written]:
    """Cross-validate the two methods on grouped folds, train both on all stimuli, and write them with their cards.

    Trainings that an earlier, equal command finished are taken from where it kept them. Raises ModelDataError or what a
    method raises.
    """
    wanted = replace(asked.wanted, methods={way: (name,) for way, name in asked.methods.items()}, beside=False)
    context = context_for(data, wanted, asked.known)
    every = np.arange(len(data), dtype=np.int64)
    context = replace(context, splits={**context.splits, WHOLE: (Fold(WHOLE, every, every),)})
    found = judge(context, wanted, report)
    written: dict[Direction, Written] = {}
    models: dict[Job, tuple[Fitted, dict[str, float]]] = {}
    for job in (Job(way, asked.methods[way], WHOLE, 0) for way in DIRECTIONS if way in asked.methods):
        report(f"training and writing {NAMES[job.direction]}")
        with limited(1):
            model, numbers = models[job] = trained(job, context, models)
        written[job.direction] = _write(found, job.direction, model, numbers["train_s"], asked.folder)
    for used in {each for job in models for each in with_below(job, context)}:
        forget_checkpoints(used, context)
    return written


def _write(found: Judged, way: Direction, model: Fitted, seconds: float, folder: Path) -> Written:
    from palpate.modeling.files.writing import write_model

    context = found.context
    folds = found.methods(way)[0]
    method = context.methods[way][folds.method]
    metrics = _metrics(folds, method)
    takes, gives = ports(context, way)

    def write(to: Path) -> Path:
        card = write_model(
            to, NAMES[way], model.exported(),
            title=f"{TITLES[way]}: {method.title}", method=folds.method, takes=takes, gives=gives,
            interval=_interval(folds), metrics=metrics, training=_run_card(found, folds, metrics, seconds),
            notes=_notes(found),
        )  # fmt: skip
        _demand_equal(card, model, way, context.data)
        return card

    files = write_trained(folder, write, history_of(model))
    return Written(files[0], folds.method, metrics, files)


def _metrics(folds: Gathered, method: Method) -> dict[str, float]:
    """What cross-validation says, numbers only."""
    row = (
        forward_row(folds, method) if folds.direction == "forward" else inverse_row(folds, method, attainable([folds]))
    )
    told = {name: value for name, value in row.items() if isinstance(value, int | float) and math.isfinite(value)}
    return {name: float(value) for name, value in told.items() if not name.startswith(("file_", "trained_"))}


def _interval(folds: Gathered) -> Any:
    """The conformal interval of a model that predicts ratings; None where too few stimuli calibrate one."""
    if folds.direction == "inverse":
        return None
    try:
        return interval(folds.predicted - folds.actual)
    except ValueError:
        return None


def _run_card(found: Judged, folds: Gathered, metrics: Mapping[str, float], seconds: float) -> dict[str, Any]:
    """`seconds` are those of this process; where a worker trained ahead of it, the worker's count."""
    from palpate.modeling.training.run_card import run_card

    context = found.context
    ahead = found.found.get((folds.direction, folds.method, WHOLE))
    took = seconds if ahead is None else ahead.total("train_s")
    number = len(context.splits["grouped"])
    settings = {**context.settings, "seed": context.seed, "method": folds.method, "folds": number, "split": "grouped",
                "made_from": list(context.data.made_from)}  # fmt: skip
    return run_card({"data": context.data.digest}, settings, metrics, took)


def _notes(found: Judged) -> tuple[str, ...]:
    data = found.context.data
    told = [f"Trained on all {len(data)} stimuli; the metrics are those of cross-validation on grouped folds."]
    if data.simulated:
        told.append(
            "The ratings are those of simulated people: this model says nothing about how a door feels to anybody."
        )
    if found.wanted.quick:
        told.append("A quick training, to try things out: three folds, few epochs. Its numbers are nothing to go by.")
    return tuple(told)


def _demand_equal(card: Path, model: Fitted, way: Direction, data: DoorData) -> None:
    """What the rig will read answers as the trained model does. Raises ModelDataError where it does not."""
    from palpate.modeling.doors.data import ModelDataError
    from palpate.signals.models.file import read_model

    given = data.force_N if way == "forward" else np.clip(np.full((1, len(data.attributes)), 50.0), 0, 100)
    ours, theirs = model.predict(given), np.asarray(read_model(card).run(given), dtype=np.float64)
    off = float(np.max(np.abs(ours - theirs)))
    if off > 1e-3 * max(1.0, float(np.max(np.abs(ours)))):
        raise ModelDataError(
            f"{card}: the file answers {off:.2g} off the trained model (of {POINTS} points): not usable."
        )
