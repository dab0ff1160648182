"""Layers of networks over rows (..., places, channels): convolution, dense layers, pooling; and initial weights."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional


class RowConv(nn.Module):
    """A convolution of rows (..., places, channels) to (..., places, filters), with zeros beyond the ends.

    `weight` (filters, channels, kernel) and `bias`, with their initial values, are those of torch's Conv1d. An even
    kernel extends one place further before than after.
    """

    def __init__(self, channels: int, filters: int, kernel: int, bias: bool = True) -> None:
        super().__init__()
        self.channels, self.filters, self.kernel = channels, filters, kernel
        plain = nn.Conv1d(channels, filters, kernel, bias=bias)
        self.weight, self.bias = plain.weight, plain.bias

    def forward(self, x: Tensor) -> Tensor:
        """Return the convolution of rows; for one filter, the product comes before the shifts, which copies less."""
        if self.filters > 1:
            return functional.linear(neighbours(x, self.kernel), self.matrix(), self.bias)
        parts = _around(functional.linear(x, self.weight[0].T), self.kernel).unbind(-1)
        places = x.shape[-2]
        summed = torch.stack([part[..., tap : tap + places] for tap, part in enumerate(parts)]).sum(dim=0)[..., None]
        return summed if self.bias is None else summed + self.bias

    def matrix(self) -> Tensor:
        """Return the weights (filters, kernel x channels), in the order of `neighbours`."""
        return self.weight.transpose(1, 2).flatten(1)


def dense(inputs: int, outputs: int, gain: float = 2.0) -> nn.Linear:
    """Return a dense layer with initial weights of `_initialise`, of variance `gain / inputs`."""
    layer = nn.Linear(inputs, outputs)
    _initialise(layer.weight, layer.bias, gain / inputs)
    return layer


def row_conv(inputs: int, filters: int, kernel: int) -> RowConv:
    """Return a convolution with initial weights of `_initialise`, of variance 2 / (inputs x kernel)."""
    layer = RowConv(inputs, filters, kernel)
    _initialise(layer.weight, layer.bias, 2.0 / (inputs * kernel))
    return layer


def _initialise(weight: Tensor, bias: Tensor | None, variance: float) -> None:
    """Initialise the weights as He et al. 2015 for ReLU, then make the weights of each unit sum to 0.

    The output of a ReLU has a positive mean, which summed over layers would exceed the differences between rows. With a
    single input channel the weights are not centred.
    """
    with torch.no_grad():
        weight.normal_(0.0, variance**0.5)
        if weight.shape[1] > 1:
            weight -= weight.flatten(1).mean(dim=1).view(-1, *[1] * (weight.ndim - 1))
        if bias is not None:
            bias.zero_()


def neighbours(x: Tensor, kernel: int) -> Tensor:
    """Return the inputs of a kernel at each place of (..., places, channels), as (..., places, kernel x channels)."""
    places, wide = x.shape[-2], _around(x, kernel)
    return torch.cat([wide[..., tap : tap + places, :] for tap in range(kernel)], dim=-1)


def greater_of_two(x: Tensor) -> Tensor:
    """Return the greater of every two places, (batch, places // 2, ...); an odd last place is left out."""
    even = x.shape[1] // 2 * 2
    return torch.maximum(x[:, 0:even:2], x[:, 1:even:2])


def _around(x: Tensor, kernel: int) -> Tensor:
    """Return the rows padded with the zeros beyond the ends that a kernel needs."""
    return functional.pad(x, (0, 0, kernel // 2, (kernel - 1) // 2))


def halved(x: Tensor) -> Tensor:
    """Return the greater of every two steps of (batch, steps, ...); an odd last step stays."""
    return torch.cat([greater_of_two(x), x[:, x.shape[1] // 2 * 2 :]], dim=1)
