"""Training of a lab's models on all its stimuli, with the results of cross-validation in their cards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.domain import ALL, WHOLE, FoldJob, train_job, with_prerequisite
from palpate.modeling.doors.evaluation.method_rows import attainable, forward_row, inverse_row
from palpate.modeling.doors.folding import Fold
from palpate.modeling.doors.methods import Fitted, Method
from palpate.modeling.doors.model_scores import ports
from palpate.modeling.doors.registry import Direction
from palpate.modeling.doors.results import (
    DIRECTIONS,
    DoorOptions,
    DoorResults,
    MethodResults,
    domain_for,
    evaluate_methods,
)
from palpate.modeling.evaluate.intervals import interval
from palpate.modeling.training.history import history_of
from palpate.modeling.training.threads import limited
from palpate.modeling.training.trained_files import Written, write_trained
from palpate.protocols.progress import Report
from palpate.signals.doors.grid import POINTS

NAMES: Mapping[Direction, str] = {"forward": "door-perception", "inverse": "door-force"}
TITLES: Mapping[Direction, str] = {"forward": "How a door feels", "inverse": "A door for a feeling"}


@dataclass(frozen=True)
class Training:
    """The methods to train for each direction, the folder for their models, and the options."""

    methods: Mapping[Direction, str]
    folder: Path
    options: DoorOptions
    known: Mapping[Direction, Mapping[str, Method]] = field(default_factory=lambda: ALL)


def train_pair(data: DoorData, training: Training, report: Report) -> dict[Direction, Written]:
    """Cross-validate the two methods on grouped folds, train both on all stimuli, and write them with their cards.

    Trainings that an earlier, equal command finished are loaded from its saved jobs. Raises ModelDataError, or what a
    method raises.
    """
    options = replace(training.options, methods={way: (name,) for way, name in training.methods.items()}, beside=False)
    domain = domain_for(data, options, training.known)
    every = np.arange(len(data), dtype=np.int64)
    domain = replace(domain, splits={**domain.splits, WHOLE: (Fold(WHOLE, every, every),)})
    results = evaluate_methods(domain, options, report)
    written: dict[Direction, Written] = {}
    models: dict[FoldJob, tuple[Fitted, dict[str, float]]] = {}
    for job in (FoldJob(way, training.methods[way], WHOLE, 0) for way in DIRECTIONS if way in training.methods):
        report(f"training and writing {NAMES[job.direction]}")
        with limited(1):
            model, numbers = models[job] = train_job(job, domain, models)
        written[job.direction] = _write(results, job.direction, model, numbers["train_s"], training.folder)
    for used in {needed for job in models for needed in with_prerequisite(job, domain)}:
        domain.remove_checkpoint(used)
    return written


def _write(results: DoorResults, way: Direction, model: Fitted, seconds: float, folder: Path) -> Written:
    from palpate.modeling.files.model_files import write_model

    domain = results.domain
    folds = results.methods(way)[0]
    method = domain.methods[way][folds.method]
    # the scores of the cross-validation, numbers only
    row = (
        forward_row(folds, method) if folds.direction == "forward" else inverse_row(folds, method, attainable([folds]))
    )
    finite = {name: value for name, value in row.items() if isinstance(value, int | float) and math.isfinite(value)}
    metrics = {name: float(value) for name, value in finite.items() if not name.startswith(("file_", "trained_"))}
    takes, gives = ports(domain.data, domain.scaling, way)

    def write(to: Path) -> Path:
        card = write_model(
            to, NAMES[way], model.exported(),
            title=f"{TITLES[way]}: {method.title}", method=folds.method, takes=takes, gives=gives,
            interval=_interval(folds), metrics=metrics, training=_run_card(results, folds, metrics, seconds),
            notes=_notes(results),
        )  # fmt: skip
        # the model that the rig will read must answer as the trained one does
        from palpate.modeling.evaluate.rows import ModelDataError
        from palpate.signals.models.file import read_model

        given = (
            domain.data.force_N
            if way == "forward"
            else np.clip(np.full((1, len(domain.data.attributes)), 50.0), 0, 100)
        )
        ours, theirs = model.predict(given), np.asarray(read_model(card).run(given), dtype=np.float64)
        off = float(np.max(np.abs(ours - theirs)))
        if off > 1e-3 * max(1.0, float(np.max(np.abs(ours)))):
            raise ModelDataError(
                f"{card}: the file answers {off:.2g} off the trained model (of {POINTS} points): not usable."
            )
        return card

    files = write_trained(folder, write, history_of(model))
    return Written(files[0], folds.method, metrics, files)


def _interval(folds: MethodResults) -> Any:
    """Return the conformal interval of a model that predicts ratings; None where too few stimuli calibrate one."""
    if folds.direction == "inverse":
        return None
    try:
        return interval(folds.predicted - folds.actual)
    except ValueError:
        return None


def _run_card(
    results: DoorResults, folds: MethodResults, metrics: Mapping[str, float], seconds: float
) -> dict[str, Any]:
    """Return the run card; `seconds` are those of this process, or of the worker that trained ahead of it, if any."""
    from palpate.modeling.training.run_card import run_card

    domain = results.domain
    ahead = results.by_method.get((folds.direction, folds.method, WHOLE))
    elapsed_s = seconds if ahead is None else ahead.total("train_s")
    number = len(domain.splits["grouped"])
    settings = {**domain.settings, "seed": domain.seed, "method": folds.method, "folds": number, "split": "grouped",
                "made_from": list(domain.data.made_from)}  # fmt: skip
    return run_card({"data": domain.data.digest}, settings, metrics, elapsed_s)


def _notes(results: DoorResults) -> tuple[str, ...]:
    data = results.domain.data
    notes = [f"Trained on all {len(data)} stimuli; the metrics are those of cross-validation on grouped folds."]
    if data.simulated:
        notes.append(
            "The ratings are those of simulated people: this model says nothing about how a door feels to people."
        )
    if results.options.quick:
        notes.append("A quick training, to try things out: three folds, few epochs. Its numbers are nothing to go by.")
    return tuple(notes)
