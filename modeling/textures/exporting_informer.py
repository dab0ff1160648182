"""The Informer's layers as steps (see modeling/textures/exporting_foten.py)."""

from __future__ import annotations

from typing import Any

import torch
from torch import nn

from palpate.modeling.textures.exporting_foten import Pieces, each_place, pieces
from palpate.modeling.textures.informer_layers import Attended, Distilled, Embedded, Forward, ProbSparse
from palpate.modeling.textures.recording import TextureDataError
from palpate.signals.models.card import Activation, Affine, Conv, MaxPool
from palpate.signals.models.card_steps import Add, Attention, Keep


def attending(layer: ProbSparse, name: str, memory: str | None = None) -> Pieces:
    """(width, length) to the same; `memory` is the name that keys and values are kept under."""
    tensors = {"weight": layer.mix.weight, "bias": layer.mix.bias, "out": layer.out.weight, "out_bias": layer.out.bias}
    named = {key: f"{name}{key}" for key in tensors}
    step = Attention(heads=layer.heads, memory=memory, causal=layer.causal, sparse=layer.asking, **named)
    yield step, {named[key]: value for key, value in tensors.items()}


def attended(layer: Attended, name: str, memory: str | None = None) -> Pieces:
    """Attention with its way around and its norm."""
    yield Keep(kept=f"{name}kept"), {}
    yield from attending(layer.attention, f"{name}attention.", memory)
    yield Add(kept=f"{name}kept"), {}
    yield from pieces(layer.norm, f"{name}norm.")


@pieces.register
def _(layer: Attended, name: str) -> Pieces:
    yield from attended(layer, name)


@pieces.register
def _(layer: Forward, name: str) -> Pieces:
    yield Keep(kept=f"{name}kept"), {}
    yield from each_place(layer.wide, f"{name}wide.")
    yield Activation(function="gelu"), {}
    yield from each_place(layer.narrow, f"{name}narrow.")
    yield Add(kept=f"{name}kept"), {}
    yield from pieces(layer.norm, f"{name}norm.")


@pieces.register
def _(layer: nn.Conv1d, name: str) -> Pieces:
    plain = layer.stride == layer.dilation == (1,) and layer.groups == 1 and layer.padding_mode == "zeros"
    if not plain or layer.bias is None or isinstance(layer.padding, str):
        raise TextureDataError(f"{name}: model cards know plain convolutions with a bias only, found {layer}.")
    named = {f"{name}weight": layer.weight, f"{name}bias": layer.bias}
    yield Conv(weight=f"{name}weight", bias=f"{name}bias", pad=layer.padding[0]), named


@pieces.register
def _(layer: Embedded, name: str) -> Pieces:
    yield from pieces(layer.conv, f"{name}conv.")
    yield Affine(offset=f"{name}place"), {f"{name}place": layer.place.T}


@pieces.register
def _(layer: Distilled, name: str) -> Pieces:
    """The normalisation is in the convolution's weights."""
    norm: Any = layer.norm
    gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
    bias = norm.bias - norm.running_mean * gain
    named = {f"{name}weight": layer.conv.weight * gain[:, None, None], f"{name}bias": bias}
    yield Conv(weight=f"{name}weight", bias=f"{name}bias", pad=1), named
    yield Activation(function="elu"), {}
    yield MaxPool(size=2), {}
