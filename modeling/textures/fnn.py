"""The frequency-decomposed neural network of Shin et al. 2015: a small network for each frequency band, and their sum.

From the paper: the acceleration is decomposed by frequency, each band has its own feed-forward network with its past,
speed and force as inputs, and the outputs are summed; one model covers all speeds and forces. Our choice, since neither
the thesis nor the abstract says: three bands separated at 100 and 250 Hz, filters of 15 taps whose sum is the signal
itself, 32 tanh units, training of the sum, Adam.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy.linalg import convolution_matrix
from scipy.signal import firwin
from torch import Tensor, nn

from palpate.modeling.textures.exporting import Pieces, fixed, pieces
from palpate.modeling.textures.fitting import FittedWindows, fit_windows, for_length, shaped
from palpate.modeling.textures.foten_network import loss_named
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.recording import RATE_HZ
from palpate.modeling.training.settings import Settings
from palpate.signals.arrays import Array
from palpate.signals.models.card import Activation, Reshape
from palpate.signals.models.card_steps import Add, Join, Keep, Part, Recall

WINDOW = 30
BORDERS_HZ = (100.0, 250.0)
TAPS = 15
UNITS = 32
LOSS = "mse"
SETTINGS = Settings(epochs=100, batch=64, learning_rate=2e-3, plateau_patience=4, stop_patience=10, every_epochs=5)


def bands(window: int) -> Array:
    """Return the matrix (3 window, window) from a window to its bands, one below the other; their sum is the window.

    The filters are linear-phase (Hamming) and centred, so that a band has no delay; the window is padded with zeros.
    """
    kernels = [firwin(TAPS, border, fs=RATE_HZ) for border in BORDERS_HZ]
    low = [convolution_matrix(taps, window)[TAPS // 2 : TAPS // 2 + window] for taps in kernels]
    whole = np.eye(window)
    return np.concatenate([low[0], low[1] - low[0], whole - low[1]])


class Fnn(nn.Module):
    """The network, from normalised windows (batch, 3, window) to (batch, 1).

    The acceleration (window) is split into bands (3, window); each band with the newest speed and force (window + 2)
    goes through two layers of 32 and one of 1; the answer is the sum.
    """

    split: Tensor

    def __init__(self, window: int = WINDOW) -> None:
        super().__init__()
        self.window, self.count = window, len(BORDERS_HZ) + 1
        self.register_buffer("split", torch.from_numpy(bands(window)).float())
        self.bands = nn.ModuleList(
            nn.Sequential(
                nn.Linear(window + 2, UNITS), nn.Tanh(), nn.Linear(UNITS, UNITS), nn.Tanh(), nn.Linear(UNITS, 1)
            )
            for _ in range(self.count)
        )

    def forward(self, x: Tensor) -> Tensor:
        """Return the sum of the bands' networks (batch, 1) for windows (batch, 3, window)."""
        hand = shaped(x, 3, self.window)[:, 1:, -1]
        parts = shaped(x[:, 0] @ self.split.T, self.count * self.window).chunk(self.count, dim=1)
        answers = [band(torch.cat([part, hand], dim=1)) for band, part in zip(self.bands, parts, strict=True)]
        return shaped(torch.stack(answers).sum(dim=0), 1)


@pieces.register
def _(layer: Fnn, name: str) -> Pieces:
    window, signals, hand, parts = layer.window, f"{name}kept.signals", f"{name}kept.hand", f"{name}kept.parts"
    yield Keep(kept=signals), {}
    yield Part(start=1, stop=3), {}
    yield Part(start=window - 1, stop=window, along="length"), {}
    yield Reshape(shape=(2,)), {}
    yield Keep(kept=hand), {}
    yield Recall(kept=signals), {}
    yield Part(start=0, stop=1), {}
    yield from fixed(layer.split, layer.split.new_zeros(len(layer.split)), f"{name}split.")
    yield Keep(kept=parts), {}
    for number, band in enumerate(layer.bands):
        yield Recall(kept=parts), {}
        yield Part(start=number * window, stop=(number + 1) * window), {}
        yield Join(kept=(hand,)), {}
        yield from pieces(band, f"{name}bands.{number}.")
        if number:
            yield Add(kept=f"{name}kept.{number - 1}"), {}
        yield Keep(kept=f"{name}kept.{number}"), {}


@pieces.register
def _(_layer: nn.Tanh, _name: str) -> Pieces:
    yield Activation(function="tanh"), {}


def _fit(learning: Learning) -> FittedWindows:
    loss = loss_named(str(learning.settings.get("loss", LOSS)))
    return fit_windows(Fnn, learning, loss, for_length(SETTINGS, learning), window=WINDOW)


FNN = Method(name="fnn", title="Frequency-decomposed network (FNN)", fit=_fit, window=WINDOW, source="Shin et al. 2015")
