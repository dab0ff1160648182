"""HT-Net: what a segment of touch says, by six stacked ConvLSTM layers (thesis 3.5.2)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from palpate.modeling.attributes.conv_lstm import ConvLSTM1D
from palpate.modeling.attributes.hv_net import greater_of_two
from palpate.modeling.attributes.material import MaterialError

FILTERS = (128, 256, 128, 128, 256, 128)
POOLED = (2, 4, 5)
"""The layers, counted from one, after which every two steps become one."""


class HTNet(nn.Module):
    """(batch, steps, channels, places) of segments to 128 numbers each.

    The last hidden state of the last layer, (128, places), is averaged over its places. An odd step at the end stays by
    itself where steps are halved: of ten steps five, three and two are left, so that the last layer still has a past.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.channels = channels
        inputs = (channels, *FILTERS[:-1])
        self.layers = nn.ModuleList(ConvLSTM1D(*sizes) for sizes in zip(inputs, FILTERS, strict=True))

    def forward(self, x: Tensor) -> Tensor:
        """(batch, steps, channels, places) to (batch, 128). Raises MaterialError for another shape."""
        return self.stages(x)[-1][:, -1].mean(dim=2)

    def stages(self, x: Tensor) -> list[Tensor]:
        """What each layer gives, halved where it is: (batch, steps, filters, places)."""
        if x.ndim != 4 or x.shape[2] != self.channels or 0 in x.shape[1:]:
            raise MaterialError(f"HT-Net came to {tuple(x.shape)}: (batch, steps, {self.channels}, places) is needed.")
        found: list[Tensor] = []
        for place, layer in enumerate(self.layers, 1):
            x = layer(x)
            if place in POOLED:
                x = halved(x)
            found.append(x)
        return found


def halved(x: Tensor) -> Tensor:
    """(batch, steps, ...) to the greater of every two steps, (batch, half as many rounded up, ...)."""
    return torch.cat([greater_of_two(x), x[:, x.shape[1] // 2 * 2 :]], dim=1)


def shapes(network: HTNet, x: Tensor) -> dict[str, tuple[int, ...]]:
    """The shape after every layer for segments (batch, steps, channels, places), and of the answer, by name."""
    with torch.no_grad():
        stages = network.stages(x)
        found = {f"layer {place}": tuple(stage.shape[1:]) for place, stage in enumerate(stages, 1)}
        return {**found, "embedded": tuple(network(x).shape[1:])}
