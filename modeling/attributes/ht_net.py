"""HT-Net (thesis 3.5.2): six stacked one-dimensional ConvLSTM layers.

The layers are those of Shi et al. 2015 without peepholes, as Keras' ConvLSTM1D."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.row_layers import RowConv, halved, neighbours

KERNEL = 3
GAIN = 4.0
"""The factor on Glorot's initial weights from the input. A sigmoid times a tanh quarters a small signal, so six layers
would leave a 4000th, and hundreds of steps would pass before anything is learned."""
TOUCH_FILTERS = (128, 256, 128, 128, 256, 128)
POOLED = (2, 4, 5)
"""The layers, counted from one, after which pairs of steps are pooled into one."""


class ConvLSTM1D(nn.Module):
    """A ConvLSTM layer: a long short-term memory at each place, whose gates also use the neighbouring places.

    (i, f, g, o) = W * x_t + U * h_(t-1) + b;  c_t = s(f) c_(t-1) + s(i) tanh(g);  h_t = s(o) tanh(c_t)

    where * is a convolution over places with zeros beyond the ends, s the logistic function, h_0 = c_0 = 0. The gates
    have the order of torch.nn.LSTM: with a kernel of one and a single place it is that layer.
    """

    def __init__(self, channels: int, filters: int, kernel: int = KERNEL) -> None:
        super().__init__()
        if kernel < 1 or kernel % 2 == 0:
            raise MaterialError(f"a kernel of {kernel} places has no middle: an odd number is expected.")
        self.channels, self.filters = channels, filters
        self.given = RowConv(channels, 4 * filters, kernel)
        self.kept = RowConv(filters, 4 * filters, kernel, bias=False)
        self._initialise_weights()

    def forward(self, x: Tensor) -> Tensor:
        """Return the hidden state of every step, (batch, steps, filters, places), for (batch, steps, channels, places).

        Raises MaterialError for another shape.
        """
        if x.ndim != 4 or x.shape[2] != self.channels or not x.shape[1]:
            raise MaterialError(f"a ConvLSTM came to {tuple(x.shape)}: (batch, steps, {self.channels}, places) needed.")
        from_input, recurrent = self.given(x.permute(1, 0, 3, 2)), self.kept.matrix().T
        hidden: list[Tensor] = []
        cell: Tensor | None = None
        for step in from_input.unbind(0):  # (batch, places, gates)
            gates = step
            if hidden:  # the first step has no past
                past = neighbours(hidden[-1], self.kept.kernel).flatten(0, 1)
                gates = torch.addmm(step.flatten(0, 1), past, recurrent).view(step.shape)
            input_gate, forget_gate, candidate, output_gate = gates.chunk(4, dim=2)
            update = torch.sigmoid(input_gate) * torch.tanh(candidate)
            cell = update if cell is None else torch.sigmoid(forget_gate) * cell + update
            hidden.append(torch.sigmoid(output_gate) * torch.tanh(cell))
        return torch.stack(hidden, dim=1).transpose(2, 3)

    def _initialise_weights(self) -> None:
        """Initialise the weights: Glorot's from the input, orthogonal from the past; a forget gate's bias is 1."""
        with torch.no_grad():
            for weights in self.given.weight.chunk(4):
                nn.init.xavier_uniform_(weights, gain=GAIN)
            for weights in self.kept.weight.chunk(4):
                weights.zero_()
                nn.init.orthogonal_(weights[:, :, weights.shape[2] // 2])
            if self.given.bias is not None:
                self.given.bias.zero_()
                self.given.bias[self.filters : 2 * self.filters] = 1.0


class HTNet(nn.Module):
    """HT-Net: segments (batch, steps, channels, places) to embeddings (batch, 128).

    The last hidden state of the last layer, (128, places), is averaged over its places. Where steps are pooled, an odd
    last step stays: ten steps become five, three and two, so that the last layer still has a past.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.channels = channels
        inputs = (channels, *TOUCH_FILTERS[:-1])
        self.layers = nn.ModuleList(ConvLSTM1D(*sizes) for sizes in zip(inputs, TOUCH_FILTERS, strict=True))

    def forward(self, x: Tensor) -> Tensor:
        """Return the embeddings (batch, 128) of segments. Raises MaterialError for another shape."""
        return self.stages(x)[-1][:, -1].mean(dim=2)

    def stages(self, x: Tensor) -> list[Tensor]:
        """Return the output of each layer after its pooling: (batch, steps, filters, places) each."""
        if x.ndim != 4 or x.shape[2] != self.channels or 0 in x.shape[1:]:
            raise MaterialError(f"HT-Net came to {tuple(x.shape)}: (batch, steps, {self.channels}, places) is needed.")
        result: list[Tensor] = []
        for place, layer in enumerate(self.layers, 1):
            x = layer(x)
            if place in POOLED:
                x = halved(x)
            result.append(x)
        return result
