"""The deep spatio-temporal network of Joolee and Jeon 2021: convolutions and a BiLSTM, both with attention.

From the paper's abstract: one-dimensional convolutions with attention for local features, then an encoder and decoder
with attention for changes over time; from the thesis: the recurrent layer is a BiLSTM, the window 40 (table 4.3). Our
choice, since the thesis does not say: two convolutions of 32 channels and width 3, 32 hidden units in each direction,
scaled dot-product attention with one head, gradients clipped to a length of 1, mean square error.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor, nn

from palpate.modeling.textures.exporting import Pieces, attention_steps, pieces
from palpate.modeling.textures.fitting import FittedWindows, fit_windows, for_length, shaped
from palpate.modeling.textures.foten_network import loss_named
from palpate.modeling.textures.informer_layers import ProbSparse
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.training.optimisers import clipped
from palpate.modeling.training.settings import Settings
from palpate.signals.models.card import Activation
from palpate.signals.models.card_steps import Add, Join, Keep, Lstm, Part, Recall

WINDOW = 40
CHANNELS, HIDDEN, UNITS = 32, 32, 64
CLIP = 1.0
LOSS = "mse"
SETTINGS = Settings(epochs=40, batch=64, learning_rate=1e-3, plateau_patience=2, stop_patience=6, every_epochs=2)
WEIGHTS = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
"""torch's names of the weights."""


class Dstn(nn.Module):
    """The network, from normalised windows (batch, 3, window) to (batch, 1).

    Convolutions: (32, window). Attention over the places, added to them, and a norm: (window, 32). BiLSTM: (window,
    64). Decoder: the newest place attends to all places (64), and both together (128) go through layers of 64 and 1.
    """

    def __init__(self, window: int = WINDOW) -> None:
        super().__init__()
        self.window = window
        self.first = nn.Conv1d(3, CHANNELS, 3, padding=1)
        self.second = nn.Conv1d(CHANNELS, CHANNELS, 3, padding=1)
        self.local, self.norm = ProbSparse(CHANNELS, 1), nn.LayerNorm(CHANNELS)
        self.encoder = nn.LSTM(CHANNELS, HIDDEN, batch_first=True, bidirectional=True)
        self.across = ProbSparse(2 * HIDDEN, 1)
        self.decoder, self.last = nn.Linear(4 * HIDDEN, UNITS), nn.Linear(UNITS, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Return the prediction (batch, 1) for windows (batch, 3, window)."""
        seen = torch.relu(self.second(torch.relu(self.first(shaped(x, 3, self.window))))).transpose(1, 2)
        seen = self.norm(seen + self.local(seen))
        encoded = shaped(self.encoder(shaped(seen, self.window, CHANNELS))[0], self.window, 2 * HIDDEN)
        newest = encoded[:, -1:]
        mattering = torch.cat([newest, self.across(newest, encoded)], dim=-1).flatten(1)
        result: Tensor = self.last(torch.relu(self.decoder(shaped(mattering, 4 * HIDDEN))))
        return result


@pieces.register
def _(layer: Dstn, name: str) -> Pieces:
    seen, newest, encoded, mattering = (f"{name}kept.{part}" for part in ("seen", "newest", "encoded", "mattering"))
    for part in ("first", "second"):
        yield from pieces(getattr(layer, part), f"{name}{part}.")
        yield Activation(function="relu"), {}
    yield Keep(kept=seen), {}
    yield from attention_steps(layer.local, f"{name}local.")
    yield Add(kept=seen), {}
    yield from pieces(layer.norm, f"{name}norm.")
    yield from pieces(layer.encoder, f"{name}encoder.")
    yield Keep(kept=encoded), {}
    yield Part(start=layer.window - 1, stop=layer.window, along="length"), {}
    yield Keep(kept=newest), {}
    yield from attention_steps(layer.across, f"{name}across.", encoded)
    yield Keep(kept=mattering), {}
    yield Recall(kept=newest), {}
    yield Join(kept=(mattering,)), {}
    yield from pieces(layer.decoder, f"{name}decoder.")
    yield Activation(function="relu"), {}
    yield from pieces(layer.last, f"{name}last.")


@pieces.register
def _(layer: nn.LSTM, name: str) -> Pieces:
    """Yield the steps of one layer in both directions, the forward one before the backward one in the channels."""
    if not layer.bidirectional or layer.num_layers != 1 or layer.proj_size:
        raise TextureDataError(f"{name}: one layer in both directions is expected, found {layer}.")
    given, after = f"{name}given", f"{name}after"
    yield Keep(kept=given), {}
    yield _one_way(layer, f"{name}backwards.", "l0_reverse")
    yield Keep(kept=after), {}
    yield Recall(kept=given), {}
    yield _one_way(layer, f"{name}forwards.", "l0")
    yield Join(kept=(after,)), {}


def _one_way(layer: nn.LSTM, name: str, way: str) -> tuple[Lstm, Mapping[str, Tensor]]:
    """Return the step of one direction; torch's two biases are added, since they belong to the same gates."""
    weight, state, ours, theirs = (getattr(layer, f"{weight_name}_{way}") for weight_name in WEIGHTS)
    named = {f"{name}weight": weight, f"{name}state": state, f"{name}bias": ours + theirs}
    weight_name, state_name, bias_name = named
    return Lstm(weight=weight_name, state=state_name, bias=bias_name, reverse=way.endswith("reverse")), named


def _fit(learning: Learning) -> FittedWindows:
    loss = loss_named(str(learning.settings.get("loss", LOSS)))
    return fit_windows(Dstn, learning, loss, for_length(SETTINGS, learning), window=WINDOW, optimiser=clipped(CLIP))


DSTN = Method(name="dstn", title="DSTN (CNN and BiLSTM)", fit=_fit, window=WINDOW, source="Joolee and Jeon 2021")
