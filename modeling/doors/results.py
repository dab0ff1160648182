"""Every method on the same folds, in parallel; finished jobs are saved, so that an interrupted evaluation resumes."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.doors.data import TOP, DoorData, scaling_of
from palpate.modeling.doors.domain import ALL, LEAKY, WHOLE, DoorDomain, FoldJob
from palpate.modeling.doors.folding import KINDS, Fold, Kinds, folds
from palpate.modeling.doors.methods import Method
from palpate.modeling.doors.registry import DEFAULT, ON_REQUEST, SLOW, Direction
from palpate.modeling.doors.training_variants import with_variants
from palpate.modeling.evaluate.engine import EvaluateOptions, Result, Results, evaluate
from palpate.protocols.progress import Clock, Report, silent
from palpate.signals.arrays import Array, Indices

FOLDS, QUICK_FOLDS = 5, 3
QUICKLY: Mapping[str, Any] = {"quick": True}
"""The settings of a quick evaluation: networks train a few epochs on the stimuli alone, the generator little."""
NOT_QUICK = frozenset({("inverse", "search")})
"""Methods that a quick evaluation leaves out unless they are named: each of their answers is a search."""
DIRECTIONS: tuple[Direction, ...] = ("forward", "inverse")


@dataclass(frozen=True, kw_only=True)
class DoorOptions(EvaluateOptions):
    """The options of an evaluation: methods by direction (None: all), the split that counts, settings.

    With `beside` the methods that take seconds are evaluated on the other splits too, so that the splits can be
    compared. `work` is the folder of finished jobs, None to save nothing; `files` a folder for the exported models.
    """

    methods: Mapping[Direction, tuple[str, ...]] | None = None
    split: Kinds = "grouped"
    settings: Mapping[str, Any] = field(default_factory=dict)
    work: Path | None = None
    beside: bool = True
    folds: int = FOLDS
    files: Path | None = None


@dataclass(frozen=True)
class MethodResults:
    """The results of one method on one split, rows in the data's order.

    Forward: `actual` and `predicted` (n, attributes) on 0..100, `sd` the SD between raters on the same. Inverse: both
    are (n, 621) in percent of the range of all forces, `made_N` the made profiles in newtons. `fold` (n,) says in which
    fold a row was tested; `folds` are the results of each.
    """

    direction: Direction
    method: str
    split: str
    data: DoorData
    fold: Indices
    actual: Array
    predicted: Array
    sd: Array
    folds: tuple[Result[FoldJob], ...]

    def number(self, name: str) -> float | None:
        """Return the number from the first fold that has it, None where none has."""
        return next((_number(result, name) for result in self.folds if name in result.numbers), None)

    def total(self, name: str) -> float:
        """Return the sum of a number over the folds that have it."""
        return float(sum(_number(result, name) for result in self.folds if name in result.numbers))

    def array(self, name: str) -> Array | None:
        """Return an array with a row for each tested stimulus, in the data's order; None where the folds have none."""
        if not all(name in fold.arrays for fold in self.folds):
            return None
        joined = np.concatenate([result.arrays[name] for result in self.folds])
        return np.asarray(joined[np.argsort(_tested_rows(self.folds), kind="stable")])


def _number(result: Result[FoldJob], name: str) -> float:
    value = result.numbers[name]
    return math.nan if value is None else value


@dataclass(frozen=True)
class DoorResults:
    """The results of every method on every split that it was evaluated on, and the seconds of this run."""

    domain: DoorDomain
    options: DoorOptions
    jobs: Results[FoldJob]
    by_method: Mapping[tuple[Direction, str, str], MethodResults]
    seconds: float

    def methods(self, direction: Direction, split: str | None = None) -> list[MethodResults]:
        """Return the results of one direction on one split (the one that counts), in the methods' order."""
        split = split or self.options.split
        return [results for (way, _, on), results in self.by_method.items() if (way, on) == (direction, split)]


def folds_for(quick: bool) -> int:
    """Return the number of folds of an evaluation or a training without an option for it."""
    return QUICK_FOLDS if quick else FOLDS


def domain_for(
    data: DoorData, options: DoorOptions,
    methods: Mapping[Direction, Mapping[str, Method]] = ALL, clock: Clock = time.perf_counter,
) -> DoorDomain:  # fmt: skip
    """Return the domain of all jobs. Raises ModelDataError for data that cannot be folded, or an unknown split."""
    kinds = KINDS if options.beside else (options.split,)
    lone = () if len(set(data.doors)) > 1 else ("leave_one_door_out",)  # where it was requested, `folds` refuses it
    splits: dict[str, tuple[Fold, ...]] = {
        kind: folds(with_variants(data, options.seed) if kind == LEAKY else data, options.folds, kind, options.seed)
        for kind in kinds
        if kind == options.split or kind not in lone
    }
    return DoorDomain(
        data=data,
        splits=splits,
        scaling=scaling_of(data),
        seed=options.seed,
        judge=DEFAULT["forward"],
        full=options.split,
        settings={"threads": 1, **(QUICKLY if options.quick else {}), **options.settings},
        work=options.work,
        files=options.files,
        methods=methods,
        clock=clock,
    )


def waves(domain: DoorDomain, options: DoorOptions) -> tuple[list[FoldJob], list[FoldJob]]:
    """Return the jobs in two waves, forward methods and then inverse ones, which build on them; slow ones first."""
    jobs = [job for direction in DIRECTIONS for job in _jobs(domain, options, direction)]
    by_speed = sorted(jobs, key=lambda job: (job.direction, job.method) not in SLOW)
    first = [job for job in by_speed if job.direction == "forward"]
    return first, [job for job in by_speed if job.direction == "inverse"]


def _jobs(domain: DoorDomain, options: DoorOptions, direction: Direction) -> Iterator[FoldJob]:
    names: Iterable[str]
    if options.methods is None:
        left_out = ON_REQUEST | NOT_QUICK if options.quick else ON_REQUEST
        names = [name for name in domain.methods[direction] if (direction, name) not in left_out]
    else:
        names = options.methods.get(direction, ())
    for name in names:
        for split, of_split in domain.splits.items():
            jobs = [FoldJob(direction, name, split, fold) for fold in range(len(of_split))]
            if _is_trained_on(split, (direction, name) in SLOW, options) or all(map(domain.load, jobs)):
                yield from jobs


def _is_trained_on(split: str, slow: bool, options: DoorOptions) -> bool:
    """Return whether a method is trained on this split in the evaluation.

    On the split without a test, only slow methods with saved jobs are: the training of the model for use then loads it.
    """
    if split == WHOLE:
        return slow and not options.quick and options.work is not None
    return split == options.split or not slow


def evaluate_methods(domain: DoorDomain, options: DoorOptions, report: Report = silent) -> DoorResults:
    """Train and test every method on every fold. Raises JobError, with the job's name, for what a method raises.

    A job that was finished in an earlier, equal evaluation is loaded from `options.work`.
    """
    start = domain.clock()
    results = evaluate(domain, waves(domain, options), options, report)
    rank = {(way, name): i for way in DIRECTIONS for i, name in enumerate(domain.methods[way])}
    by_method: dict[tuple[Direction, str, str], list[Result[FoldJob]]] = {}
    for job in sorted(
        results.by_job, key=lambda job: (job.direction, rank[job.direction, job.method], job.split, job.fold)
    ):
        by_method.setdefault((job.direction, job.method, job.split), []).append(results[job])
    joined = {which: _join_folds(domain, of_folds) for which, of_folds in by_method.items()}
    return DoorResults(domain, options, results, joined, domain.clock() - start)


def _join_folds(domain: DoorDomain, of_folds: Iterable[Result[FoldJob]]) -> MethodResults:
    """Join the folds of one method on one split, rows in the data's order."""
    results = tuple(of_folds)
    job = results[0].job
    tested = _tested_rows(results)
    order = np.argsort(tested, kind="stable")
    data = domain.data_of(job.split).rows(tested[order])
    predicted = np.concatenate([result.predicted for result in results])[order]
    fold = np.concatenate([np.full(len(result.arrays["test"]), result.job.fold, dtype=np.int64) for result in results])
    scaling = domain.scaling
    if job.direction == "forward":
        actual = scaling.rating_up(data.rating)
    else:
        actual, predicted = scaling.force_up(data.force_N), scaling.force_up(predicted)
    sd = data.sd * TOP / (scaling.rating[1] - scaling.rating[0])
    return MethodResults(job.direction, job.method, job.split, data, fold[order], actual, predicted, sd, results)


def _tested_rows(results: Iterable[Result[FoldJob]]) -> Indices:
    return np.concatenate([result.arrays["test"] for result in results])
