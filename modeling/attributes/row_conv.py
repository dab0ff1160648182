"""A convolution along a row, as one matrix product, which is trained faster than torch's own; and the pooling."""

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
        found = torch.stack([part[..., tap : tap + places] for tap, part in enumerate(parts)]).sum(dim=0)[..., None]
        return found if self.bias is None else found + self.bias

    def matrix(self) -> Tensor:
        """The weights (filters, kernel x channels), as `neighbours` arranges a row."""
        return self.weight.transpose(1, 2).flatten(1)


def neighbours(x: Tensor, kernel: int) -> Tensor:
    """(..., places, channels) to (..., places, kernel x channels): what a kernel sees of each place, tap by tap."""
    places, wide = x.shape[-2], _around(x, kernel)
    return torch.cat([wide[..., tap : tap + places, :] for tap in range(kernel)], dim=-1)


def greater_of_two(x: Tensor) -> Tensor:
    """(batch, places, ...) to the greater of every two places; the last one of an odd number is left out."""
    even = x.shape[1] // 2 * 2
    return torch.maximum(x[:, 0:even:2], x[:, 1:even:2])


def _around(x: Tensor, kernel: int) -> Tensor:
    """With the zeros that a kernel sees beyond the ends."""
    return functional.pad(x, (0, 0, kernel // 2, (kernel - 1) // 2))
