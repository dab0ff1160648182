"""The export of texture networks as steps and float32 tensors for the rig's runtimes.

`pieces` knows the layers of FoTEN and of the Informer, and plain ones. A network with layers of its own registers them
in its own file: `@pieces.register`, then `def _(layer: Mine, name: str) -> Pieces`. A value is (channels, length),
where torch's encoders have (batch, length, channels).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import singledispatch
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from palpate.modeling.files.model_files import Exported
from palpate.modeling.textures.foten_network import (
    LEAST_LOG_SD,
    Dropout,
    Embedding,
    EncoderLayer,
    Foten,
    FourierBlock,
    SpectrumEncoder,
    Spread,
)
from palpate.modeling.textures.informer_layers import Attended, Distilled, Embedded, Forward, ProbSparse
from palpate.modeling.textures.matching import Matched
from palpate.modeling.textures.recording import Scale, TextureDataError
from palpate.modeling.textures.spectral_features import MelBlock, WaveletBlock
from palpate.modeling.training.steps import answers_of, exported_float32
from palpate.signals.models.card import Activation, Affine, Conv, Dense, MaxPool, Reshape, Step
from palpate.signals.models.card_steps import Add, Attention, Cartesian, Join, Keep, Norm, Part, Polar, Recall

Pieces = Iterator[tuple[Step, Mapping[str, Tensor]]]
"""Steps, each with the tensors that it names."""


def exported_windows(network: nn.Module, scale: Scale, window: int) -> Exported:
    """Export a network from a texture window (3 * window, in units) to the mean, or to mean and log SD (m/s^2).

    Raises TextureDataError for a layer that model cards have no step for, and for weights that are not finite.
    """
    exported_pieces = list(pieces(network, ""))
    tensors: dict[str, NDArray[np.float32]] = {}
    for _, named in exported_pieces:
        tensors |= {name: exported_float32(name, value, TextureDataError) for name, value in named.items()}
    down = Affine(gain="down.gain", offset="down.offset")
    tensors["down.gain"] = (1.0 / scale.sd[:, None]).astype(np.float32)
    tensors["down.offset"] = (-scale.mean / scale.sd)[:, None].astype(np.float32)
    answers = int(answers_of(network, np.zeros((1, 3, window)), 1).shape[1])
    # from normalised answers to units: an SD is scaled, so its log is shifted
    mean, sd = float(scale.mean[0]), float(scale.sd[0])
    up = Affine(gain=sd, offset=mean)
    if answers > 1:
        up = Affine(gain="up.gain", offset="up.offset")
        tensors["up.gain"] = np.array([sd, 1.0], np.float32)
        tensors["up.offset"] = np.array([mean, np.log(sd)], np.float32)
    steps = (Reshape(shape=(3, window)), down, *(step for step, _ in exported_pieces), up)
    return Exported(steps, tensors)


@singledispatch
def pieces(layer: nn.Module, name: str) -> Pieces:
    """Return the steps of a layer called `name` ("" or ending in a dot)."""
    raise TextureDataError(f"{name or 'network'}: model cards have no step for a layer of kind {type(layer).__name__}.")


def dense_per_place(layer: nn.Linear, name: str) -> Pieces:
    """Yield the dense layer of each place along the length: a convolution of width 1 over (channels, length)."""
    named = {f"{name}weight": layer.weight[..., None], f"{name}bias": layer.bias}
    yield Conv(weight=f"{name}weight", bias=f"{name}bias"), named


@pieces.register
def _(layer: nn.Sequential, name: str) -> Pieces:
    for place, inner in layer.named_children():
        yield from pieces(inner, f"{name}{place}.")


@pieces.register
def _(layer: nn.Linear, name: str) -> Pieces:
    yield Dense(weight=f"{name}weight", bias=f"{name}bias"), {f"{name}weight": layer.weight, f"{name}bias": layer.bias}


@pieces.register
def _(_layer: nn.ReLU, _name: str) -> Pieces:
    yield Activation(function="relu"), {}


@pieces.register(nn.Dropout)
@pieces.register(nn.Identity)
@pieces.register(Dropout)
def _(_layer: nn.Module, _name: str) -> Pieces:
    yield from ()


@pieces.register
def _(layer: nn.LayerNorm, name: str) -> Pieces:
    named = {f"{name}weight": layer.weight, f"{name}bias": layer.bias}
    yield Norm(weight=f"{name}weight", bias=f"{name}bias", tiny=layer.eps), named


@pieces.register
def _(layer: Embedding, name: str) -> Pieces:
    yield from dense_per_place(layer.dense, f"{name}dense.")
    if layer.place.numel():
        yield Affine(offset=f"{name}place"), {f"{name}place": layer.place.T}


@pieces.register
def _(layer: EncoderLayer, name: str) -> Pieces:
    before, between = f"{name}before", f"{name}between"
    yield Keep(kept=before), {}
    yield from pieces(layer.first, f"{name}first.")
    tensors = {"weight": layer.mix.weight, "bias": layer.mix.bias, "out": layer.out.weight, "out_bias": layer.out.bias}
    named = {key: f"{name}attention.{key}" for key in tensors}
    yield Attention(heads=layer.heads, **named), {named[key]: value for key, value in tensors.items()}
    yield Add(kept=before), {}
    yield from pieces(layer.after_attention, f"{name}after_attention.")
    yield Keep(kept=between), {}
    yield from dense_per_place(layer.wide, f"{name}wide.")
    yield Activation(function="relu"), {}
    yield from dense_per_place(layer.narrow, f"{name}narrow.")
    yield Add(kept=between), {}
    yield from pieces(layer.after_forward, f"{name}after_forward.")


@pieces.register
def _(layer: SpectrumEncoder, name: str) -> Pieces:
    yield from pieces(layer.embedding, f"{name}embedding.")
    yield from pieces(layer.encoder, f"{name}encoder.")
    yield from dense_per_place(layer.dense, f"{name}dense.")


@pieces.register
def _(layer: FourierBlock, name: str) -> Pieces:
    length = layer.matrix.shape[1]
    yield from fixed(layer.matrix, layer.offset, f"{name}transform.")
    yield Reshape(shape=(2, length)), {}
    yield Polar(), {}
    yield Keep(kept=f"{name}polar"), {}
    yield Part(start=1, stop=2), {}
    yield from pieces(layer.phase, f"{name}phase.")
    yield Keep(kept=f"{name}turned"), {}
    yield Recall(kept=f"{name}polar"), {}
    yield Part(start=0, stop=1), {}
    yield from pieces(layer.magnitude, f"{name}magnitude.")
    yield Join(kept=(f"{name}turned",)), {}
    yield Cartesian(), {}
    yield from fixed(layer.back, layer.back.new_zeros(length), f"{name}back.")
    yield Reshape(shape=(1, length)), {}


@pieces.register
def _(layer: MelBlock, name: str) -> Pieces:
    length = layer.spectrum.shape[1]
    yield from fixed(layer.spectrum, layer.spectrum.new_zeros(len(layer.spectrum)), f"{name}spectrum.")
    yield Activation(function="square"), {}
    yield from fixed(layer.bands, layer.floor.expand(len(layer.bands)), f"{name}bands.")
    yield Activation(function="log"), {}
    yield from fixed(layer.cosines, layer.cosines.new_zeros(len(layer.cosines)), f"{name}cosines.")
    yield Reshape(shape=(1, len(layer.cosines))), {}
    yield from pieces(layer.encoder, f"{name}encoder.")
    yield from pieces(layer.dense, f"{name}dense.")
    yield Reshape(shape=(1, length)), {}


@pieces.register
def _(layer: WaveletBlock, name: str) -> Pieces:
    coefficients, length = layer.matrix.shape
    yield from fixed(layer.matrix, layer.matrix.new_zeros(coefficients), f"{name}transform.")
    yield Reshape(shape=(1, coefficients)), {}
    yield from pieces(layer.encoder, f"{name}encoder.")
    yield from fixed(layer.back, layer.back.new_zeros(length), f"{name}back.")
    yield Reshape(shape=(1, length)), {}


def fixed(matrix: Tensor, offset: Tensor, name: str) -> Pieces:
    """Yield the product with a fixed matrix."""
    yield Dense(weight=f"{name}weight", bias=f"{name}bias"), {f"{name}weight": matrix, f"{name}bias": offset}


@pieces.register
def _(_layer: Spread, name: str) -> Pieces:
    yield Keep(kept=f"{name}both"), {}
    yield Part(start=1, stop=2), {}
    yield Activation(function="softplus"), {}
    yield Affine(offset=LEAST_LOG_SD), {}
    yield Keep(kept=f"{name}log_sd"), {}
    yield Recall(kept=f"{name}both"), {}
    yield Part(start=0, stop=1), {}
    yield Join(kept=(f"{name}log_sd",)), {}


@pieces.register
def _(layer: Foten, name: str) -> Pieces:
    window, past, block, hand = (f"{name}kept.{part}" for part in ("window", "past", "block", "hand"))
    yield Keep(kept=window), {}
    yield Part(start=1, stop=3), {}
    yield Keep(kept=hand), {}
    yield Recall(kept=window), {}
    yield Part(start=0, stop=1), {}
    if layer.spectral is not None:
        yield Keep(kept=past), {}
        yield from pieces(layer.spectral, f"{name}spectral.")
        yield Keep(kept=block), {}
        yield Recall(kept=past), {}
    yield from pieces(layer.embedding, f"{name}embedding.")
    yield from pieces(layer.encoder, f"{name}encoder.")
    yield Join(kept=(hand,) if layer.spectral is None else (block, hand)), {}
    yield from _head_steps(layer, f"{name}head.")


@pieces.register
def _(layer: Matched, name: str) -> Pieces:
    seen, answer = f"{name}seen", f"{name}answer"
    yield Keep(kept=seen), {}
    yield from pieces(layer.network, f"{name}network.")
    yield Keep(kept=answer), {}
    yield Recall(kept=seen), {}
    yield Part(start=0, stop=1), {}
    yield Reshape(shape=(len(layer.weight),)), {}
    yield from fixed(
        torch.stack([layer.weight, torch.zeros_like(layer.weight)]),
        torch.stack([torch.zeros_like(layer.log_gain), layer.log_gain]),
        f"{name}more.",
    )
    yield Add(kept=answer), {}


def _head_steps(layer: Foten, name: str) -> Pieces:
    """Yield the head: its first dense layer reads place by place in torch, channel by channel in a step."""
    for place, inner in layer.head.named_children():
        if place == "0" and isinstance(inner, nn.Linear):
            turned = inner.weight.view(len(inner.weight), layer.window, -1).transpose(1, 2).flatten(1)
            yield from fixed(turned, inner.bias, f"{name}0.")
        else:
            yield from pieces(inner, f"{name}{place}.")


def attention_steps(layer: ProbSparse, name: str, memory: str | None = None) -> Pieces:
    """Yield the step of an attention (width, length) to the same; `memory` names the stored keys and values."""
    tensors = {"weight": layer.mix.weight, "bias": layer.mix.bias, "out": layer.out.weight, "out_bias": layer.out.bias}
    named = {key: f"{name}{key}" for key in tensors}
    step = Attention(heads=layer.heads, memory=memory, causal=layer.causal, sparse=layer.asking, **named)
    yield step, {named[key]: value for key, value in tensors.items()}


def attention_block_steps(layer: Attended, name: str, memory: str | None = None) -> Pieces:
    """Yield the steps of an attention with its residual connection and its norm."""
    yield Keep(kept=f"{name}kept"), {}
    yield from attention_steps(layer.attention, f"{name}attention.", memory)
    yield Add(kept=f"{name}kept"), {}
    yield from pieces(layer.norm, f"{name}norm.")


@pieces.register
def _(layer: Attended, name: str) -> Pieces:
    yield from attention_block_steps(layer, name)


@pieces.register
def _(layer: Forward, name: str) -> Pieces:
    yield Keep(kept=f"{name}kept"), {}
    yield from dense_per_place(layer.wide, f"{name}wide.")
    yield Activation(function="gelu"), {}
    yield from dense_per_place(layer.narrow, f"{name}narrow.")
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
    """Yield the convolution, with the normalisation folded into its weights."""
    norm: Any = layer.norm
    gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
    bias = norm.bias - norm.running_mean * gain
    named = {f"{name}weight": layer.conv.weight * gain[:, None, None], f"{name}bias": bias}
    yield Conv(weight=f"{name}weight", bias=f"{name}bias", pad=1), named
    yield Activation(function="elu"), {}
    yield MaxPool(size=2), {}
