"""What a texture's networks end in, and what their answers are judged by: a mean, or a mean and a log SD."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import torch
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.textures.foten_layers import Dropout
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.training.steps import Loss

UNITS = (256, 64)
"""Thesis 4.4.5: the two dense layers before the last one."""
LEAST_LOG_SD = math.log(0.003)
"""The log of the least SD that a generative head can give, in SDs of the acceleration."""


class Spread(nn.Module):
    """(batch, 2) to mean and log SD: the second number is kept above the least one, smoothly (softplus)."""

    def forward(self, x: Tensor) -> Tensor:
        """(batch, 2) to the same shape."""
        return torch.cat([x[:, :1], LEAST_LOG_SD + functional.softplus(x[:, 1:])], dim=1)


def head(inputs: int, generative: bool = False, dropout: float = 0.0) -> nn.Sequential:
    """Dense layers from a list of numbers to the mean, or where generative to mean and log SD, all normalised.

    `dropout` follows each of the two dense layers before the last one.
    """
    first, second = UNITS
    drop = [Dropout(dropout)] if dropout else []
    layers = [nn.Linear(inputs, first), nn.ReLU(), *drop, nn.Linear(first, second), nn.ReLU(), *drop]
    return nn.Sequential(*layers, *(_generative(second) if generative else [nn.Linear(second, 1)]))


def _generative(inputs: int) -> list[nn.Module]:
    """It begins with an SD of about 1, that of the acceleration: from a small one the first steps lead astray."""
    last = nn.Linear(inputs, 2)
    with torch.no_grad():
        last.bias.copy_(torch.tensor([0.0, -LEAST_LOG_SD]))
    return [last, Spread()]


def mae(answer: Tensor, target: Tensor) -> Tensor:
    """The mean absolute error."""
    return functional.l1_loss(answer, target)


def mse(answer: Tensor, target: Tensor) -> Tensor:
    """The mean square error."""
    return functional.mse_loss(answer, target)


def huber(delta: float) -> Loss:
    """Equation 4.9, in SDs of the acceleration."""

    def loss(answer: Tensor, target: Tensor) -> Tensor:
        return functional.huber_loss(answer, target, delta=delta)

    return loss


def nll(answer: Tensor, target: Tensor) -> Tensor:
    """The negative log-likelihood (in nats, without its constant) of mean and log SD (batch, 2), target (batch, 1)."""
    mean, log_sd = answer[:, :1], answer[:, 1:]
    return (0.5 * ((target - mean) * torch.exp(-log_sd)).square() + log_sd).mean()


LOSSES: Mapping[str, Callable[[], Loss]] = {
    "mae": lambda: mae,
    "mse": lambda: mse,
    "huber-1.2": lambda: huber(1.2),
    "huber-1.6": lambda: huber(1.6),
    "huber-2.0": lambda: huber(2.0),
}
"""The five of Figure 4.5."""


def loss_named(name: str) -> Loss:
    """One of `LOSSES`. Raises TextureDataError for another name."""
    if name not in LOSSES:
        raise TextureDataError(f"there is no loss {name!r}: expected {', '.join(LOSSES)}.")
    return LOSSES[name]()
