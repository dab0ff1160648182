"""Finished jobs, so that an interrupted evaluation goes on: what decides a result, and where it lies."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache, partial
from typing import Any

from numpy.typing import NDArray

from palpate.modeling.attributes.judging_jobs import Context, Done, Job
from palpate.modeling.files.finished import put_down, taken_up
from palpate.modeling.training.run_card import versions
from palpate.protocols.code_digest import code_digest, module_of


def key(job: Job, context: Context) -> str:
    """The digest of everything that decides a job's result: textures, features, method, settings, seed, versions."""
    entry, fold, method = job.entry, context.folds[job.test], context.methods[job.entry.method]
    kinds = [f"touch/{kind}" for kind in entry.touch]
    kinds += [f"{where}/{kind}" for kind in entry.sight for where in ("sight", "variants")]
    seen = {name: [context.parts[name], *(context.parts.get(f"{name}/{kind}", "") for kind in kinds)]
            for name in (*fold.train, *fold.held, fold.test)}  # fmt: skip
    told = {
        "job": [entry.method, entry.touch, entry.sight, method.name, method.holds(context.settings)],
        "fold": [fold.test, fold.train, fold.held],
        "seen": seen,
        "attributes": [[pair.low, pair.high] for pair in context.attributes],
        "seed": context.seed,
        "settings": {name: str(value) for name, value in sorted(context.settings.items())},
        "versions": _versions(),
        "code": code_digest(module_of(method.fit), "palpate.modeling.attributes.judging_run"),
    }
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:32]


@cache
def _versions() -> dict[str, str | None]:
    """Read once in a process: they are a hundred times slower to find than all the rest of a key."""
    return versions()


def load(job: Job, context: Context) -> Done | None:
    """The kept result of an equal job; None where there is none, or where its files are damaged."""
    if context.work is None:
        return None
    return taken_up(context.work / key(job, context), partial(_done, job, len(context.attributes)))


def _done(job: Job, attributes: int, told: Mapping[str, Any], arrays: dict[str, NDArray[Any]]) -> Done:
    if arrays["predicted"].shape != (attributes,) or arrays["spread"].shape != (attributes,):
        raise ValueError("another result")
    return Done(job, {str(name): float(value) for name, value in told["numbers"].items()}, arrays)


def keep(done: Done, context: Context) -> None:
    """Put a result down. What was refused is not kept."""
    if context.work is not None and not done.refused:
        put_down(
            context.work / key(done.job, context), done.arrays, {"job": done.job.name, "numbers": dict(done.numbers)}
        )
