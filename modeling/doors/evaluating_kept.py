"""Finished jobs on disk, so that an interrupted evaluation goes on: numbers as JSON, arrays as npz, never a pickle."""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from modeling.doors.evaluating_jobs import Context, Done, Job
from modeling.training.run_card import versions

CHECKPOINTS = "checkpoints"
ELSEWHERE = ("keyswitch", "textures")
"""Folders of models that no door is judged with."""


@cache
def code() -> str:
    """SHA-256 over the sources that a job's result depends on: a changed method is trained anew."""
    root = Path(__file__).resolve().parent.parent
    whole = hashlib.sha256()
    for source in sorted(root.rglob("*.py")):
        if not source.name.startswith(("evaluation_", "commands", "bench")) and source.parent.name not in ELSEWHERE:
            whole.update(source.relative_to(root).as_posix().encode() + b"\0" + source.read_bytes())
    return whole.hexdigest()


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
        "code": code(),
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
    place = context.kept / key(job, context)
    try:
        told = json.loads(place.with_suffix(".json").read_text(encoding="utf-8"))
        with place.with_suffix(".npz").open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        numbers = {name: math.nan if value is None else float(value) for name, value in told["numbers"].items()}
        return Done(job, arrays, numbers, tuple(told["notes"])) if {"test", "predicted"} <= set(arrays) else None
    except (OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile):
        return None


def keep(done: Done, context: Context) -> None:
    """Put a result down; the JSON last, so that what is there is whole."""
    if context.kept is None:
        return
    context.kept.mkdir(parents=True, exist_ok=True)
    place = context.kept / key(done.job, context)
    fresh = place.with_suffix(f".{os.getpid()}.new")
    with fresh.open("wb") as file:
        np.savez_compressed(file, **dict(done.arrays))  # type: ignore[arg-type]
    fresh.replace(place.with_suffix(".npz"))
    fresh.write_text(_text(done), encoding="utf-8")
    fresh.replace(place.with_suffix(".json"))


def forget_checkpoints(job: Job, context: Context) -> None:
    """Remove a job's checkpoints."""
    if (folder := checkpoint(job, context)) is not None:
        shutil.rmtree(folder, ignore_errors=True)


def _text(done: Done) -> str:
    job = done.job
    told: Mapping[str, Any] = {
        "job": [job.direction, job.method, job.split, job.fold],
        "numbers": {name: value if math.isfinite(value) else None for name, value in done.numbers.items()},
        "notes": list(done.notes),
    }
    return json.dumps(told, sort_keys=True, allow_nan=False) + "\n"
