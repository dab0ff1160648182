"""A training at the end of an epoch as tensors and plain values, and back again to the bit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim import Optimizer

from palpate.modeling.training.checkpoints import Kept
from palpate.modeling.training.history import Epoch
from palpate.modeling.training.refusals import CheckpointError
from palpate.modeling.training.schedule import course_of
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.weights import Weights, copied, restore
from palpate.protocols.canonical import difference

_NOW, _BEST, _OPTIMISER, _DROPOUT = "now.", "best.", "optimiser.", "dropout"


@dataclass
class State:
    """What changes while a network is trained."""

    network: nn.Module
    optimiser: Optimizer
    best: Weights
    history: list[Epoch]


def kept(state: State, identity: Mapping[str, Any]) -> Kept:
    """Everything that the next epoch depends on."""
    tensors = {_NOW + name: tensor for name, tensor in copied(state.network).items()}
    tensors |= {_BEST + name: tensor for name, tensor in state.best.items()}
    tensors |= {_OPTIMISER + name: tensor for name, tensor in _optimiser_tensors(state.optimiser).items()}
    tensors[_DROPOUT] = torch.get_rng_state()
    plain = {"identity": dict(identity), "history": [epoch.plain() for epoch in state.history]}
    return Kept(len(state.history), tensors, plain)


def put_back(state: State, found: Kept) -> None:
    """Make the state what it was when it was kept. Raises CheckpointError where the tensors are not this training's."""
    try:
        restore(state.network, _under(_NOW, found.tensors))
        _restore_optimiser(state.optimiser, _under(_OPTIMISER, found.tensors))
        torch.set_rng_state(found.tensors[_DROPOUT])
        state.best = _under(_BEST, found.tensors)
        state.history[:] = [Epoch(**epoch) for epoch in found.plain["history"]]
    except (KeyError, TypeError, RuntimeError, ValueError) as error:
        raise CheckpointError(f"the checkpoint of epoch {found.epoch} is not of this training: {error}") from error


def refuse_other(found: Kept, identity: Mapping[str, Any], where: str) -> None:
    """Raise CheckpointError where the checkpoint is of other data, settings, another network or loss."""
    theirs = found.plain["identity"]
    for name, ours in identity.items():
        if told := difference(theirs.get(name), ours, name):
            raise CheckpointError(f"{where} holds another training ({told}). Name another folder, or remove that one.")


def refuse_longer(found: Kept, settings: Settings, where: str) -> None:
    """Raise CheckpointError where that training went on after these settings would have ended it: it has other weights.

    Fewer epochs than it has, or a patience that ran out before its last one.
    """
    course = course_of((), settings)
    for epoch in found.plain["history"]:
        if course.ended(settings):
            ends = f"holds {found.epoch} epochs, and this training ends after {course.epochs}"
            raise CheckpointError(f"{where} {ends}. Name another folder, or remove that one.")
        course = course.after(Epoch(**epoch).watched, settings)


def _under(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}


def _optimiser_tensors(optimiser: Optimizer) -> dict[str, Tensor]:
    """The optimiser's memory, by parameter and name. Raises CheckpointError for one that is not made of tensors."""
    found: dict[str, Tensor] = {}
    for parameter, memory in optimiser.state_dict()["state"].items():
        for name, value in memory.items():
            if isinstance(value, Tensor):
                found[f"{parameter}.{name}"] = value.detach().clone().contiguous()
            elif value is not None:
                raise CheckpointError(f"{type(optimiser).__name__} keeps {name} as {type(value).__name__}: no tensor.")
    return found


def _restore_optimiser(optimiser: Optimizer, tensors: Mapping[str, Tensor]) -> None:
    memory: dict[int, dict[str, Tensor]] = {}
    for name, tensor in tensors.items():
        parameter, key = name.split(".", 1)
        memory.setdefault(int(parameter), {})[key] = tensor
    optimiser.load_state_dict({**optimiser.state_dict(), "state": memory})
