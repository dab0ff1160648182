"""Layers of networks over rows (..., places, channels): convolution, dense layers, pooling, and their first weights."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional


class RowConv(nn.Module):
    """(..., places, channels) to (..., places, filters), zeros beyond the ends.

    `weight` (filters, channels, kernel) and `bias` are, and begin as, those of torch's Conv1d. An even kernel sees one
    place more before than after.
    """

    def __init__(self, channels: int, filters: int, kernel: int, bias: bool = True) -> None:
        super().__init__()
        self.channels, self.filters, self.kernel = channels, filters, kernel
        plain = nn.Conv1d(channels, filters, kernel, bias=bias)
        self.weight, self.bias = plain.weight, plain.bias

    def forward(self, x: Tensor) -> Tensor:
        """Bring together what the kernel sees, and multiply; for one filter the other way round, which copies less."""
        if self.filters > 1:
            return functional.linear(neighbours(x, self.kernel), self.matrix(), self.bias)
        parts = _around(functional.linear(x, self.weight[0].T), self.kernel).unbind(-1)
        places = x.shape[-2]
        summed = torch.stack([part[..., tap : tap + places] for tap, part in enumerate(parts)]).sum(dim=0)[..., None]
        return summed if self.bias is None else summed + self.bias

    def matrix(self) -> Tensor:
        """Return the weights (filters, kernel x channels), as `neighbours` arranges a row."""
        return self.weight.transpose(1, 2).flatten(1)


def dense(inputs: int, outputs: int, gain: float = 2.0) -> nn.Linear:
    """Return a dense layer whose weights `_initialise` has set."""
    layer = nn.Linear(inputs, outputs)
    _initialise(layer.weight, layer.bias, gain / inputs)
    return layer


def row_conv(inputs: int, filters: int, kernel: int) -> RowConv:
    """Return a convolution of this width, whose weights `_initialise` has set."""
    layer = RowConv(inputs, filters, kernel)
    _initialise(layer.weight, layer.bias, 2.0 / (inputs * kernel))
    return layer


def _initialise(weight: Tensor, bias: Tensor | None, variance: float) -> None:
    """Initialise the weights as He et al. 2015 do for ReLU, and so that the weights of each unit sum to 0.

    What comes out of a ReLU has a mean; summed up, layer after layer, it would drown what differs between two rows. Of
    a single channel all is kept.
    """
    with torch.no_grad():
        weight.normal_(0.0, variance**0.5)
        if weight.shape[1] > 1:
            weight -= weight.flatten(1).mean(dim=1).view(-1, *[1] * (weight.ndim - 1))
        if bias is not None:
            bias.zero_()


def neighbours(x: Tensor, kernel: int) -> Tensor:
    """(..., places, channels) to (..., places, kernel x channels): what a kernel sees of each place, tap by tap."""
    places, wide = x.shape[-2], _around(x, kernel)
    return torch.cat([wide[..., tap : tap + places, :] for tap in range(kernel)], dim=-1)


def greater_of_two(x: Tensor) -> Tensor:
    """(batch, places, ...) to the greater of every two places; the last one of an odd number is left out."""
    even = x.shape[1] // 2 * 2
    return torch.maximum(x[:, 0:even:2], x[:, 1:even:2])


def _around(x: Tensor, kernel: int) -> Tensor:
    """Return the rows with the zeros that a kernel sees beyond the ends."""
    return functional.pad(x, (0, 0, kernel // 2, (kernel - 1) // 2))


def halved(x: Tensor) -> Tensor:
    """(batch, steps, ...) to the greater of every two steps, (batch, half as many rounded up, ...)."""
    return torch.cat([greater_of_two(x), x[:, x.shape[1] // 2 * 2 :]], dim=1)
