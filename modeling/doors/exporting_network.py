"""A torch network as steps and float32 tensors: what the rig's own runtime needs to answer as the network does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray
from torch import Tensor, nn

from palpate.modeling.doors.data import ModelDataError
from palpate.modeling.doors.network_parts import Rescale
from palpate.modeling.doors.networks import ATTRIBUTES, LATENT, ForceToPerception, PerceptionToForce
from palpate.modeling.files.exported import Exported
from palpate.modeling.layers import ResidualBlock
from palpate.signals.doors.grid import POINTS
from palpate.signals.models.card import Activation, Affine, Conv, Dense, MaxPool, Reshape, Residual, Step, Upsample

Pieces = Iterator[tuple[Step, Mapping[str, Tensor]]]


def exported_network(network: nn.Module, *after: Step) -> Exported:
    """A network as it answers, not as it trains (dropout is left out), and these steps after it.

    Tensors are float32, named after the network's own layers. A flattening has no step: a dense step reads its input in
    C order, as torch does. Raises ModelDataError for a layer that model cards have no step for, and for weights that
    are not finite.
    """
    pieces = list(_pieces(network, ""))
    tensors = {name: _float32(name, value) for _, named in pieces for name, value in named.items()}
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


def _float32(name: str, value: Tensor) -> NDArray[np.float32]:
    array = np.array(value.detach().numpy(), dtype=np.float32, order="C")
    if not np.isfinite(array).all():
        raise ModelDataError(f"{name}: holds values that are not finite; this network cannot be used.")
    return array
