"""Finished jobs, so that an interrupted evaluation goes on: what decides a result, and where it lies."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.files.finished import put_down, taken_up
from palpate.modeling.textures.judging_jobs import Context, Done, Explore, Fit, Job
from palpate.modeling.textures.recording import Recording
from palpate.modeling.textures.simulator import simulation_digest
from palpate.modeling.training.run_card import versions
from palpate.protocols.code_digest import code_digest, module_of
from palpate.protocols.files import file_sha256

CHECKPOINTS, MODELS = "checkpoints", "models"
PLAYER = "palpate.signals.textures.voice"
"""What a model runs free in, and makes the start of a touch with."""


def key(job: Job, context: Context) -> str:
    """The digest of everything that decides a job's result: data, method, settings, seed, versions, sources."""
    told = {"seed": context.seed, "versions": versions(), **_decides(job, context)}
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:32]


def _decides(job: Job, context: Context) -> dict[str, Any]:
    if isinstance(job, Explore):
        simulator = context.simulator
        kind = type(simulator)
        return {
            "explore": [job.texture, context.seconds, f"{kind.__module__}.{kind.__qualname__}"],
            "code": [
                code_digest("palpate.modeling.textures.judging_drive"),
                simulation_digest(simulator.scene, simulator.again),
            ],
        }
    if isinstance(job, Fit):
        method = context.methods[job.method]
        return {
            "fit": [job.texture, job.method, job.window, job.loss, method.name],
            "data": recording_digest(context.recordings[job.texture]),
            "parts": repr(context.parts[job.texture]),
            "settings": {name: str(value) for name, value in sorted(context.settings.items())},
            "code": code_digest(module_of(method.fit), "palpate.modeling.textures.judging_fit"),
            "player": code_digest(PLAYER, registries=True),
        }
    return {
        "play": [key(job.fit, context), job.sampled, context.seconds, context.explore],
        "drive": key(Explore(job.fit.texture), context) if context.explore else "",
        "code": [code_digest("palpate.modeling.textures.judging"), code_digest(PLAYER, registries=True)],
    }


def recording_digest(recording: Recording) -> str:
    """SHA-256 of a recording's name and samples."""
    found = hashlib.sha256(f"{recording.texture} {recording.signals.shape}".encode())
    found.update(np.ascontiguousarray(recording.signals, dtype="<f8").tobytes())
    return found.hexdigest()


def checkpoint(job: Fit, context: Context) -> Path:
    """Where a network of this job puts its checkpoints."""
    return context.work / CHECKPOINTS / key(job, context)


def model_folder(job: Fit, context: Context) -> Path:
    """Where this job's model lies."""
    return context.work / MODELS / key(job, context)


def forget_checkpoints(job: Fit, context: Context) -> None:
    """Remove a job's checkpoints."""
    shutil.rmtree(checkpoint(job, context), ignore_errors=True)


def load(job: Job, context: Context) -> Done | None:
    """The kept result of an equal job; None where there is none, or where its files are damaged."""
    return taken_up(context.work / key(job, context), partial(_done, job, context.work))


def _done(job: Job, work: Path, told: Mapping[str, Any], arrays: dict[str, NDArray[Any]]) -> Done:
    numbers = {str(name): None if value is None else float(value) for name, value in told["numbers"].items()}
    return Done(job, numbers, arrays, _whole_card(work, told["card"], told["sha256"]))


def keep(done: Done, context: Context) -> None:
    """Put a result down. What was refused is not kept."""
    if done.refused:
        return
    card = None if done.card is None else done.card.relative_to(context.work).as_posix()
    told = {"job": done.job.name, "numbers": dict(done.numbers), "card": card, "sha256": _sha256s(done.card)}
    put_down(context.work / key(done.job, context), done.arrays, told)


def _whole_card(work: Path, card: str | None, sha256: list[str]) -> Path | None:
    """The kept model. Raises ValueError where its files are not as they were written."""
    if card is None:
        return None
    path = work / card
    if _sha256s(path) != sha256:
        raise ValueError("another model")
    return path


def _sha256s(card: Path | None) -> list[str]:
    files = [] if card is None else [card, card.with_suffix(".safetensors")]
    return [file_sha256(path) for path in files]
