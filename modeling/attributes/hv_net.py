"""HV-Net (thesis 3.5.1): a convolutional autoencoder of a picture's features, and two dense layers."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.row_layers import dense, greater_of_two, row_conv

SIGHT_FILTERS = (256, 256, 128, 64, 32)
KERNELS = (4, 4, 3, 3, 3)
DENSE = (512, 128)
LEAST_NORM = 2 ** len(SIGHT_FILTERS)
"""The shortest row that can be halved after each layer."""


class HVOutput(NamedTuple):
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
        if length < LEAST_NORM:
            raise MaterialError(
                f"HV-Net halves a row {len(SIGHT_FILTERS)} times: {length} features, {LEAST_NORM} are expected."
            )
        self.length, self.after_reconstruction = length, after_reconstruction
        self.encoder = nn.ModuleList(map(row_conv, (1, *SIGHT_FILTERS[:-1]), SIGHT_FILTERS, KERNELS))
        back = SIGHT_FILTERS[::-1]
        self.decoder = nn.ModuleList(map(row_conv, (back[0], *back[:-1]), back, KERNELS[::-1]))
        self.join = row_conv(back[-1], 1, KERNELS[0])
        inputs = length if after_reconstruction else SIGHT_FILTERS[-1] * (length // LEAST_NORM)
        self.first, self.second = dense(inputs, DENSE[0]), dense(*DENSE)

    def forward(self, rows: Tensor) -> HVOutput:
        """Encode, embed, rebuild. Raises MaterialError for rows of another length."""
        code = self.encode(rows)
        return HVOutput(self.embed(code), self.decode(code))

    def embed_rows(self, rows: Tensor) -> Tensor:
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
        """Rebuild features (batch, length) from the code of `encode`."""
        result: Tensor = self.join(self.stretch(code).transpose(1, 2))[:, :, 0]
        return result

    def stretch(self, code: Tensor) -> Tensor:
        """Stretch the code of `encode` to (batch, 256, length)."""
        x = code.transpose(1, 2)
        lengths = [self.length >> times for times in reversed(range(len(SIGHT_FILTERS)))]
        for layer, length in zip(self.decoder, lengths, strict=True):
            # every place twice; the last one once more where an odd length was halved
            x = torch.relu(layer(x)).repeat_interleave(2, dim=1)
            x = x if x.shape[1] == length else torch.cat([x, x[:, -1:]], dim=1)
        return x.transpose(1, 2)

    def embed(self, code: Tensor) -> Tensor:
        """Return the embedding (batch, 128) of the code of `encode`."""
        return torch.relu(self.second(self.hidden(code)))

    def hidden(self, code: Tensor) -> Tensor:
        """Return the hidden layer (batch, 512) of the code of `encode`."""
        given = self.decode(code) if self.after_reconstruction else code.flatten(1)
        return torch.relu(self.first(given))
