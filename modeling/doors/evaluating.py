"""Every method on the same folds, in parallel; what is finished is kept, so that an interrupted evaluation goes on."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.evaluating_gathered import Gathered, by_method
from palpate.modeling.doors.evaluating_jobs import ALL, LEAKY, WHOLE, Context, Done, Job
from palpate.modeling.doors.evaluating_kept import forget_checkpoints, keep, load
from palpate.modeling.doors.evaluating_run import run, with_below
from palpate.modeling.doors.folding import KINDS, Fold, Kinds, folds
from palpate.modeling.doors.methods import Method
from palpate.modeling.doors.registry import DEFAULT, ON_REQUEST, SLOW, Direction
from palpate.modeling.doors.scaling import scaling_of
from palpate.modeling.doors.training_variants import with_variants
from palpate.protocols.progress import Clock, Report

FOLDS, QUICK_FOLDS = 5, 3
QUICKLY: Mapping[str, Any] = {"quick": True}
"""Each method knows what it does then: networks a few epochs of the stimuli alone, the generator a small recipe."""
NOT_QUICK = frozenset({("inverse", "search")})
"""What a quick evaluation leaves out unless it is named: its every answer is a search."""
DIRECTIONS: tuple[Direction, ...] = ("forward", "inverse")


@dataclass(frozen=True)
class Wanted:
    """What is evaluated: methods by direction (None: all), the split that counts, and how.

    Beside `split`, the methods that take seconds are evaluated on the other splits too, so that they can be compared.
    `workers` and `cluster` as `run_jobs` takes them; `kept` and `files` as in `Context`.
    """

    methods: Mapping[Direction, tuple[str, ...]] | None = None
    split: Kinds = "grouped"
    seed: int = 0
    quick: bool = False
    settings: Mapping[str, Any] = field(default_factory=dict)
    workers: int | None = None
    cluster: str | None = None
    kept: Path | None = None
    beside: bool = True
    folds: int = FOLDS
    files: Path | None = None


@dataclass(frozen=True)
class Judged:
    """Every method's results on every split it was evaluated on, and how long all of it took this time."""

    context: Context
    wanted: Wanted
    found: Mapping[tuple[Direction, str, str], Gathered]
    seconds: float
    jobs: int
    taken: int
    """How many of the jobs were finished already."""

    def methods(self, direction: Direction, split: str | None = None) -> list[Gathered]:
        """The results of one direction on one split (the one that counts), in the methods' order."""
        split = split or self.wanted.split
        return [each for (way, _, on), each in self.found.items() if (way, on) == (direction, split)]


def folds_for(quick: bool) -> int:
    """How many folds an evaluation or a training has where nobody asks for a number."""
    return QUICK_FOLDS if quick else FOLDS


def context_for(
    data: DoorData, wanted: Wanted,
    methods: Mapping[Direction, Mapping[str, Method]] = ALL, clock: Clock = time.perf_counter,
) -> Context:  # fmt: skip
    """What all jobs share. Raises ModelDataError for data that cannot be folded, or an unknown split."""
    kinds = KINDS if wanted.beside else (wanted.split,)
    return Context(
        data=data,
        splits={kind: _folds(data, kind, wanted) for kind in kinds if _foldable(data, kind, wanted)},
        scaling=scaling_of(data),
        seed=wanted.seed,
        judge=DEFAULT["forward"],
        full=wanted.split,
        settings={"threads": 1, **(QUICKLY if wanted.quick else {}), **wanted.settings},
        kept=wanted.kept,
        files=wanted.files,
        methods=methods,
        clock=clock,
    )


def _folds(data: DoorData, kind: Kinds, wanted: Wanted) -> tuple[Fold, ...]:
    over = with_variants(data, wanted.seed) if kind == LEAKY else data
    return folds(over, wanted.folds, kind, wanted.seed)


def _foldable(data: DoorData, kind: Kinds, wanted: Wanted) -> bool:
    """One door alone cannot be left out; the split that was asked for says so itself."""
    return kind == wanted.split or kind != "leave_one_door_out" or len(set(data.doors)) > 1


def plan(context: Context, wanted: Wanted) -> tuple[list[Job], list[Job]]:
    """All jobs in two waves: what is forward, and then what builds on it; the slow ones of each wave first."""
    jobs = [job for direction in DIRECTIONS for job in _jobs(context, wanted, direction)]
    by_speed = sorted(jobs, key=lambda job: (job.direction, job.method) not in SLOW)
    first = [job for job in by_speed if job.direction == "forward"]
    return first, [job for job in by_speed if job.direction == "inverse"]


def _jobs(context: Context, wanted: Wanted, direction: Direction) -> Iterator[Job]:
    known = context.methods[direction]
    chosen = _all(known, direction, wanted.quick) if wanted.methods is None else wanted.methods.get(direction, ())
    for name in chosen:
        for split, of_split in context.splits.items():
            jobs = [Job(direction, name, split, fold) for fold in range(len(of_split))]
            if _worth(split, (direction, name) in SLOW, wanted) or _finished(jobs, context):
                yield from jobs


def _worth(split: str, slow: bool, wanted: Wanted) -> bool:
    """Whether a method is trained on this split beside the others.

    A model to be used is, only where that saves something: where it then comes from checkpoints.
    """
    if split == WHOLE:
        return slow and not wanted.quick and wanted.kept is not None
    return split == wanted.split or not slow


def _all(known: Mapping[str, Method], direction: Direction, quick: bool) -> tuple[str, ...]:
    left_out = ON_REQUEST | NOT_QUICK if quick else ON_REQUEST
    return tuple(name for name in known if (direction, name) not in left_out)


def _finished(jobs: Iterable[Job], context: Context) -> bool:
    """Whether an earlier evaluation, on that split, did all of them."""
    return all(load(job, context) is not None for job in jobs)


def judge(context: Context, wanted: Wanted, report: Report = lambda _line: None) -> Judged:
    """Train and ask every method on every fold. Raises what a method raises, with the job's name.

    A job that was finished in an earlier, equal evaluation is taken from `wanted.kept`.
    """
    from palpate.modeling.training.jobs import run_jobs

    start = context.clock()
    waves = plan(context, wanted)
    kept = {job: found for wave in waves for job in wave if (found := load(job, context)) is not None}
    done: dict[Job, Done] = dict(kept)
    bare = replace(context, clock=time.perf_counter)
    for wave in waves:
        missing = [job for job in wave if job not in done]
        if missing:
            answers = run_jobs(
                partial(run, context=bare), missing, workers=wanted.workers, cluster=wanted.cluster, report=report
            )
            done |= dict(zip(missing, answers, strict=True))
    _settle(context, [each for job, each in done.items() if job not in kept])
    ordered = [done[job] for job in _in_order(context, done)]
    return Judged(context, wanted, by_method(context, ordered), context.clock() - start, len(done), len(kept))


def _settle(context: Context, fresh: Sequence[Done]) -> None:
    """Keep also what a worker elsewhere computed, and let the forward networks' checkpoints go."""
    for each in fresh:
        if load(each.job, context) is None:
            keep(each, context)
        if each.job.split != WHOLE:
            for job in with_below(each.job, context):
                forget_checkpoints(job, context)


def _in_order(context: Context, done: Mapping[Job, Done]) -> list[Job]:
    rank = {(way, name): i for way in DIRECTIONS for i, name in enumerate(context.methods[way])}
    return sorted(done, key=lambda job: (job.direction, rank[job.direction, job.method], job.split, job.fold))
