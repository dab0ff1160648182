"""Finished jobs, so that an interrupted evaluation goes on: what decides a result, and where it lies."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.doors.evaluating_jobs import Context, Done, Job
from palpate.modeling.files.finished import put_down, taken_up
from palpate.modeling.training.run_card import versions
from palpate.protocols.code_digest import code_digest, module_of
from palpate.protocols.undefined import finite_or_none

CHECKPOINTS = "checkpoints"


def code() -> str:
    """SHA-256 over all that a job's result depends on, every method included."""
    return code_digest("palpate.modeling.doors.evaluating_run", registries=True)


def key(job: Job, context: Context) -> str:
    """The digest of everything that decides a job's result: data, fold, method, settings, seed, versions, code."""
    fold = context.splits[job.split][job.fold]
    told = {
        "job": [job.direction, job.method, job.split, job.split == context.full],
        "data": context.data.digest,
        "sd": _array_digest(context.data.sd),
        "train": np.asarray(fold.train).tolist(),
        "test": np.asarray(fold.test).tolist(),
        "seed": context.seed,
        "judge": context.judge,
        "settings": {name: str(value) for name, value in sorted(context.settings.items())},
        "versions": versions(),
        "code": [code(), code_digest(module_of(context.methods[job.direction][job.method].fit))],
    }
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:32]


def _array_digest(array: np.ndarray[Any, Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(array, dtype="<f8").tobytes()).hexdigest()


def checkpoint(job: Job, context: Context) -> Path | None:
    """Where a network of this job puts its checkpoints, None where nothing is kept.

    Nor has a quick training of an inverse method any: nothing builds on it, and it is over sooner than it is written.
    """
    if context.kept is None or (job.direction == "inverse" and context.settings.get("quick")):
        return None
    return context.kept / CHECKPOINTS / key(job, context)


def load(job: Job, context: Context) -> Done | None:
    """The kept result of an equal job; None where there is none, or where its files are damaged."""
    if context.kept is None:
        return None
    return taken_up(context.kept / key(job, context), partial(_done, job))


def _done(job: Job, told: Mapping[str, Any], arrays: dict[str, NDArray[Any]]) -> Done:
    """Raises KeyError for a result without what was tested and predicted."""
    if not {"test", "predicted"} <= set(arrays):
        raise KeyError("test or predicted")
    numbers = {name: math.nan if value is None else float(value) for name, value in told["numbers"].items()}
    return Done(job, arrays, numbers, tuple(told["notes"]))


def keep(done: Done, context: Context) -> None:
    """Put a result down."""
    if context.kept is None:
        return
    job = done.job
    told = {
        "job": [job.direction, job.method, job.split, job.fold],
        "numbers": {name: finite_or_none(value) for name, value in done.numbers.items()},
        "notes": list(done.notes),
    }
    put_down(context.kept / key(job, context), done.arrays, told)


def forget_checkpoints(job: Job, context: Context) -> None:
    """Remove a job's checkpoints."""
    if (folder := checkpoint(job, context)) is not None:
        shutil.rmtree(folder, ignore_errors=True)
