"""Every method on the same folds of held-out switches: error and time side by side."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from sklearn.metrics import recall_score
from sklearn.model_selection import StratifiedGroupKFold

from benchmarks.keyswitch import classifying, reconstructing
from benchmarks.keyswitch.curves import CurveError, Curves, measured
from benchmarks.keyswitch.outcome import Outcome, timed
from benchmarks.keyswitch.settings import Size
from palpate.modeling.training.jobs import run_jobs
from palpate.protocols.progress import Clock, Report, silent
from palpate.signals.arrays import Array, Indices

RECONSTRUCTION, KIND = "reconstruction", "kind"


@dataclass(frozen=True)
class MethodScore:
    """One method on one task, over all folds; each switch was held out once.

    Reconstruction: `error` is the mean absolute and `second` the root-mean-square difference in gf. Kind: the share of
    wrong answers in percent, as the mean over kinds, and over switches. `training_s` is the mean time of one training,
    `inference_s` that of one curve.
    """

    task: str
    method: str
    code: int | None
    error: float
    second: float
    unit: str
    training_s: float
    inference_s: float


@dataclass(frozen=True)
class Part:
    """One method on one fold."""

    task: str
    method: str
    code: int | None
    fold: int
    size: Size
    curves: Curves = field(repr=False)

    @property
    def name(self) -> str:
        """The name in messages."""
        return f"{self.task}, {self.method}{f' {self.code}' if self.code else ''}, fold {self.fold + 1}"


def compare(
    size: Size,
    *,
    curves: Curves | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    report: Report = silent,
) -> tuple[MethodScore, ...]:
    """Compare all methods and code sizes on both tasks; the errors do not depend on workers or cluster.

    Without `curves` the shipped ones are used. Raises JobError where a job was refused.
    """
    all_curves = measured() if curves is None else curves
    parts = [Part(*way, fold, size, all_curves) for way in ways(size) for fold in range(size.folds)]
    outcomes = run_jobs(outcome, parts, workers=workers, cluster=cluster, threads=size.threads, report=report)
    return tuple(row_of(way, all_curves, size, outcomes[at : at + size.folds]) for way, at in _places(size))


def ways(size: Size) -> Iterator[tuple[str, str, int | None]]:
    """Yield task, method and code of every row."""
    yield RECONSTRUCTION, "mean curve", None
    for code in size.codes:
        yield RECONSTRUCTION, "PCA", code
        yield RECONSTRUCTION, "network", code
    for method in classifying.METHODS:
        yield KIND, method, size.components if method == "ridge on PCA" else None


def folds(curves: Curves, size: Size) -> list[tuple[Indices, Indices]]:
    """Return training and held-out rows of each fold: families stay on one side, kinds have about equal shares."""
    split = StratifiedGroupKFold(size.folds, shuffle=True, random_state=size.seed)
    return [(train, held_out) for train, held_out in split.split(curves.force_gf, curves.kind, curves.family)]


def outcome(part: Part, clock: Clock = time.perf_counter) -> Outcome:
    """Return the method's outcome on the held-out switches of its fold, scaled by the training side alone."""
    train, held_out = folds(part.curves, part.size)[part.fold]
    curves = part.curves.force_gf
    low, spread = curves[train].mean(), curves[train].std()
    if not spread > 0:
        raise CurveError(f"all forces of the training side are {low:g} gf: there is nothing to learn from.")
    scaled = (curves - low) / spread
    code, size = part.code or 0, part.size
    if part.task == KIND:
        fit_kind, kinds = classifying.METHODS[part.method], part.curves.kind[train]
        return timed(lambda: fit_kind(scaled[train], kinds, code, size, silent), scaled[held_out], clock)
    fit = reconstructing.METHODS[part.method]
    scaled_outcome = timed(lambda: fit(scaled[train], code, size, silent), scaled[held_out], clock)
    return Outcome(scaled_outcome.answer * spread + low, scaled_outcome.training_s, scaled_outcome.inference_s)


def _places(size: Size) -> Iterator[tuple[tuple[str, str, int | None], int]]:
    return ((way, number * size.folds) for number, way in enumerate(ways(size)))


def row_of(way: tuple[str, str, int | None], curves: Curves, size: Size, outcomes: Sequence[Outcome]) -> MethodScore:
    """Return the row of one method from the outcomes of its folds, in order."""
    held_out = np.concatenate([rows for _, rows in folds(curves, size)])
    answer = np.concatenate([outcome.answer for outcome in outcomes])
    errors_of: Any = _wrong if way[0] == KIND else _off
    error, second, unit = errors_of(answer, (curves.kind if way[0] == KIND else curves.force_gf)[held_out])
    training = float(np.mean([outcome.training_s for outcome in outcomes]))
    return MethodScore(
        *way, error, second, unit, training, float(np.mean([outcome.inference_s for outcome in outcomes]))
    )


def _off(answer: Array, truth: Array) -> tuple[float, float, str]:
    difference = answer - truth
    return float(np.mean(np.abs(difference))), float(np.sqrt(np.mean(difference**2))), "gf: mean absolute, RMS"


def _wrong(answer: Array, truth: Array) -> tuple[float, float, str]:
    balanced = 1.0 - float(recall_score(truth, answer, average="macro"))
    return 100 * balanced, 100 * float(np.mean(answer != truth)), "% wrong: mean over kinds, over switches"
