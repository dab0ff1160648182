"""The networks that the thesis compares its own with (3.6.6): over rows of features, to one number an attribute.

All take the widths of the rows that they are shown. Of the ANN all sizes are the thesis'; of the others it is known
what kind of network they are, and the sizes are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

BRANCH, FUSED = (128, 256, 256, 128), (64, 64)
VISION, HAPTIC, TACTILE = (16, 32), (16, 32, 64), (32, 64)
"""Filters of the convolutions, each followed by ReLU and by the greatest of every four."""
POOL = 4
VISION_DENSE, HAPTIC_DENSE = (64,), (64, 64)
SEGMENT, LSTM, TACTILE_DENSE = 64, 64, (32,)
DROPOUT = 0.3


class Ann(nn.Module):
    """A branch of 128, 256, 256, 128 for touch and one for sight, fused; 64, 64; one unit for each attribute."""

    def __init__(self, widths: Sequence[int], attributes: int) -> None:
        super().__init__()
        self.touch, self.sight = (dense(width, BRANCH) for width in widths)
        self.fused = nn.Sequential(dense(2 * BRANCH[-1], FUSED), nn.Linear(FUSED[-1], attributes))

    def forward(self, touch: Tensor, sight: Tensor) -> Tensor:
        """(batch, numbers) of touch and of sight to (batch, attributes)."""
        found: Tensor = self.fused(torch.cat([self.touch(touch), self.sight(sight)], dim=1))
        return found


class Cnn(nn.Module):
    """Convolutions along a row of features, dense layers, one unit for each attribute."""

    def __init__(
        self, widths: Sequence[int], attributes: int, filters: Sequence[int], kernel: int, hidden: Sequence[int]
    ) -> None:
        super().__init__()
        self.along = convolved(filters, kernel)
        flat = filters[-1] * pooled(widths[0], len(filters))
        self.head = nn.Sequential(nn.Dropout(DROPOUT), dense(flat, hidden), nn.Linear(hidden[-1], attributes))

    def forward(self, rows: Tensor) -> Tensor:
        """(batch, numbers) to (batch, attributes)."""
        found: Tensor = self.head(self.along(rows[:, None]).flatten(1))
        return found


class CnnLstm(nn.Module):
    """Convolutions along each segment's row, an LSTM over successive segments, dense layers on its last state."""

    def __init__(self, widths: Sequence[int], attributes: int) -> None:
        super().__init__()
        self.along = convolved(TACTILE, 5)
        self.segment = dense(TACTILE[-1] * pooled(widths[0], len(TACTILE)), (SEGMENT,))
        self.lstm = nn.LSTM(SEGMENT, LSTM, batch_first=True)
        self.head = nn.Sequential(
            nn.Dropout(DROPOUT), dense(LSTM, TACTILE_DENSE), nn.Linear(TACTILE_DENSE[-1], attributes)
        )

    def forward(self, rows: Tensor) -> Tensor:
        """(batch, segments, numbers) to (batch, attributes)."""
        each = self.segment(self.along(rows.flatten(0, 1)[:, None]).flatten(1))
        _, (last, _) = self.lstm(each.unflatten(0, rows.shape[:2]))
        found: Tensor = self.head(last[0])
        return found


def dense(width: int, sizes: Sequence[int]) -> nn.Sequential:
    """Dense layers of these sizes, each with ReLU."""
    layers = ((nn.Linear(inputs, outputs), nn.ReLU()) for inputs, outputs in pairwise((width, *sizes)))
    return nn.Sequential(*(layer for pair in layers for layer in pair))


def convolved(filters: Sequence[int], kernel: int) -> nn.Sequential:
    """Convolutions that keep the length, each with ReLU and a pooling that leaves no number out."""
    layers = (
        (
            nn.Conv1d(inputs, outputs, kernel, padding=kernel // 2),
            nn.BatchNorm1d(outputs),
            nn.ReLU(),
            nn.MaxPool1d(POOL, ceil_mode=True),
        )
        for inputs, outputs in pairwise((1, *filters))
    )
    return nn.Sequential(*(layer for block in layers for layer in block))


def pooled(length: int, times: int) -> int:
    """What is left of a row after so many poolings."""
    for _ in range(times):
        length = -(-length // POOL)
    return length


NETWORKS: Mapping[str, Callable[[Sequence[int], int], nn.Module]] = {
    "ann": Ann,
    "vision_cnn": lambda widths, attributes: Cnn(widths, attributes, VISION, 5, VISION_DENSE),
    "haptic_cnn": lambda widths, attributes: Cnn(widths, attributes, HAPTIC, 3, HAPTIC_DENSE),
    "tactile_cnn_lstm": CnnLstm,
}
