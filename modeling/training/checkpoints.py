"""Trainings on disk: tensors in a safetensors file, the rest in a JSON file that names the tensors' SHA-256.

The JSON file is written last and renamed into place, so a checkpoint is complete or absent; the previous one stays
until the next. Neither file can execute code. Only the training that wrote a checkpoint can continue from it
(`identity_of`), with bit-identical results.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor, nn
from torch.optim import Optimizer

from palpate.modeling.training.history import Epoch
from palpate.modeling.training.refusals import CheckpointError
from palpate.modeling.training.seeding import batch_chance
from palpate.modeling.training.settings import Settings, course_of
from palpate.modeling.training.sources import Source, answer_of, digest_of
from palpate.modeling.training.steps import Loss, Weights, copied, restore
from palpate.protocols.canonical import canonical, difference, digest, parse
from palpate.protocols.files import UNFINISHED, write_bytes
from palpate.protocols.progress import Report

FORMAT = "palpate checkpoint 1"
KEEP = 2
_NOW, _BEST, _OPTIMISER, _DROPOUT = "now.", "best.", "optimiser.", "dropout"


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint: the epoch that it ends, its tensors, and its plain values."""

    epoch: int
    tensors: Mapping[str, Tensor]
    plain: Mapping[str, Any]


def write_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write the checkpoint, keep the one before it, and remove all others."""
    name = f"epoch-{checkpoint.epoch:06d}"
    tensors = save(dict(checkpoint.tensors))
    write_bytes(folder / f"{name}.safetensors", tensors)
    plain = {
        **checkpoint.plain,
        "format": FORMAT,
        "epoch": checkpoint.epoch,
        "tensors": hashlib.sha256(tensors).hexdigest(),
    }
    write_bytes(folder / f"{name}.json", canonical({**plain, "digest": digest(plain)}))
    # A checkpoint of a later epoch is damaged, or the training would have continued from it.
    # The JSON file is removed before its tensors.
    retained = {path.stem for path in [path for path in _newest_first(folder) if path.stem <= name][:KEEP]}
    for path in sorted(folder.glob("epoch-*.*")):
        if path.stem not in retained:
            path.unlink(missing_ok=True)
    for path in folder.glob(f"{UNFINISHED}*"):
        path.unlink(missing_ok=True)


def read_latest(folder: Path, report: Report) -> Checkpoint | None:
    """Return the newest complete checkpoint, or None; report a damaged one and try the one before it."""
    for path in _newest_first(folder):
        try:
            return read_checkpoint(path)
        except CheckpointError as error:
            report(f"{error} The one before it is used, or the training starts again.")
    return None


def read_checkpoint(path: Path) -> Checkpoint:
    """Return the checkpoint of a JSON file. Raises CheckpointError where it or its tensors were changed."""
    try:
        plain = parse(path.read_bytes())
        if plain["format"] != FORMAT or plain.pop("digest") != digest(plain):
            raise ValueError("its text was changed, or it is of another format")
        data = path.with_suffix(".safetensors").read_bytes()
        if hashlib.sha256(data).hexdigest() != plain["tensors"]:
            raise ValueError("its tensors are not those that were written")
        return Checkpoint(plain["epoch"], load(data), plain)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, SafetensorError) as error:
        raise CheckpointError(f"checkpoint {path} is damaged: {error}.") from error


def _newest_first(folder: Path) -> Iterator[Path]:
    return iter(sorted(folder.glob("epoch-*.json"), reverse=True))


@dataclass
class State:
    """The state of a training: what changes from epoch to epoch."""

    network: nn.Module
    optimiser: Optimizer
    best: Weights
    history: list[Epoch]


def checkpoint_of(state: State, identity: Mapping[str, Any]) -> Checkpoint:
    """Return the checkpoint of a state: all that the next epoch depends on."""
    tensors = {_NOW + name: tensor for name, tensor in copied(state.network).items()}
    tensors |= {_BEST + name: tensor for name, tensor in state.best.items()}
    momenta: dict[str, Tensor] = {}  # by "PARAMETER.NAME"
    for parameter, parameter_state in state.optimiser.state_dict()["state"].items():
        for name, value in parameter_state.items():
            if isinstance(value, Tensor):
                momenta[f"{parameter}.{name}"] = value.detach().clone().contiguous()
            elif value is not None:
                raise CheckpointError(
                    f"{type(state.optimiser).__name__} keeps {name} as {type(value).__name__}: no tensor."
                )
    tensors |= {_OPTIMISER + name: tensor for name, tensor in momenta.items()}
    tensors[_DROPOUT] = torch.get_rng_state()
    plain = {"identity": dict(identity), "history": [epoch.plain() for epoch in state.history]}
    return Checkpoint(len(state.history), tensors, plain)


def put_back(state: State, checkpoint: Checkpoint) -> None:
    """Restore the state of the checkpoint. Raises CheckpointError where the tensors are not this training's."""
    try:
        restore(state.network, _under(_NOW, checkpoint.tensors))
        momenta: dict[int, dict[str, Tensor]] = {}
        for name, tensor in _under(_OPTIMISER, checkpoint.tensors).items():
            parameter, key = name.split(".", 1)
            momenta.setdefault(int(parameter), {})[key] = tensor
        state.optimiser.load_state_dict({**state.optimiser.state_dict(), "state": momenta})
        torch.set_rng_state(checkpoint.tensors[_DROPOUT])
        state.best = _under(_BEST, checkpoint.tensors)
        state.history[:] = [Epoch(**epoch) for epoch in checkpoint.plain["history"]]
    except (KeyError, TypeError, RuntimeError, ValueError) as error:
        raise CheckpointError(f"the checkpoint of epoch {checkpoint.epoch} is not of this training: {error}") from error


def refuse_other(checkpoint: Checkpoint, identity: Mapping[str, Any], where: str) -> None:
    """Raise CheckpointError where the checkpoint was written with other data, settings, network or loss."""
    theirs = checkpoint.plain["identity"]
    for name, ours in identity.items():
        if other := difference(theirs.get(name), ours, name):
            raise CheckpointError(f"{where} holds another training ({other}). Name another folder, or remove that one.")


def refuse_longer(checkpoint: Checkpoint, settings: Settings, where: str) -> None:
    """Raise CheckpointError where the saved training has more epochs than these settings allow.

    Its epochs exceed `settings.epochs`, or the patience ran out before its last one.
    """
    course = course_of((), settings)
    for epoch in checkpoint.plain["history"]:
        if course.ended(settings):
            ends = f"holds {checkpoint.epoch} epochs, and this training ends after {course.epochs}"
            raise CheckpointError(f"{where} {ends}. Name another folder, or remove that one.")
        course = course.after(Epoch(**epoch).watched, settings)


def _under(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}


def identity_of(
    network: nn.Module, data: Source, held: Source | None, loss: Loss, optimiser: Optimizer, settings: Settings
) -> dict[str, Any]:
    """Return digests of all that the result depends on; the loss function is identified by its value on first rows."""
    groups = [
        {name: repr(value) for name, value in group.items() if name != "params"} for group in optimiser.param_groups
    ]
    return {
        "data": data.digest,
        "rows": len(data),
        "held-out data": None if held is None else held.digest,
        "network": digest({name: list(tensor.shape) for name, tensor in network.state_dict().items()}),
        "starting weights": digest_of(iter(network.state_dict().values())),
        "optimiser": digest([type(optimiser).__name__, *groups]),
        "settings": settings.of_the_result,
        "torch": str(torch.__version__),
        "loss of the first rows": _first_loss(network, data, loss, settings),
    }


def _first_loss(network: nn.Module, data: Source, loss: Loss, settings: Settings) -> str:
    """Return the loss of the first batch as text, since it may not be one number, which the training itself refuses.

    The random state is restored, because a network may draw in evaluation mode.
    """
    network.eval()
    rows = torch.arange(min(settings.batch, len(data)))
    with torch.no_grad(), torch.random.fork_rng(devices=[]):
        inputs, targets = data.batch(rows, batch_chance(settings.seed, 0))
        return repr(loss(answer_of(network, inputs), targets).tolist())
