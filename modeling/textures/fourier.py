"""The Fourier encoder block: spectrum, encoders of magnitude and phase, and back to the time domain (thesis 4.4.4)."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from palpate.modeling.textures.foten_layers import DROPOUT, HIDDEN, Embedding, Encoder

WIDTH, HEADS = 16, 4
"""Of the encoders of magnitude and phase; the thesis does not say."""
IMPULSE = 1e-3
"""Added to every bin, as an impulse of this height on the oldest sample would (in SDs of the acceleration).

At silence the magnitude has then a gradient, and the phase is 0 instead of the phase of a rounding error.
"""
ABOVE_THE_CUT = 1e-30
"""The imaginary part of bins that are real by nature: their phase is 0 or pi everywhere, never -pi."""


def transform(length: int) -> tuple[Tensor, Tensor]:
    """Equation 4.6 as matrix (2 length, length) and offset (2 length): real parts above, imaginary parts below.

    Bin length - k holds the conjugate of bin k to the bit.
    """
    turns = 2 * math.pi * torch.outer(torch.arange(length), torch.arange(length)).double() / length
    real, imaginary = turns.cos(), -turns.sin()
    for k in range(length):
        if 2 * k % length == 0:
            imaginary[k] = 0
        elif 2 * k > length:
            real[k], imaginary[k] = real[length - k], -imaginary[length - k]
    offset = torch.full((2, length), 0.0, dtype=torch.float64)
    offset[0] = IMPULSE
    offset[1] = torch.where((2 * torch.arange(length)) % length == 0, ABOVE_THE_CUT, 0.0)
    return torch.cat([real, imaginary]).float(), offset.reshape(-1).float()


def inverse(length: int) -> Tensor:
    """The real part of equation 4.8: (length, 2 length), from real parts above and imaginary parts below."""
    turns = 2 * math.pi * torch.outer(torch.arange(length), torch.arange(length)).double() / length
    return torch.cat([turns.cos(), -turns.sin()], dim=1).div(length).float()


class SpectrumEncoder(nn.Module):
    """One number a bin, encoded without positions and brought back to one number a bin.

    It has an embedding of its own: over a single feature a layer normalisation is constant.
    """

    def __init__(self, length: int, dropout: float, normalised_first: bool = False) -> None:
        super().__init__()
        self.embedding = Embedding(length, WIDTH, with_positions=False)
        self.encoder = Encoder(1, WIDTH, HEADS, HIDDEN, dropout, normalised_first)
        self.dense = nn.Linear(WIDTH, 1)

    def forward(self, x: Tensor) -> Tensor:
        """(batch, length) to the same shape."""
        found: Tensor = self.dense(self.encoder(self.embedding(x)))
        return found[..., 0]


class FourierBlock(nn.Module):
    """(batch, length) to the same shape, by way of magnitude and phase; gradients are finite at silence too."""

    matrix: Tensor
    offset: Tensor
    back: Tensor

    def __init__(self, length: int, dropout: float = DROPOUT, normalised_first: bool = False) -> None:
        super().__init__()
        matrix, offset = transform(length)
        self.register_buffer("matrix", matrix)
        self.register_buffer("offset", offset)
        self.register_buffer("back", inverse(length))
        self.magnitude = SpectrumEncoder(length, dropout, normalised_first)
        self.phase = SpectrumEncoder(length, dropout, normalised_first)

    def forward(self, x: Tensor) -> Tensor:
        """Equations 4.6 to 4.8."""
        length = x.shape[1]
        spectrum = torch.addmm(self.offset, x, self.matrix.T)
        real, imaginary = spectrum[:, :length], spectrum[:, length:]
        magnitude = self.magnitude(torch.hypot(real, imaginary))
        phase = self.phase(torch.atan2(imaginary, real))
        return torch.cat([magnitude * phase.cos(), magnitude * phase.sin()], dim=1) @ self.back.T
