"""HV-Net: what a picture's features say, by a convolutional autoencoder and two dense layers (thesis 3.5.1)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.attributes.material import MaterialError

FILTERS = (256, 256, 128, 64, 32)
KERNELS = (4, 4, 3, 3, 3)
DENSE = (512, 128)
LEAST = 2 ** len(FILTERS)
"""The shortest row that can be halved after each layer."""


class Seen(NamedTuple):
    """What HV-Net answers: 128 numbers a picture (batch, 128), and its features made anew (batch, length)."""

    embedded: Tensor
    rebuilt: Tensor


class HVNet(nn.Module):
    """(batch, length) features of pictures to 128 numbers each, and to the features made anew.

    Encoder: five convolutions over the row of features, ReLU and a halving (max pooling 2) after each: of 2304 numbers
    (32, 72) is left, the code. Decoder: the same filters and kernels the other way round, ReLU and a doubling after
    each (to the length that was halved there, where it was odd), and one filter that joins 256 into the row.

    The dense layers 512 and 128 are given the code, and the row that is made anew stands in the loss. The thesis has
    them "after reconstruction": with `after_reconstruction` they are given that row; then ten layers stand between the
    features and the answer, and one channel. That way it errs more after the same training, and prediction needs the
    decoder (docs/reference/attribute-models.md has the numbers).

    Between the layers rows are (batch, places, filters), as `RowConv` takes them.
    """

    def __init__(self, length: int, after_reconstruction: bool = False) -> None:
        super().__init__()
        if length < LEAST:
            raise MaterialError(f"HV-Net halves a row {len(FILTERS)} times: {length} features, {LEAST} are expected.")
        self.length, self.after_reconstruction = length, after_reconstruction
        self.encoder = nn.ModuleList(map(_conv, (1, *FILTERS[:-1]), FILTERS, KERNELS))
        back = FILTERS[::-1]
        self.decoder = nn.ModuleList(map(_conv, (back[0], *back[:-1]), back, KERNELS[::-1]))
        self.join = _conv(back[-1], 1, KERNELS[0])
        inputs = length if after_reconstruction else FILTERS[-1] * (length // LEAST)
        self.first, self.second = dense(inputs, DENSE[0]), dense(*DENSE)

    def forward(self, rows: Tensor) -> Seen:
        """Encode, embed, rebuild. Raises MaterialError for rows of another length."""
        code = self.encode(rows)
        return Seen(self.embed(code), self.decode(code))

    def looked(self, rows: Tensor) -> Tensor:
        """(batch, length) to (batch, 128), without making the features anew where that is not needed."""
        return self.embed(self.encode(rows))

    def encode(self, rows: Tensor) -> Tensor:
        """(batch, length) to (batch, 32, length halved five times). Raises MaterialError for rows of another length."""
        if rows.ndim != 2 or rows.shape[1] != self.length:
            raise MaterialError(f"HV-Net came to {tuple(rows.shape)}: (batch, {self.length}) is expected.")
        x = rows[:, :, None]
        for layer in self.encoder:
            x = torch.relu(greater_of_two(layer(x)))  # the same as ReLU first
        return x.transpose(1, 2)

    def decode(self, code: Tensor) -> Tensor:
        """What `encode` gives to (batch, length)."""
        found: Tensor = self.join(self.stretch(code).transpose(1, 2))[:, :, 0]
        return found

    def stretch(self, code: Tensor) -> Tensor:
        """What `encode` gives to (batch, 256, length)."""
        x = code.transpose(1, 2)
        for layer, length in zip(self.decoder, _lengths(self.length)[::-1], strict=True):
            x = _stretched(torch.relu(layer(x)), length)
        return x.transpose(1, 2)

    def embed(self, code: Tensor) -> Tensor:
        """What `encode` gives to (batch, 128)."""
        return torch.relu(self.second(self.hidden(code)))

    def hidden(self, code: Tensor) -> Tensor:
        """What `encode` gives to (batch, 512)."""
        given = self.decode(code) if self.after_reconstruction else code.flatten(1)
        return torch.relu(self.first(given))


def shapes(network: HVNet, rows: Tensor) -> dict[str, tuple[int, ...]]:
    """The shape of every stage for rows (batch, length), by name; channels before length."""
    with torch.no_grad():
        code = network.encode(rows)
        hidden, seen = network.hidden(code), network(rows)
        stretched = network.stretch(code)
    made = {"code": code, "stretched": stretched, "rebuilt": seen.rebuilt}
    stages = {**made, "hidden": hidden, "embedded": seen.embedded}
    return {name: tuple(stage.shape[1:]) for name, stage in stages.items()}


def dense(inputs: int, outputs: int, gain: float = 2.0) -> nn.Linear:
    """A dense layer that begins as `_begun` says."""
    layer = nn.Linear(inputs, outputs)
    _begun(layer.weight, layer.bias, gain / inputs)
    return layer


def _conv(inputs: int, filters: int, kernel: int) -> RowConv:
    """A convolution of this width."""
    layer = RowConv(inputs, filters, kernel)
    _begun(layer.weight, layer.bias, 2.0 / (inputs * kernel))
    return layer


def _begun(weight: Tensor, bias: Tensor | None, variance: float) -> None:
    """Weights begin as He et al. 2015 have it for ReLU, and so that each unit's sum is nothing.

    What comes out of a ReLU has a mean; summed up, layer after layer, it would drown what differs between two rows. Of
    a single channel all is kept.
    """
    with torch.no_grad():
        weight.normal_(0.0, variance**0.5)
        if weight.shape[1] > 1:
            weight -= weight.flatten(1).mean(dim=1).view(-1, *[1] * (weight.ndim - 1))
        if bias is not None:
            bias.zero_()


def _lengths(length: int) -> tuple[int, ...]:
    """How long the row is before each halving."""
    return tuple(length >> times for times in range(len(FILTERS)))


def _stretched(x: Tensor, length: int) -> Tensor:
    """Every place twice; the last one once more where an odd length was halved."""
    twice = x.repeat_interleave(2, dim=1)
    return twice if twice.shape[1] == length else torch.cat([twice, x[:, -1:]], dim=1)


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
