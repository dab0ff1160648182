"""The network FoTEN, the Fourier-enhanced transformer encoder of thesis 4.4: its layers, and the heads of all networks.

The layers are those of a transformer encoder: embedding with positions, attention, feed-forward, and a fast dropout;
and the Fourier block: spectrum, encoders of magnitude and phase, and back to the time domain (thesis 4.4.4). A head is
the end of a texture's network; its outputs are a mean, or a mean and a log SD, each with a loss.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.textures.recording import CHANNELS, TextureDataError
from palpate.modeling.training.steps import Loss

WIDTH, HEADS, HIDDEN, DROPOUT = 64, 4, 128, 0.2
"""Heads, hidden units of the feed-forward network and dropout are those of thesis 4.4.3 and 4.4.5.

The width of the embedding, d_model, is our choice, since the thesis gives none.
"""
FOURIER_WIDTH, FOURIER_HEADS = 16, 4
"""Width and heads of the encoders of magnitude and phase, which the thesis does not give."""
IMPULSE = 1e-3
"""The height, in SDs of the acceleration, of an impulse at the oldest sample, whose spectrum is added to every bin.

At silence the magnitude then has a gradient, and the phase is 0 instead of that of a rounding error.
"""
ABOVE_THE_CUT = 1e-30
"""The imaginary part of bins that are real by definition, so that their phase is always 0 or pi, never -pi."""
Spectral = Callable[[int, float], nn.Module]
"""A function from a window's length and a dropout to a block from (batch, window) to the same shape."""
WINDOW = 20
LAYERS = 3
UNITS = (256, 64)
"""The two dense layers before the last one (thesis 4.4.5)."""
LEAST_LOG_SD = math.log(0.003)
"""The log of the least SD that a generative head can give, in SDs of the acceleration."""


def positions(length: int, width: int) -> Tensor:
    """Return the positional encoding (length, width) of equations 4.2 and 4.3: sines in even, cosines in odd places."""
    place = torch.arange(length, dtype=torch.float64)[:, None]
    even = torch.arange(0, width, 2, dtype=torch.float64)
    turns = place / 10000.0 ** (even / width)
    return torch.stack([turns.sin(), turns.cos()], dim=-1).reshape(length, width).float()


class Dropout(nn.Module):
    """Dropout: a share of all numbers becomes zero in training and the others are enlarged (Srivastava et al. 2014).

    The share is rounded to a 256th: one random byte decides each number, which takes a fraction of the time of torch's
    own (docs/reference/texture-models.md).
    """

    def __init__(self, share: float) -> None:
        super().__init__()
        self.kept = round(256 * (1 - share))
        if not 0 < self.kept <= 256:
            raise ValueError(f"a dropout of {share} leaves nothing, or more than all: from 0 to below 1.")

    def forward(self, x: Tensor) -> Tensor:
        """Return the input with dropout, in the same shape."""
        if not self.training or self.kept == 256:
            return x
        drawn = torch.empty((x.numel() + 7) // 8, dtype=torch.int64).random_(-(2**63), None)
        mask = (drawn.view(torch.uint8)[: x.numel()].view(x.shape) < self.kept).to(x.dtype)
        return x * mask.mul_(256 / self.kept)


class Embedding(nn.Module):
    """An embedding of each number in `width` numbers, plus the place's own if `with_positions` (thesis 4.4.2)."""

    place: Tensor

    def __init__(self, length: int, width: int, with_positions: bool = True) -> None:
        super().__init__()
        self.dense = nn.Linear(1, width)
        self.register_buffer("place", positions(length, width) if with_positions else torch.zeros(0))

    def forward(self, x: Tensor) -> Tensor:
        """Return the embedding (batch, length, width) of (batch, length)."""
        embedded: Tensor = self.dense(x[..., None])
        return embedded + self.place if self.place.numel() else embedded


class EncoderLayer(nn.Module):
    """An encoder layer: attention and feed-forward, each with a residual connection and a norm (Vaswani et al. 2017).

    `normalised_first`: the input of attention is also normalised, as thesis 4.4.3 describes the layer; the residual
    connection begins before that norm.
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
        """Return the output for (batch, length, width), in the same shape."""
        x = self.after_attention(x + self.dropout(self.attention(self.first(x))))
        inner: Tensor = self.narrow(torch.relu(self.wide(x)))
        result: Tensor = self.after_forward(x + self.dropout(inner))
        return result

    def attention(self, x: Tensor) -> Tensor:
        """Return the multi-head attention of equations 4.4 and 4.5."""
        batch, length, width = x.shape
        mixed: Any = self.mix(x).view(batch, length, 3, self.heads, width // self.heads).permute(2, 0, 3, 1, 4)
        queries, keys, values = mixed.unbind(0)
        heads = functional.scaled_dot_product_attention(queries, keys, values)
        joined: Tensor = self.out(heads.transpose(1, 2).reshape(batch, length, width))
        return joined


class Encoder(nn.Sequential):
    """A sequence of encoder layers."""

    def __init__(
        self, layers: int, width: int = WIDTH, heads: int = HEADS, hidden: int = HIDDEN, dropout: float = DROPOUT,
        normalised_first: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(*(EncoderLayer(width, heads, hidden, dropout, normalised_first) for _ in range(layers)))


def transform(length: int) -> tuple[Tensor, Tensor]:
    """Return equation 4.6 as matrix (2 length, length) and offset (2 length): real parts, then imaginary parts.

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
    """Return the real part of equation 4.8: (length, 2 length), from real parts above and imaginary parts below."""
    turns = 2 * math.pi * torch.outer(torch.arange(length), torch.arange(length)).double() / length
    return torch.cat([turns.cos(), -turns.sin()], dim=1).div(length).float()


class SpectrumEncoder(nn.Module):
    """An encoder of one number per bin, without positions, back to one number per bin.

    It has its own embedding, since layer normalisation over a single feature is constant.
    """

    def __init__(self, length: int, dropout: float, normalised_first: bool = False) -> None:
        super().__init__()
        self.embedding = Embedding(length, FOURIER_WIDTH, with_positions=False)
        self.encoder = Encoder(1, FOURIER_WIDTH, FOURIER_HEADS, HIDDEN, dropout, normalised_first)
        self.dense = nn.Linear(FOURIER_WIDTH, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Return the output for (batch, length), in the same shape."""
        outputs: Tensor = self.dense(self.encoder(self.embedding(x)))
        return outputs[..., 0]


class FourierBlock(nn.Module):
    """The Fourier block by magnitude and phase, (batch, length) to the same; gradients are finite at silence, too."""

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
        """Return the output of equations 4.6 to 4.8."""
        length = x.shape[1]
        spectrum = torch.addmm(self.offset, x, self.matrix.T)
        real, imaginary = spectrum[:, :length], spectrum[:, length:]
        magnitude = self.magnitude(torch.hypot(real, imaginary))
        phase = self.phase(torch.atan2(imaginary, real))
        return torch.cat([magnitude * phase.cos(), magnitude * phase.sin()], dim=1) @ self.back.T


class Foten(nn.Module):
    """The network: normalised windows (batch, 3, window) to (batch, 1), or (batch, 2) if generative (figure 4.3).

    `spectral` returns the block beside the encoder for the window's length and the dropout; without a block the network
    is TEN. `normalised_first` and `head_dropout` follow the thesis to the letter (4.4.3, 4.4.5): see `literal`.
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
        """Return the head's output for the encoder and spectral block side by side, with speed and force."""
        if x.shape[1:] != (CHANNELS, self.window):
            raise TextureDataError(f"windows of shape {tuple(x.shape)}: (batch, 3, {self.window}) is expected.")
        past = x[:, 0]
        beside = [] if self.spectral is None else [self.spectral(past)]
        encoded = self.encoder(self.embedded(self.embedding(past)))
        hand = torch.stack([*beside, x[:, 1], x[:, 2]], dim=-1)
        result: Tensor = self.head(torch.cat([encoded, hand], dim=-1).flatten(1))
        return result


class Spread(nn.Module):
    """A layer that turns (batch, 2) into mean and log SD, with a smooth lower bound of the latter (softplus)."""

    def forward(self, x: Tensor) -> Tensor:
        """Return mean and log SD, (batch, 2)."""
        return torch.cat([x[:, :1], LEAST_LOG_SD + functional.softplus(x[:, 1:])], dim=1)


def head(inputs: int, generative: bool = False, dropout: float = 0.0) -> nn.Sequential:
    """Return dense layers from a list of numbers to the normalised mean, or mean and log SD if `generative`.

    `dropout` follows each of the two dense layers before the last one.
    """
    first, second = UNITS
    drop = [Dropout(dropout)] if dropout else []
    layers = [nn.Linear(inputs, first), nn.ReLU(), *drop, nn.Linear(first, second), nn.ReLU(), *drop]
    last = nn.Linear(second, 2 if generative else 1)
    if not generative:
        return nn.Sequential(*layers, last)
    # training starts with an SD of about 1, that of the acceleration: from a small one the first steps diverge
    with torch.no_grad():
        last.bias.copy_(torch.tensor([0.0, -LEAST_LOG_SD]))
    return nn.Sequential(*layers, last, Spread())


def mae(answer: Tensor, target: Tensor) -> Tensor:
    """Return the mean absolute error."""
    return functional.l1_loss(answer, target)


def mse(answer: Tensor, target: Tensor) -> Tensor:
    """Return the mean square error."""
    return functional.mse_loss(answer, target)


def huber(delta: float) -> Loss:
    """Return the Huber loss of equation 4.9, its delta in SDs of the acceleration."""

    def loss(answer: Tensor, target: Tensor) -> Tensor:
        return functional.huber_loss(answer, target, delta=delta)

    return loss


def nll(answer: Tensor, target: Tensor) -> Tensor:
    """Return the negative log-likelihood (nats, without its constant) of targets (batch, 1) by mean and log SD."""
    mean, log_sd = answer[:, :1], answer[:, 1:]
    return (0.5 * ((target - mean) * torch.exp(-log_sd)).square() + log_sd).mean()


LOSSES: Mapping[str, Callable[[], Loss]] = {
    "mae": lambda: mae,
    "mse": lambda: mse,
    "huber-1.2": lambda: huber(1.2),
    "huber-1.6": lambda: huber(1.6),
    "huber-2.0": lambda: huber(2.0),
}
"""The five losses of Figure 4.5."""


def loss_named(name: str) -> Loss:
    """Return one of `LOSSES`. Raises TextureDataError for another name."""
    if name not in LOSSES:
        raise TextureDataError(f"there is no loss {name!r}: expected {', '.join(LOSSES)}.")
    return LOSSES[name]()
