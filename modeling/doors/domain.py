"""The jobs of an evaluation of doors: a method of one direction, trained and tested on one fold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.doors.data import DoorData, Scaling
from palpate.modeling.doors.folding import Fold, held_share
from palpate.modeling.doors.methods import Fitted, Learning, Method
from palpate.modeling.doors.model_scores import model_scores
from palpate.modeling.doors.profile_scores import corner_scores, profile_scores
from palpate.modeling.doors.registry import FORWARD, INVERSE, Direction
from palpate.modeling.doors.training_variants import with_variants
from palpate.modeling.evaluate.engine import Domain, Result
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.files.result_store import array_digest
from palpate.modeling.training.history import curve_of
from palpate.protocols.code_digest import code_digest, module_of

HELD = 0.15
"""The share of the training side that is held out to stop a network early."""
LEAKY = "leaky"
WHOLE = "all stimuli"
"""The split of one fold that leaves nothing out: it trains the models that are written for use."""
ALL: Mapping[Direction, Mapping[str, Method]] = {"forward": FORWARD, "inverse": INVERSE}
Arrays = dict[str, NDArray[Any]]
Numbers = dict[str, float | None]


@dataclass(frozen=True)
class FoldJob:
    """A job: a method of a direction, trained and tested on one fold of a split."""

    direction: Direction
    method: str
    split: str
    fold: int

    @property
    def name(self) -> str:
        """The name of the job in progress and errors."""
        return f"{self.direction} {self.method}, {self.split} fold {self.fold + 1}"


@dataclass(frozen=True, kw_only=True)
class DoorDomain(Domain[FoldJob]):
    """The stimuli, the folds of each split and the methods.

    The folds of the leaky split are over the data with its training variants. `judge` is the forward method that rates
    made profiles. `full` is the split that counts: only there are made profiles and files scored. `files` is a folder
    that keeps the exported models as DIRECTION-METHOD.json.
    """

    refusals_raise = True
    data: DoorData
    splits: Mapping[str, tuple[Fold, ...]]
    scaling: Scaling
    judge: str
    full: str = "grouped"
    files: Path | None = None
    methods: Mapping[Direction, Mapping[str, Method]] = field(default_factory=lambda: ALL)

    def method(self, job: FoldJob) -> Method:
        """Return a job's method."""
        return self.methods[job.direction][job.method]

    def fold(self, job: FoldJob) -> Fold:
        """Return a job's fold."""
        return self.splits[job.split][job.fold]

    def data_of(self, split: str) -> DoorData:
        """Return the rows that a split's folds index: the stimuli; in the leaky split also their training variants."""
        return with_variants(self.data, self.seed) if split == LEAKY else self.data

    def compute(self, job: FoldJob) -> Result[FoldJob]:
        """Train the job's method and return the tested rows ("test") with their predictions ("predicted").

        Forward predictions are (n, attributes) on 0..100, inverse ones (n, 621) newtons. On the split that counts,
        inverse methods add `profile_scores`, and `corner_scores` in the first fold. The result also holds the learning
        curve, the seconds of the training (train_s, forward_s) and of the prediction (asked_s), and in the first fold
        the numbers of the exported file.
        """
        model, seconds = train_job(job, self)
        test = self.data_of(job.split).rows(self.fold(job).test)
        given = test.force_N if job.direction == "forward" else self.scaling.rating_up(test.rating)
        start = self.clock()
        predicted = model.predict(given)
        numbers: Numbers = {**seconds, "asked_s": self.clock() - start}
        arrays: Arrays = {"test": np.asarray(self.fold(job).test), "predicted": predicted, **curve_of(model)}
        if hasattr(model, "deviation"):
            arrays["deviation"] = model.deviation(given)
        if job.direction == "inverse" and job.split == self.full:
            judge, _ = train_job(FoldJob("forward", self.judge, job.split, job.fold), self)
            known_N = self.data_of(job.split).force_N[self.fold(job).train]
            arrays |= profile_scores(self.scaling, test, predicted, known_N, judge)
            if job.fold == 0:
                further, counted = corner_scores(self.scaling, test, model, known_N, judge)
                arrays |= further
                numbers |= counted
        notes: tuple[str, ...] = ()
        if job.fold == 0 and job.split == self.full:
            try:
                numbers |= model_scores(
                    model, job.direction, job.method, job.name, given, self.data, self.scaling, self.clock, self.files
                )
            except ModelDataError as refusal:
                notes = (str(refusal),)
        return Result(job, numbers, arrays, notes)

    def decides(self, job: FoldJob) -> dict[str, Any]:
        """Return everything that a result depends on: data, fold, method, settings, and the code of every method."""
        return {
            "job": [job.direction, job.method, job.split, job.split == self.full],
            "data": [self.data.digest, array_digest(self.data.sd)],
            "train": self.fold(job).train.tolist(),
            "test": self.fold(job).test.tolist(),
            "seed": self.seed,
            "judge": self.judge,
            "settings": self.plain_settings(),
            "code": [door_code(), code_digest(module_of(self.method(job).fit))],
        }

    def checkpoint(self, job: FoldJob) -> Path | None:
        """Return the folder of a job's checkpoints; None where none are saved.

        A quick training of an inverse method has none: nothing builds on it, and it takes less time than writing one.
        """
        return None if job.direction == "inverse" and self.settings.get("quick") else super().checkpoint(job)

    def spent(self, job: FoldJob, all_done: bool) -> Sequence[FoldJob]:
        """Return the jobs whose checkpoints are not needed any more: inverse methods build on forward networks'."""
        if job.split == WHOLE:
            return ()
        if all_done:
            return with_prerequisite(job, self)
        return (job,) if job.direction == "inverse" else ()


def door_code() -> str:
    """Return the SHA-256 over all code that a result depends on, every method included."""
    return code_digest(__name__, registries=True)


def learning_for(job: FoldJob, domain: DoorDomain) -> Learning:
    """Return the inputs of the job's fit: the training side of its fold, with training variants."""
    method, rows = domain.method(job), domain.data_of(job.split).rows(domain.fold(job).train)
    every = np.arange(len(rows), dtype=np.int64)
    rest, held = held_share(rows, HELD, domain.seed) if method.holds_out else (every, every[:0])
    train = rows.rows(rest)
    known = set(domain.data.ids)
    measured = train.rows(np.array([i for i, name in enumerate(train.ids) if name in known], dtype=np.int64))
    checkpoint = domain.checkpoint(job)
    return Learning(
        train=train if job.split == LEAKY else with_variants(train, domain.seed),  # the leaky split has them already
        measured=measured,
        held=rows.rows(held),
        scaling=domain.scaling,
        seed=domain.seed,
        settings={**domain.settings, **({} if checkpoint is None else {"checkpoint": checkpoint})},
    )


def with_prerequisite(job: FoldJob, domain: DoorDomain) -> tuple[FoldJob, ...]:
    """Return the job, and after it the job of the forward method that it builds on, if any."""
    below = domain.method(job).needs_forward
    return (job,) if below is None else (job, FoldJob("forward", below, job.split, job.fold))


def train_job(
    job: FoldJob, domain: DoorDomain, known: Mapping[FoldJob, tuple[Fitted, dict[str, float]]] = MappingProxyType({})
) -> tuple[Fitted, dict[str, float]]:
    """Fit the job's method; return the model and the seconds of its training and of its forward model's.

    A forward network is loaded from the checkpoint of its own job, so it is trained once. `known` holds earlier results
    of this function, which are used again.
    """
    given = learning_for(job, domain)
    below_s = 0.0
    for lower in with_prerequisite(job, domain)[1:]:
        below, seconds = known[lower] if lower in known else train_job(lower, domain)
        given, below_s = replace(given, forward=below), seconds["train_s"]
    start = domain.clock()
    model = domain.method(job).fit(given)
    took = domain.clock() - start
    return model, {"train_s": getattr(getattr(model, "trained", None), "seconds", took), "forward_s": below_s}
