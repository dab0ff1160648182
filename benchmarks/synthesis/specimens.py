"""A model of FoTEN's shape (thesis 4.4) with random weights from a seed, for measuring and testing runtimes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.signals.models.card import Activation, Affine, Card, Conv, Dense, Port, Reshape, Step, Weights
from palpate.signals.models.card_steps import Add, Attention, Cartesian, Join, Keep, Norm, Part, Polar, Recall
from palpate.signals.models.runtime import Model

WINDOW, WIDTH, HEADS, HIDDEN, SPECTRAL = 20, 64, 4, 128, 16
UNITS = (256, 64)
TYPICAL, SPREAD = np.array([0.0, 100.0, 1.0]), np.array([4.0, 40.0, 0.4])
"""Mean and SD of the model's inputs: acceleration in m/s^2, speed in mm/s, force in N."""
Numbers = NDArray[np.float32]


@dataclass
class _Maker:
    """A generator of random tensors with names."""

    chance: np.random.Generator
    tensors: dict[str, Numbers] = field(default_factory=dict)

    def put(self, name: str, numbers: NDArray[np.float64]) -> str:
        self.tensors[name] = numbers.astype(np.float32)
        return name

    def draw(self, name: str, *shape: int) -> str:
        """Draw weights as torch does, uniformly within 1 / sqrt(number of inputs); return their name."""
        limit = int(np.prod(shape[1:])) ** -0.5 if len(shape) > 1 else 0.1
        return self.put(name, self.chance.uniform(-limit, limit, shape))


def foten(seed: int = 1, window: int = WINDOW) -> Model:
    """Return a model of 471 235 numbers at a window of 20, which predicts one acceleration."""
    maker = _Maker(np.random.Generator(np.random.PCG64(seed)))
    scale = [maker.put("gain", 1 / SPREAD[:, None]), maker.put("offset", (-TYPICAL / SPREAD)[:, None])]
    steps: list[Step] = [Reshape(shape=(3, window)), Affine(gain=scale[0], offset=scale[1]), Keep(kept="given")]
    steps += [Part(start=1, stop=3), Keep(kept="hand"), Recall(kept="given"), Part(start=0, stop=1), Keep(kept="past")]
    steps += [*_embedding(maker, "main", WIDTH), Affine(offset=maker.put("positions", positions(window)))]
    for layer in range(3):
        steps += _encoder(maker, f"layer{layer}", WIDTH)
    steps += [Keep(kept="encoded"), Recall(kept="past"), *_fourier(maker, window), Keep(kept="spectral")]
    steps += [Recall(kept="encoded"), Join(kept=("spectral", "hand")), Reshape(shape=((WIDTH + 3) * window,))]
    sizes = ((WIDTH + 3) * window, *UNITS)
    for place in range(2):
        steps += [_dense(maker, f"head{place}", sizes[place], sizes[place + 1]), Activation(function="relu")]
    steps += [_dense(maker, "head2", UNITS[-1], 1), Affine(gain=float(SPREAD[0]), offset=float(TYPICAL[0]))]
    return Model(_card(tuple(steps), window), maker.tensors)


def windows(count: int, seed: int = 2, window: int = WINDOW) -> NDArray[np.float64]:
    """Return possible inputs of such a model, (count, 3 window)."""
    chance = np.random.Generator(np.random.PCG64(seed))
    values = chance.standard_normal((count, 3, window)) * SPREAD[:, None] + TYPICAL[:, None]
    return np.asarray(values.reshape(count, -1))


def positions(window: int) -> NDArray[np.float64]:
    """Return the positional encoding of equations 4.2 and 4.3: (width, window)."""
    turns = np.arange(window) / 10000.0 ** (np.arange(0, WIDTH, 2)[:, None] / WIDTH)
    return np.stack([np.sin(turns), np.cos(turns)], axis=1).reshape(WIDTH, window)


def _card(steps: tuple[Step, ...], window: int) -> Card:
    takes = Port(kind="texture_window", size=3 * window, unit="m/s^2, mm/s, N")
    gives = Port(kind="acceleration", size=1, unit="m/s^2")
    weights = Weights(file="specimen.safetensors", sha256="0" * 64, bytes=0)
    return Card(name="specimen", title="FoTEN's shape, random weights", method="foten", weights=weights,
                takes=takes, gives=gives, steps=steps)  # fmt: skip


def _dense(maker: _Maker, name: str, inputs: int, outputs: int) -> Dense:
    return Dense(weight=maker.draw(f"{name}.weight", outputs, inputs), bias=maker.draw(f"{name}.bias", outputs))


def _conv(maker: _Maker, name: str, inputs: int, outputs: int) -> Conv:
    """Return a convolution of width 1: a dense layer at every place."""
    return Conv(weight=maker.draw(f"{name}.weight", outputs, inputs, 1), bias=maker.draw(f"{name}.bias", outputs))


def _embedding(maker: _Maker, name: str, width: int) -> list[Step]:
    return [_conv(maker, f"{name}.embedding", 1, width)]


def _encoder(maker: _Maker, name: str, width: int) -> list[Step]:
    draw = maker.draw
    attention = Attention(
        heads=HEADS, weight=draw(f"{name}.mix", 3 * width, width), bias=draw(f"{name}.mix.bias", 3 * width),
        out=draw(f"{name}.out", width, width), out_bias=draw(f"{name}.out.bias", width),
    )  # fmt: skip
    forward: list[Step] = [_conv(maker, f"{name}.wide", width, HIDDEN), Activation(function="relu"),
               _conv(maker, f"{name}.narrow", HIDDEN, width)]  # fmt: skip
    return [
        Keep(kept=f"{name}.in"), attention, Add(kept=f"{name}.in"), _norm(maker, f"{name}.first", width),
        Keep(kept=f"{name}.between"), *forward, Add(kept=f"{name}.between"), _norm(maker, f"{name}.second", width),
    ]  # fmt: skip


def _norm(maker: _Maker, name: str, width: int) -> Norm:
    chance = maker.chance.uniform(0.8, 1.2, width)
    return Norm(weight=maker.put(f"{name}.weight", chance), bias=maker.draw(f"{name}.bias", width))


def _fourier(maker: _Maker, window: int) -> list[Step]:
    there, back = transforms(window)
    offset = maker.put("spectrum.offset", np.where(np.arange(2 * window) % (window // 2) == 0, 1e-30, 0.0))
    steps: list[Step] = [Reshape(shape=(window,)), Dense(weight=maker.put("spectrum", there), bias=offset)]
    steps += [Reshape(shape=(2, window)), Polar(), Keep(kept="polar")]
    for place, name in enumerate(("magnitude", "phase")):
        steps += [Recall(kept="polar"), Part(start=place, stop=place + 1), *_embedding(maker, name, SPECTRAL)]
        steps += [*_encoder(maker, name, SPECTRAL), _conv(maker, f"{name}.answer", SPECTRAL, 1), Keep(kept=name)]
    steps += [Recall(kept="magnitude"), Join(kept=("phase",)), Cartesian(), Reshape(shape=(2 * window,))]
    zeros = maker.put("spectrum.zeros", np.zeros(window))
    return [*steps, Dense(weight=maker.put("spectrum.back", back), bias=zeros), Reshape(shape=(1, window))]


def transforms(window: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return equations 4.6 and 4.8 as matrices: (2 window, window), and the real inverse (window, 2 window)."""
    bins = np.minimum(np.arange(window), window - np.arange(window))
    turns = 2 * np.pi * np.outer(bins, np.arange(window)) / window
    sign = np.where(np.arange(window) > window // 2, -1.0, 1.0)[:, None]
    imaginary = -np.sin(turns) * sign * (bins % (window / 2) != 0)[:, None]
    there = np.concatenate([np.cos(turns), imaginary])
    back = 2 * np.pi * np.outer(np.arange(window), np.arange(window)) / window
    return there, np.concatenate([np.cos(back), -np.sin(back)], axis=1) / window


def count_parameters(model: Model) -> int:
    """Return the number of learned parameters: all but those of scaling, positions and transforms."""
    fixed = ("gain", "offset", "positions", "spectrum")
    learned: Mapping[str, NDArray[np.generic]] = {
        name: numbers for name, numbers in model.tensors.items() if not name.startswith(fixed)
    }
    return sum(numbers.size for numbers in learned.values())
