"""The GAN's generator as steps: from speed, force and noise to the log magnitudes of a block's frames."""

from __future__ import annotations

import numpy as np

from palpate.modeling.files.exported import Exported
from palpate.modeling.textures.exporting_foten import Pieces, pieces
from palpate.modeling.textures.exporting_informer import attended  # noqa: F401 - convolutions are registered there
from palpate.modeling.textures.gan_networks import BOUND, CHANNELS, NOISE, Generator
from palpate.modeling.textures.gan_scale import SpectraScale
from palpate.signals.models.card import Activation, Affine, Reshape, Step, Upsample
from palpate.signals.models.card_steps import Turn


def exported_generator(network: Generator, scale: SpectraScale) -> Exported:
    """Speed in mm/s, force in N and 64 normal numbers to (bins, frames) in C order, natural logs of m/s^2."""
    frames = network.frames
    found = list(pieces(network, ""))
    down = {"down.gain": 1 / scale.hand_sd, "down.offset": -scale.hand_mean / scale.hand_sd}
    more = {
        "down.gain": np.r_[down["down.gain"], np.ones(NOISE)],
        "down.offset": np.r_[down["down.offset"], np.zeros(NOISE)],
        "up.gain": scale.sd[:, None],
        "up.offset": scale.mean[:, None],
    }
    tensors = {name: value.detach().numpy() for _, named in found for name, value in named.items()} | more
    steps: tuple[Step, ...] = (
        Affine(gain="down.gain", offset="down.offset"), *(step for step, _ in found), Turn(),
        Affine(gain="up.gain", offset="up.offset"), Reshape(shape=(frames.bins * frames.count,)),
    )  # fmt: skip
    return Exported(steps, {name: np.array(value, dtype=np.float32, order="C") for name, value in tensors.items()})


@pieces.register
def _(layer: Generator, name: str) -> Pieces:
    for part in ("first", "second"):
        yield from pieces(getattr(layer, part), f"{name}{part}.")
        yield Activation(function="leaky"), {}
    yield Reshape(shape=(CHANNELS, layer.length)), {}
    yield Upsample(times=2), {}
    yield from pieces(layer.middle, f"{name}middle.")
    yield Activation(function="leaky"), {}
    yield Upsample(times=2), {}
    yield from pieces(layer.last, f"{name}last.")
    yield Affine(gain=1 / BOUND), {}
    yield Activation(function="tanh"), {}
    yield Affine(gain=BOUND), {}
