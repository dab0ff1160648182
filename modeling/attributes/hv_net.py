"""HV-Net (thesis 3.5.1): a convolutional autoencoder of a picture's features, with two dense layers."""

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
"""The shortest row that can be halved once per layer."""


class HVOutput(NamedTuple):
    """The output of HV-Net: embeddings (batch, 128), and reconstructed features (batch, length)."""

    embedded: Tensor
    rebuilt: Tensor


class HVNet(nn.Module):
    """HV-Net: features of pictures (batch, length) to embeddings (batch, 128) and reconstructed features.

    Encoder: five convolutions along the features, each with ReLU and max pooling of 2, so that 2304 features become the
    code (32, 72). Decoder: the same filters and kernels in reverse order, each with ReLU and a doubling (to the length
    before the pooling, where that was odd), and a last convolution from 256 filters to one.

    The dense layers 512 and 128 take the code, and the loss includes the reconstruction. The thesis has them "after
    reconstruction": with `after_reconstruction` they take the reconstructed row. Then ten layers and a single channel
    lie between the features and the answer: the errors are larger after the same training, and prediction needs the
    decoder (numbers: docs/reference/attribute-models.md).

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
        """Return embeddings and reconstruction of rows (batch, length). Raises MaterialError for another shape."""
        code = self.encode(rows)
        return HVOutput(self.embed(code), self.decode(code))

    def embed_rows(self, rows: Tensor) -> Tensor:
        """Return the embeddings (batch, 128) of rows (batch, length), without the reconstruction where possible."""
        return self.embed(self.encode(rows))

    def encode(self, rows: Tensor) -> Tensor:
        """Return the code (batch, 32, length // 32) of rows (batch, length). Raises MaterialError for other shapes."""
        if rows.ndim != 2 or rows.shape[1] != self.length:
            raise MaterialError(f"HV-Net came to {tuple(rows.shape)}: (batch, {self.length}) is expected.")
        x = rows[:, :, None]
        for layer in self.encoder:
            x = torch.relu(greater_of_two(layer(x)))  # equal to ReLU before pooling
        return x.transpose(1, 2)

    def decode(self, code: Tensor) -> Tensor:
        """Return the reconstructed features (batch, length) of the code of `encode`."""
        result: Tensor = self.join(self.stretch(code).transpose(1, 2))[:, :, 0]
        return result

    def stretch(self, code: Tensor) -> Tensor:
        """Return the output of the decoder before the last convolution, (batch, 256, length)."""
        x = code.transpose(1, 2)
        lengths = [self.length >> times for times in reversed(range(len(SIGHT_FILTERS)))]
        for layer, length in zip(self.decoder, lengths, strict=True):
            # every place is doubled; the last one is tripled where the length before the pooling was odd
            x = torch.relu(layer(x)).repeat_interleave(2, dim=1)
            x = x if x.shape[1] == length else torch.cat([x, x[:, -1:]], dim=1)
        return x.transpose(1, 2)

    def embed(self, code: Tensor) -> Tensor:
        """Return the embedding (batch, 128) of the code of `encode`."""
        return torch.relu(self.second(self.hidden(code)))

    def hidden(self, code: Tensor) -> Tensor:
        """Return the hidden layer (batch, 512) of the code of `encode`."""
        inputs = self.decode(code) if self.after_reconstruction else code.flatten(1)
        return torch.relu(self.first(inputs))
