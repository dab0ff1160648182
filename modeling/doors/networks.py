"""The two networks of thesis 5.4 and 5.6 with their published shapes, their training rows, and their export.

An exported network is a list of steps with float32 tensors for the rig's runtime.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import singledispatch
from typing import Self

import numpy as np
import torch
from torch import Tensor, nn

from palpate.modeling.doors.methods import Learning
from palpate.modeling.doors.preparing import TrainingRows, rows_of
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.files.model_files import Exported
from palpate.modeling.regression import CONSTANT
from palpate.modeling.training.steps import answers_of, exported_float32
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS
from palpate.signals.models.card import Activation, Affine, Conv, Dense, MaxPool, Reshape, Residual, Step, Upsample

ATTRIBUTES = 7
LATENT = (128, 155)
"""Channels and length of the encoder's output (thesis 5.4.1.1: 155 x 128)."""
RESTORED = (64, 620)
HIDDEN = 128
DROPOUT = 0.1
AT_ONCE = 64
"""Rows per batch, as a compromise between speed and memory."""
QUICK_EPOCHS = 4
Pieces = Iterator[tuple[Step, Mapping[str, Tensor]]]


class ResidualBlock(nn.Module):
    """A residual block: relu(x + conv(relu(conv(x)))), both of width 3 with padding (thesis equation 5.2)."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.first = nn.Conv1d(channels, channels, 3, padding=1)
        self.second = nn.Conv1d(channels, channels, 3, padding=1)

    def forward(self, x: Tensor) -> Tensor:
        """Return the output for (batch, channels, length), in the same shape."""
        inner: Tensor = self.second(torch.relu(self.first(x)))
        return torch.relu(x + inner)


def conv_relu(inputs: int, outputs: int, width: int = 3, pad: int = 1) -> nn.Sequential:
    """Return a convolution and a ReLU (thesis equation 5.1)."""
    return nn.Sequential(nn.Conv1d(inputs, outputs, width, padding=pad), nn.ReLU())


def encoder() -> nn.Sequential:
    """Return the encoder, from (batch, 1, 621) to (batch, 128, 155).

    It has 64, then 128 filters, each with a residual block and a halving.
    """
    return nn.Sequential(
        *conv_relu(1, 64), ResidualBlock(64), nn.MaxPool1d(2),
        *conv_relu(64, 128), ResidualBlock(128), nn.MaxPool1d(2),
    )  # fmt: skip


def decoder() -> nn.Sequential:
    """Return the decoder, from (batch, 128, 155) to (batch, 64, 620).

    It has 128, then 64 filters, each with a residual block and a doubling.
    """
    return nn.Sequential(
        *conv_relu(128, 128), ResidualBlock(128), nn.Upsample(scale_factor=2),
        *conv_relu(128, 64), ResidualBlock(64), nn.Upsample(scale_factor=2),
    )  # fmt: skip


class ForceToPerception(nn.Module):
    """The network of thesis 5.4: encoder, decoder, a dense layer of 128 with dropout, and one value per attribute."""

    def __init__(self, attributes: int = ATTRIBUTES) -> None:
        super().__init__()
        self.encoder = encoder()
        self.decoder = decoder()
        restored = RESTORED[0] * RESTORED[1]
        self.head = nn.Sequential(
            nn.Flatten(), nn.Linear(restored, HIDDEN), nn.ReLU(), nn.Dropout(DROPOUT), nn.Linear(HIDDEN, attributes)
        )

    def forward(self, force: Tensor) -> Tensor:
        """Return scaled ratings (batch, attributes) of scaled forces (batch, 621)."""
        ratings: Tensor = self.head(self.decoder(self.encoder(force.unsqueeze(1))))
        return ratings


class PerceptionToForce(nn.Module):
    """The network of thesis 5.6: four convolutions over the ratings, a dense layer, a frozen decoder, 621 values.

    The decoder's weights are those of a trained `ForceToPerception` and are not trained further.
    """

    def __init__(self, trained: nn.Sequential | None = None, attributes: int = ATTRIBUTES) -> None:
        super().__init__()
        self.encoder = nn.Sequential(
            nn.Conv1d(1, 64, 2), nn.ReLU(), nn.MaxPool1d(2),
            *conv_relu(64, 128), *conv_relu(128, 256), *conv_relu(256, 512), nn.Flatten(),
        )  # fmt: skip
        self.project = nn.Linear(512 * ((attributes - 1) // 2), LATENT[0] * LATENT[1])
        self.decoder = decoder()
        if trained is not None:
            self.decoder.load_state_dict(trained.state_dict())
        self.decoder.requires_grad_(False)
        self.out = nn.Sequential(nn.Flatten(), nn.Linear(RESTORED[0] * RESTORED[1], POINTS))

    def forward(self, ratings: Tensor) -> Tensor:
        """Return scaled forces (batch, 621) of scaled ratings (batch, attributes)."""
        latent = self.project(self.encoder(ratings.unsqueeze(1))).view(-1, *LATENT)
        force: Tensor = self.out(self.decoder(latent))
        return force


class Rescale(nn.Module):
    """A fixed elementwise scaling y = gain * x + offset."""

    gain: Tensor
    offset: Tensor

    def __init__(self, gain: Array | float, offset: Array | float) -> None:
        super().__init__()
        self.register_buffer("gain", torch.as_tensor(np.asarray(gain, dtype=np.float32)))
        self.register_buffer("offset", torch.as_tensor(np.asarray(offset, dtype=np.float32)))

    def forward(self, x: Tensor) -> Tensor:
        """Return scaled rows of (batch, size)."""
        return self.gain * x + self.offset

    @classmethod
    def up(cls, rows: Array) -> Self:
        """Return the scaling from centred values to rows (n, size): their mean row, and one SD for all places.

        One SD for all places preserves a profile's shape: a place that hardly differs between doors is not magnified.
        Where all rows are equal it is 1.
        """
        return cls(*reversed(_centre_and_spread(rows)))

    @classmethod
    def down(cls, rows: Array) -> Self:
        """Return the scaling from rows (n, size) to centred values, the inverse of `up`."""
        centre, spread = _centre_and_spread(rows)
        return cls(1.0 / spread, -centre / spread)


def _centre_and_spread(rows: Array) -> tuple[Array, float]:
    centre: Array = rows.mean(axis=0)
    spread = float(np.sqrt(np.mean((rows - centre) ** 2)))
    return centre, spread if spread > CONSTANT * float(np.abs(rows).max()) else 1.0


def training_rows(learning: Learning) -> tuple[TrainingRows, TrainingRows | None]:
    """Return the rows to train on, and those to watch, or None where none are held out.

    The rows are the stimuli with their training variants, or with the setting `quick` the stimuli alone. The setting
    `learn_from` overrides both. Raises ModelDataError as `rows_of` does, and for fewer than two rows.
    """
    rows = rows_of(learning, "measured" if learning.settings.get("quick") else "train", least=2)
    if not len(learning.held):
        return rows, None
    settings = {name: value for name, value in learning.settings.items() if name != "learn_from"}
    return rows, rows_of(replace(learning, measured=learning.held, settings=settings), "measured")


def answers(network: nn.Module, given: Array) -> Array:
    """Return a network's outputs (n, out) for rows (n, in) as float64, without dropout, on one thread.

    Raises ModelDataError where an output is not finite, as for values that 32 bits cannot hold.
    """
    result = answers_of(network, given, AT_ONCE)
    if not np.isfinite(result).all():
        raise ModelDataError("the network's answer is not finite: what it was given is far beyond what it has learned.")
    return result


def exported_network(network: nn.Module, *after: Step) -> Exported:
    """Return a network in evaluation mode (without dropout) as steps and tensors, followed by the steps `after`.

    Tensors are float32, named after the network's own layers. A flattening has no step: a dense step reads its input in
    C order, as torch does. Raises ModelDataError for a layer that model cards have no step for, and for weights that
    are not finite.
    """
    pieces = list(_pieces(network, ""))
    tensors = {
        name: exported_float32(name, value, ModelDataError) for _, named in pieces for name, value in named.items()
    }
    return Exported((*(step for step, _ in pieces), *after), tensors)


@singledispatch
def _pieces(layer: nn.Module, name: str) -> Pieces:
    raise ModelDataError(f"{name or 'network'}: model cards have no step for a layer of kind {type(layer).__name__}.")


@_pieces.register
def _(layer: nn.Sequential, name: str) -> Pieces:
    for place, inner in layer.named_children():
        yield from _pieces(inner, f"{name}{place}.")


@_pieces.register
def _(layer: ForceToPerception, name: str) -> Pieces:
    yield Reshape(shape=(1, POINTS)), {}
    for part in ("encoder", "decoder", "head"):
        yield from _pieces(getattr(layer, part), f"{name}{part}.")


@_pieces.register
def _(layer: PerceptionToForce, name: str) -> Pieces:
    yield Reshape(shape=(1, ATTRIBUTES)), {}
    yield from _pieces(layer.encoder, f"{name}encoder.")
    yield from _pieces(layer.project, f"{name}project.")
    yield Reshape(shape=LATENT), {}
    yield from _pieces(layer.decoder, f"{name}decoder.")
    yield from _pieces(layer.out, f"{name}out.")


@_pieces.register
def _(layer: Rescale, name: str) -> Pieces:
    used = {key: value for key, value in _named(name, gain=layer.gain, offset=layer.offset).items() if value.ndim}
    gain, offset = (
        f"{name}{key}" if value.ndim else float(value)
        for key, value in (("gain", layer.gain), ("offset", layer.offset))
    )
    yield Affine(gain=gain, offset=offset), used


@_pieces.register
def _(layer: nn.Conv1d, name: str) -> Pieces:
    plain = layer.stride == layer.dilation == (1,) and layer.groups == 1 and layer.padding_mode == "zeros"
    if not plain or layer.bias is None or isinstance(layer.padding, str):
        raise ModelDataError(f"{name}: model cards know plain convolutions with a bias only, found {layer}.")
    named = _named(name, weight=layer.weight, bias=layer.bias)
    yield Conv(weight=f"{name}weight", bias=f"{name}bias", pad=layer.padding[0]), named


@_pieces.register
def _(layer: nn.Linear, name: str) -> Pieces:
    if layer.bias is None:
        raise ModelDataError(f"{name}: model cards know dense layers with a bias only, found {layer}.")
    named = _named(name, weight=layer.weight, bias=layer.bias)
    yield Dense(weight=f"{name}weight", bias=f"{name}bias"), named


@_pieces.register
def _(_layer: nn.ReLU, _name: str) -> Pieces:
    yield Activation(function="relu"), {}


@_pieces.register
def _(layer: nn.MaxPool1d, name: str) -> Pieces:
    if layer.kernel_size != layer.stride or layer.padding or layer.dilation != 1 or layer.ceil_mode:
        raise ModelDataError(f"{name}: model cards know pooling without overlap or padding only, found {layer}.")
    yield MaxPool(size=_whole(layer.kernel_size, name)), {}


@_pieces.register
def _(layer: nn.Upsample, name: str) -> Pieces:
    if layer.mode != "nearest":
        raise ModelDataError(f"{name}: model cards know upsampling by repetition only, found {layer}.")
    yield Upsample(times=_whole(layer.scale_factor, name)), {}


@_pieces.register
def _(layer: ResidualBlock, name: str) -> Pieces:
    inner = [
        *_pieces(layer.first, f"{name}first."),
        (Activation(function="relu"), {}),
        *_pieces(layer.second, f"{name}second."),
    ]
    named = {key: value for _, own in inner for key, value in own.items()}
    yield Residual(steps=tuple(step for step, _ in inner)), named


@_pieces.register(nn.Flatten)
@_pieces.register(nn.Dropout)
def _(_layer: nn.Module, _name: str) -> Pieces:
    yield from ()


def _named(name: str, **values: Tensor) -> dict[str, Tensor]:
    return {f"{name}{key}": value for key, value in values.items()}


def _whole(value: object, name: str) -> int:
    if not isinstance(value, int | float) or value != int(value):
        raise ModelDataError(f"{name}: model cards know whole numbers of neighbours only, found {value}.")
    return int(value)
