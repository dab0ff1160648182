"""Layers that more than one network is made of."""

from __future__ import annotations

import torch
from torch import Tensor, nn


class ResidualBlock(nn.Module):
    """relu(x + conv(relu(conv(x)))), both of width 3, the length kept (thesis equation 5.2)."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.first = nn.Conv1d(channels, channels, 3, padding=1)
        self.second = nn.Conv1d(channels, channels, 3, padding=1)

    def forward(self, x: Tensor) -> Tensor:
        """(batch, channels, length) to the same shape."""
        inner: Tensor = self.second(torch.relu(self.first(x)))
        return torch.relu(x + inner)


def conv_relu(inputs: int, outputs: int, width: int = 3, pad: int = 1) -> nn.Sequential:
    """A convolution and a ReLU (thesis equation 5.1)."""
    return nn.Sequential(nn.Conv1d(inputs, outputs, width, padding=pad), nn.ReLU())
