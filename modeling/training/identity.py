"""What makes two trainings the same one: a checkpoint is continued only by the training that wrote it."""

from __future__ import annotations

from typing import Any

import torch
from torch import nn
from torch.optim import Optimizer

from palpate.modeling.training.seeding import batch_chance
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import Source, answer_of, digest_of
from palpate.modeling.training.stepping import Loss
from palpate.protocols.canonical import digest


def identity_of(
    network: nn.Module, data: Source, held: Source | None, loss: Loss, optimiser: Optimizer, settings: Settings
) -> dict[str, Any]:
    """Digests of everything that the result depends on, and the first rows' loss, which tells one loss from another."""
    return {
        "data": data.digest,
        "rows": len(data),
        "held-out data": None if held is None else held.digest,
        "network": digest({name: list(tensor.shape) for name, tensor in network.state_dict().items()}),
        "starting weights": digest_of(iter(network.state_dict().values())),
        "optimiser": digest(_options(optimiser)),
        "settings": settings.of_the_result,
        "torch": str(torch.__version__),
        "loss of the first rows": _first_loss(network, data, loss, settings),
    }


def _options(optimiser: Optimizer) -> list[Any]:
    options = (
        {name: repr(value) for name, value in group.items() if name != "params"} for group in optimiser.param_groups
    )
    return [type(optimiser).__name__, *options]


def _first_loss(network: nn.Module, data: Source, loss: Loss, settings: Settings) -> str:
    """As text, since it may be no number: the training itself refuses that, by name.

    A network that draws also in evaluation mode draws here too; the training's own chance does not notice.
    """
    network.eval()
    rows = torch.arange(min(settings.batch, len(data)))
    with torch.no_grad(), torch.random.fork_rng(devices=[]):
        inputs, targets = data.batch(rows, batch_chance(settings.seed, 0))
        return repr(loss(answer_of(network, inputs), targets).tolist())
