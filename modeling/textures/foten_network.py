"""The network FoTEN, the Fourier-enhanced transformer encoder of thesis 4.4, as torch modules."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn

from palpate.modeling.textures.foten_layers import DROPOUT, WIDTH, Dropout, Embedding, Encoder
from palpate.modeling.textures.fourier import FourierBlock
from palpate.modeling.textures.heads import head
from palpate.modeling.textures.recording import CHANNELS, TextureDataError

Spectral = Callable[[int, float], nn.Module]
"""A window's length and a dropout to a block from (batch, window) to the same shape."""
WINDOW = 20
LAYERS = 3


class Foten(nn.Module):
    """(batch, 3, window) normalised to (batch, 1), or (batch, 2) where generative (thesis figure 4.3).

    `spectral` makes the block beside the encoder from the window's length and the dropout; without one it is TEN.
    `normalised_first` and `head_dropout` are the thesis' to the letter (4.4.3, 4.4.5): see `literal`.
    """

    def __init__(
        self,
        window: int = WINDOW,
        spectral: Spectral | None = FourierBlock,
        generative: bool = False,
        dropout: float = DROPOUT,
        normalised_first: bool = False,
        head_dropout: float = 0.0,
    ) -> None:
        super().__init__()
        self.window = window
        self.embedding = Embedding(window, WIDTH)
        self.embedded = Dropout(head_dropout)
        self.encoder = Encoder(LAYERS, dropout=dropout, normalised_first=normalised_first)
        self.spectral = None if spectral is None else spectral(window, dropout)
        self.head = head(window * (WIDTH + 2 + (self.spectral is not None)), generative, head_dropout)

    def forward(self, x: Tensor) -> Tensor:
        """Encoder block and spectral block side by side, with speed and force beside them, and the head."""
        if x.shape[1:] != (CHANNELS, self.window):
            raise TextureDataError(f"windows of shape {tuple(x.shape)}: (batch, 3, {self.window}) is expected.")
        past = x[:, 0]
        beside = [] if self.spectral is None else [self.spectral(past)]
        encoded = self.encoder(self.embedded(self.embedding(past)))
        hand = torch.stack([*beside, x[:, 1], x[:, 2]], dim=-1)
        found: Tensor = self.head(torch.cat([encoded, hand], dim=-1).flatten(1))
        return found
