"""HapInf, the Informer (Zhou et al. 2021) as Chen et al. 2023 take it to continue a texture's acceleration.

From the papers: encoder-decoder, ProbSparse attention, distilling between the encoder's layers, a decoder that begins
with the newest half of the window and a placeholder for the next sample, mean square error; from the thesis (table
4.3): a window of 10. Our choice: a width of 64 with 4 heads and 128 hidden units (there 512, 8 and 2048: too slow for 1
kHz); two encoder layers, one decoder layer; ceil(2 ln length) active queries (there 5 ln length, which is all of ten
places); the placeholder has the newest speed and force; no calendar features.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from palpate.modeling.textures.exporting import Pieces, attention_block_steps, fixed, pieces
from palpate.modeling.textures.fitting import FittedWindows, fit_windows, for_length, shaped
from palpate.modeling.textures.foten_network import loss_named
from palpate.modeling.textures.informer_layers import Attended, Distilled, Embedded, Forward, ProbSparse
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.training.settings import Settings
from palpate.signals.models.card import Reshape
from palpate.signals.models.card_steps import Keep, Part, Recall

WINDOW = 10
WIDTH, HEADS, HIDDEN = 64, 4, 128
FACTOR = 2.0
LEAST = 4
LOSS = "mse"
SETTINGS = Settings(epochs=40, batch=64, learning_rate=1e-3, plateau_patience=2, stop_patience=6, every_epochs=5)


def asking(length: int) -> int:
    """Return the number of active queries for a length."""
    return min(length, math.ceil(FACTOR * math.log(max(2, length))))


class HapInf(nn.Module):
    """The network, from normalised windows (batch, 3, window) to (batch, 1).

    Encoder: (window, 64), a layer, (window // 2, 64), a layer. Decoder: the newest half of the window and a placeholder
    (window // 2 + 1, 64), causal attention among themselves, attention to the encoder; the last place gives the output.
    """

    pick: Tensor

    def __init__(self, window: int = WINDOW) -> None:
        super().__init__()
        if window < LEAST:
            raise TextureDataError(
                f"a window of {window} samples cannot be halved twice: at least {LEAST} is expected."
            )
        self.window, self.newer, self.asked = window, window // 2, window // 2 + 1
        self.register_buffer("pick", picked(window))
        self.embedded, self.wanted = Embedded(window, WIDTH), Embedded(self.asked, WIDTH)
        self.first, self.distilled = _layer(window), Distilled(WIDTH)
        self.second, self.encoded = _layer(self.newer), nn.LayerNorm(WIDTH)
        self.among = Attended(ProbSparse(WIDTH, HEADS, asking(self.asked), causal=True))
        self.across = Attended(ProbSparse(WIDTH, HEADS))
        self.forward_layer, self.decoded = Forward(WIDTH, HIDDEN), nn.LayerNorm(WIDTH)
        self.last = nn.Linear(WIDTH, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Return the prediction (batch, 1) for windows (batch, 3, window)."""
        started = shaped(x, 3, self.window).flatten(1) @ self.pick.T
        memory = self.distilled(self.first(self.embedded(x)))
        memory = self.encoded(self.second(shaped(memory, self.newer, WIDTH)))
        y = self.wanted(started.view(-1, 3, self.asked))
        y = self.decoded(self.forward_layer(self.across(self.among(y), memory)))
        result: Tensor = self.last(shaped(y, self.asked, WIDTH)[:, -1])
        return result


def picked(window: int) -> Tensor:
    """Return the matrix (3 (window // 2 + 1), 3 window) that selects the newest half and a placeholder."""
    half = window // 2
    basis = torch.zeros(3, half + 1, 3, window)
    for channel in range(3):
        basis[channel, :half, channel, window - half :] = torch.eye(half)
        basis[channel, half, channel, window - 1] = float(channel > 0)
    return basis.reshape(3 * (half + 1), 3 * window)


def _layer(length: int) -> nn.Sequential:
    return nn.Sequential(Attended(ProbSparse(WIDTH, HEADS, asking(length))), Forward(WIDTH, HIDDEN))


@pieces.register
def _(layer: HapInf, name: str) -> Pieces:
    signals, memory = f"{name}kept.signals", f"{name}kept.memory"
    yield Keep(kept=signals), {}
    for part in ("embedded", "first", "distilled", "second", "encoded"):
        yield from pieces(getattr(layer, part), f"{name}{part}.")
    yield Keep(kept=memory), {}
    yield Recall(kept=signals), {}
    yield from fixed(layer.pick, layer.pick.new_zeros(len(layer.pick)), f"{name}pick.")
    yield Reshape(shape=(3, layer.asked)), {}
    yield from pieces(layer.wanted, f"{name}wanted.")
    yield from pieces(layer.among, f"{name}among.")
    yield from attention_block_steps(layer.across, f"{name}across.", memory)
    yield from pieces(layer.forward_layer, f"{name}forward_layer.")
    yield from pieces(layer.decoded, f"{name}decoded.")
    yield Part(start=layer.newer, stop=layer.asked, along="length"), {}
    yield from pieces(layer.last, f"{name}last.")


def _fit(learning: Learning) -> FittedWindows:
    loss = loss_named(str(learning.settings.get("loss", LOSS)))
    return fit_windows(HapInf, learning, loss, for_length(SETTINGS, learning), window=WINDOW)


HAPINF = Method(name="hapinf", title="HapInf (Informer)", fit=_fit, window=WINDOW, source="Chen et al. 2023")
