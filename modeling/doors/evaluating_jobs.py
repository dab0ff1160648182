"""One job of an evaluation: one method, trained on one fold's training side and asked about its test side."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.folding import Fold, held_share
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.registry import FORWARD, INVERSE, Direction
from palpate.modeling.doors.scaling import Scaling
from palpate.modeling.doors.training_variants import with_variants
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array

HELD = 0.15
"""The share of the training side that a network watches to stop early."""
LEAKY = "leaky"
WHOLE = "all stimuli"
"""The split of one fold that leaves nothing out: what is trained to be used."""
ALL: Mapping[Direction, Mapping[str, Method]] = {"forward": FORWARD, "inverse": INVERSE}


@dataclass(frozen=True)
class Job:
    """What is trained once: a method of a direction, on one fold of a split."""

    direction: Direction
    method: str
    split: str
    fold: int

    @property
    def name(self) -> str:
        """As progress and errors name it."""
        return f"{self.direction} {self.method}, {self.split} fold {self.fold + 1}"


@dataclass(frozen=True)
class Context:
    """What all jobs of an evaluation share.

    `splits` holds each split's folds; those of the leaky one are over the data with its training variants. `judge` is
    the forward method that judges made profiles; `full` the split that counts: made
    profiles and files are looked at there alone. `settings` go to the methods as they are. `kept` is the folder of
    finished jobs, None where nothing is kept; `files` one where the exported models stay, DIRECTION-METHOD.json.
    """

    data: DoorData
    splits: Mapping[str, tuple[Fold, ...]]
    scaling: Scaling
    seed: int
    judge: str
    full: str = "grouped"
    settings: Mapping[str, Any] = field(default_factory=dict)
    kept: Path | None = None
    files: Path | None = None
    methods: Mapping[Direction, Mapping[str, Method]] = field(default_factory=lambda: ALL)
    clock: Clock = time.perf_counter


@dataclass(frozen=True)
class Done:
    """A finished job: which rows were tested (of the split's data), what was predicted, and what was measured.

    Forward: `predicted` (n, attributes) on 0..100. Inverse: (n, 621) newtons. `arrays` and `numbers` hold the rest.
    """

    job: Job
    arrays: Mapping[str, NDArray[Any]]
    numbers: Mapping[str, float]
    notes: tuple[str, ...] = ()

    @property
    def test(self) -> NDArray[np.int64]:
        """The tested rows."""
        return self.arrays["test"]

    @property
    def predicted(self) -> Array:
        """What was answered for them."""
        return self.arrays["predicted"]


def data_of(context: Context, split: str) -> DoorData:
    """The rows that a split's folds count: the stimuli, or for the leaky split these with their training variants."""
    return with_variants(context.data, context.seed) if split == LEAKY else context.data


def learning(context: Context, job: Job, method: Method, checkpoint: Path | None = None) -> Learning:
    """What the method may learn from in this fold."""
    over = data_of(context, job.split)
    own = over.rows(context.splits[job.split][job.fold].train)
    return learning_from(context, own, method, job.split == LEAKY, checkpoint)


def learning_from(
    context: Context, own: DoorData, method: Method, varied: bool = False, checkpoint: Path | None = None
) -> Learning:
    """What the method may learn from these rows; `varied` says that they hold the training variants already."""
    every = np.arange(len(own), dtype=np.int64)
    rest, held = held_share(own, HELD, context.seed) if method.holds_out else (every, every[:0])
    train = own.rows(rest)
    known = set(context.data.ids)
    measured = train.rows(np.array([i for i, name in enumerate(train.ids) if name in known], dtype=np.int64))
    settings = {**context.settings, **({"checkpoint": checkpoint} if checkpoint is not None else {})}
    return Learning(
        train=train if varied else with_variants(train, context.seed),
        measured=measured,
        held=own.rows(held),
        scaling=context.scaling,
        seed=context.seed,
        settings=settings,
    )
