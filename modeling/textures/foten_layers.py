"""Layers of the transformer encoders: embedding with positions, attention, feed-forward, and a quick dropout."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

WIDTH, HEADS, HIDDEN, DROPOUT = 64, 4, 128, 0.2
"""Heads, hidden units of the feed-forward network and dropout are those of thesis 4.4.3 and 4.4.5. The width of the
embedding, d_model, is ours: the thesis gives none."""


def positions(length: int, width: int) -> Tensor:
    """Equations 4.2 and 4.3: (length, width), sines in even and cosines in odd places."""
    place = torch.arange(length, dtype=torch.float64)[:, None]
    even = torch.arange(0, width, 2, dtype=torch.float64)
    turns = place / 10000.0 ** (even / width)
    return torch.stack([turns.sin(), turns.cos()], dim=-1).reshape(length, width).float()


class Dropout(nn.Module):
    """Zero a share of all numbers while training and enlarge the others (Srivastava et al. 2014).

    The share is rounded to a 256th: one random byte decides each number, which takes a fraction of the time of torch's
    own (docs/reference/texture-models.md).
    """

    def __init__(self, share: float) -> None:
        super().__init__()
        self.kept = round(256 * (1 - share))
        if not 0 < self.kept <= 256:
            raise ValueError(f"a dropout of {share} leaves nothing, or more than all: from 0 to below 1.")

    def forward(self, x: Tensor) -> Tensor:
        """Any shape to the same one."""
        if not self.training or self.kept == 256:
            return x
        drawn = torch.empty((x.numel() + 7) // 8, dtype=torch.int64).random_(-(2**63), None)
        mask = (drawn.view(torch.uint8)[: x.numel()].view(x.shape) < self.kept).to(x.dtype)
        return x * mask.mul_(256 / self.kept)


class Embedding(nn.Module):
    """One number a place to `width` numbers, and the place's own added (thesis 4.4.2), unless that is not asked for."""

    place: Tensor

    def __init__(self, length: int, width: int, with_positions: bool = True) -> None:
        super().__init__()
        self.dense = nn.Linear(1, width)
        self.register_buffer("place", positions(length, width) if with_positions else torch.zeros(0))

    def forward(self, x: Tensor) -> Tensor:
        """(batch, length) to (batch, length, width)."""
        embedded: Tensor = self.dense(x[..., None])
        return embedded + self.place if self.place.numel() else embedded


class EncoderLayer(nn.Module):
    """Attention and feed-forward, each with a way around and then normalised (Vaswani et al. 2017).

    `normalised_first`: what goes into attention is normalised, too, as thesis 4.4.3 describes the layer; the way around
    begins before that.
    """

    def __init__(
        self, width: int = WIDTH, heads: int = HEADS, hidden: int = HIDDEN, dropout: float = DROPOUT,
        normalised_first: bool = False,
    ) -> None:  # fmt: skip
        super().__init__()
        self.heads = heads
        self.first = nn.LayerNorm(width) if normalised_first else nn.Identity()
        self.mix = nn.Linear(width, 3 * width)
        self.out = nn.Linear(width, width)
        self.after_attention = nn.LayerNorm(width)
        self.wide, self.narrow = nn.Linear(width, hidden), nn.Linear(hidden, width)
        self.after_forward = nn.LayerNorm(width)
        self.dropout = Dropout(dropout)

    def forward(self, x: Tensor) -> Tensor:
        """(batch, length, width) to the same shape."""
        x = self.after_attention(x + self.dropout(self.attention(self.first(x))))
        inner: Tensor = self.narrow(torch.relu(self.wide(x)))
        found: Tensor = self.after_forward(x + self.dropout(inner))
        return found

    def attention(self, x: Tensor) -> Tensor:
        """Equations 4.4 and 4.5."""
        batch, length, width = x.shape
        mixed: Any = self.mix(x).view(batch, length, 3, self.heads, width // self.heads).permute(2, 0, 3, 1, 4)
        queries, keys, values = mixed.unbind(0)
        heads = functional.scaled_dot_product_attention(queries, keys, values)
        joined: Tensor = self.out(heads.transpose(1, 2).reshape(batch, length, width))
        return joined


class Encoder(nn.Sequential):
    """Several such layers, one after another."""

    def __init__(
        self, layers: int, width: int = WIDTH, heads: int = HEADS, hidden: int = HIDDEN, dropout: float = DROPOUT,
        normalised_first: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(*(EncoderLayer(width, heads, hidden, dropout, normalised_first) for _ in range(layers)))
