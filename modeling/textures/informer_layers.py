"""Layers of the Informer (Zhou et al. 2021): attention with few active queries, and layers that halve the length."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.textures.foten_network import Dropout, positions

DROPOUT = 0.05


class ProbSparse(nn.Module):
    """Multi-head attention with `asking` active queries; at the other places the output is the mean of the values.

    Active are the queries whose greatest score exceeds their mean most (equation 4 there, over all keys instead of
    random ones, so that the output is deterministic). If `causal`, a place does not see later ones, and the output of
    an inactive query is the sum of the values up to there. `asking` None: all queries are active.
    """

    def __init__(self, width: int, heads: int, asking: int | None = None, causal: bool = False) -> None:
        super().__init__()
        self.heads, self.asking, self.causal = heads, asking, causal
        self.mix, self.out = nn.Linear(width, 3 * width), nn.Linear(width, width)

    def forward(self, x: Tensor, memory: Tensor | None = None) -> Tensor:
        """Return the output for x (batch, length, width), with keys and values of `memory` (batch, any, width) or x."""
        sources = (x, x, x) if memory is None else (x, memory, memory)
        weights, biases = self.mix.weight.chunk(3), self.mix.bias.chunk(3)
        rows = (functional.linear(*parts) for parts in zip(sources, weights, biases, strict=True))
        # each (batch, heads, length, width / heads)
        queries, keys, values = (row.view(*row.shape[:2], self.heads, -1).transpose(1, 2) for row in rows)
        scores = queries @ keys.transpose(-1, -2) / math.sqrt(queries.shape[-1])
        asks = self._active_queries(scores.detach())
        if self.causal:
            scores = scores.masked_fill(torch.ones(scores.shape[-2:], dtype=torch.bool).triu(1), -math.inf)
        answers = scores.softmax(dim=-1) @ values
        if asks is not None:
            plain = values.cumsum(dim=2) if self.causal else values.mean(dim=2, keepdim=True)
            answers = torch.where(asks[..., None], answers, plain)
        joined: Tensor = self.out(answers.transpose(1, 2).flatten(2))
        return joined

    def _active_queries(self, scores: Tensor) -> Tensor | None:
        """Return a mask (batch, heads, length) of the active queries; None if all are active."""
        if self.asking is None or self.asking >= scores.shape[2]:
            return None
        apart = scores.max(dim=-1).values - scores.mean(dim=-1)
        first = apart.sort(dim=-1, descending=True, stable=True).indices[..., : self.asking]
        return torch.zeros_like(apart, dtype=torch.bool).scatter(-1, first, True)


class Embedded(nn.Module):
    """An embedding of each place with its neighbours in `width` numbers, plus its position.

    The paper's convolution is circular; this one has zeros beyond the ends, since a texture does not repeat.
    """

    place: Tensor

    def __init__(self, length: int, width: int) -> None:
        super().__init__()
        self.conv = nn.Conv1d(3, width, 3, padding=1)
        self.register_buffer("place", positions(length, width))

    def forward(self, x: Tensor) -> Tensor:
        """Return the embedding (batch, length, width) of (batch, 3, length)."""
        result: Tensor = self.conv(x).transpose(1, 2) + self.place
        return result


class Forward(nn.Module):
    """Two dense layers per place with a GELU between them, a residual connection, and a norm."""

    def __init__(self, width: int, hidden: int) -> None:
        super().__init__()
        self.wide, self.narrow = nn.Linear(width, hidden), nn.Linear(hidden, width)
        self.norm, self.dropout = nn.LayerNorm(width), Dropout(DROPOUT)

    def forward(self, x: Tensor) -> Tensor:
        """Return the output for (batch, length, width), in the same shape."""
        inner = self.dropout(functional.gelu(self.wide(x)))
        result: Tensor = self.norm(x + self.dropout(self.narrow(inner)))
        return result


class Attended(nn.Module):
    """An attention with a residual connection and a norm."""

    def __init__(self, attention: ProbSparse) -> None:
        super().__init__()
        self.attention = attention
        self.norm, self.dropout = nn.LayerNorm(attention.out.out_features), Dropout(DROPOUT)

    def forward(self, x: Tensor, memory: Tensor | None = None) -> Tensor:
        """Return the output for (batch, length, width), in the same shape."""
        result: Tensor = self.norm(x + self.dropout(self.attention(x, memory)))
        return result


class Distilled(nn.Module):
    """A halving of the length: convolution, batch normalisation, ELU, and the greater of two neighbours.

    The paper's pooling is over three places with a step of two; model cards only have pooling without overlap.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.conv = nn.Conv1d(width, width, 3, padding=1, bias=False)  # the norm has one
        self.norm = nn.BatchNorm1d(width)

    def forward(self, x: Tensor) -> Tensor:
        """Return the output (batch, length // 2, width) for (batch, length, width)."""
        inner = functional.elu(self.norm(self.conv(x.transpose(1, 2))))
        return functional.max_pool1d(inner, 2).transpose(1, 2)
