"""Cards of random steps with random numbers: every operation of the kernel, in every order that fits."""

from __future__ import annotations

import numpy as np

from palpate.signals.models.card import (
    Activation,
    Affine,
    Card,
    Clip,
    Conv,
    Dense,
    MaxPool,
    Mean,
    Port,
    Reshape,
    Residual,
    Upsample,
    Weights,
)
from palpate.signals.models.card_steps import (
    Add,
    Attention,
    Cartesian,
    Join,
    Keep,
    Lstm,
    Norm,
    Part,
    Polar,
    Recall,
    Turn,
)
from palpate.signals.models.runtime import Model

SMOOTH = ("tanh", "sigmoid", "gelu", "elu", "leaky", "softplus", "relu", "softmax", "abs")


class Draw:
    """Steps that fit one another; `shape` is what the last one gives."""

    def __init__(self, seed: int, shape: tuple[int, ...]) -> None:
        self.chance = np.random.Generator(np.random.PCG64(seed))
        self.tensors: dict[str, np.ndarray] = {}
        self.shape = shape
        self.saved: dict[str, tuple[int, ...]] = {}
        self.half = bool(self.chance.random() < 0.4)

    def size(self, most: int = 24) -> int:
        return int(self.chance.integers(1, most + 1))

    def put(self, *sides: int, about: float = 0.0) -> str:
        name = f"t{len(self.tensors)}"
        fan = max(int(np.prod(sides[1:])), 1)
        drawn = about + self.chance.standard_normal(sides) / fan**0.5
        self.tensors[name] = drawn.astype(np.float16 if self.half else np.float32).astype(np.float32)
        return name

    def steps(self, count: int) -> list[object]:
        steps: list[object] = []
        while len(steps) < count:
            kinds = [self.affine, self.activation, self.dense, self.keep, self.part, self.reshape, self.clip, self.mean]
            kinds += [self.recall] if self.saved else []
            if len(self.shape) == 2:
                kinds += [self.conv, self.attention, self.lstm, self.turn, self.norm, self.add, self.join, self.polar]
                kinds += [self.pool, self.upsample, self.residual, self.conv, self.attention]
            else:
                kinds += [self.to_sides, self.to_sides, self.norm, self.join, self.add]
            steps += kinds[self.chance.integers(len(kinds))]()
        return steps

    def affine(self):
        sides = [self.shape, (self.shape[0],) + (1,) * (len(self.shape) - 1), (self.shape[-1],)]
        fits = sides[self.chance.integers(3)]
        return [Affine(gain=self.put(*fits, about=1.0), offset=self.put(*fits) if self.chance.random() < 0.5 else 0.25)]

    def activation(self):
        return [Activation(function=SMOOTH[self.chance.integers(len(SMOOTH))])]

    def dense(self):
        count, before = self.size(40), int(np.prod(self.shape))
        self.shape = (count,)
        return [Dense(weight=self.put(count, before), bias=self.put(count))]

    def to_sides(self):
        channels, length = self.size(), self.size()
        step = Dense(weight=self.put(channels * length, *self.shape), bias=self.put(channels * length))
        self.shape = (channels, length)
        return [step, Reshape(shape=self.shape)]

    def reshape(self):
        total = int(np.prod(self.shape))
        channels = int(self.chance.choice([side for side in range(1, total + 1) if total % side == 0]))
        self.shape = (total,) if self.chance.random() < 0.3 else (channels, total // channels)
        return [Reshape(shape=self.shape)]

    def conv(self):
        channels, length = self.shape
        pad = int(self.chance.integers(0, 3))
        width = int(self.chance.integers(1, min(5, length + 2 * pad) + 1))
        filters = self.size()
        self.shape = (filters, length + 2 * pad - width + 1)
        return [Conv(weight=self.put(filters, channels, width), bias=self.put(filters), pad=pad)]

    def attention(self):
        width, _ = self.shape
        heads = int(self.chance.choice([side for side in range(1, width + 1) if width % side == 0]))
        memory, extra = None, {}
        others = [name for name, shape in self.saved.items() if len(shape) == 2 and shape[0] == width]
        if others and self.chance.random() < 0.6:
            memory = others[self.chance.integers(len(others))]
        if (memory is None or self.saved[memory] == self.shape) and self.chance.random() < 0.4:
            extra["causal"] = True
        names = {"weight": self.put(3 * width, width), "bias": self.put(3 * width)}
        names |= {"out": self.put(width, width), "out_bias": self.put(width)}
        return [Attention(heads=heads, memory=memory, **names, **extra)]

    def lstm(self):
        channels, length = self.shape
        hidden = self.size(20)
        self.shape = (hidden, length)
        step = Lstm(
            weight=self.put(4 * hidden, channels),
            state=self.put(4 * hidden, hidden),
            bias=self.put(4 * hidden),
            reverse=bool(self.chance.random() < 0.5),
        )
        return [step]

    def turn(self):
        self.shape = self.shape[::-1]
        return [Turn()]

    def norm(self):
        return [Norm(weight=self.put(self.shape[0], about=1.0), bias=self.put(self.shape[0]), tiny=1e-3)]

    def keep(self):
        name = f"k{len(self.saved)}"
        self.saved[name] = self.shape
        return [Keep(kept=name)]

    def recall(self):
        name = list(self.saved)[self.chance.integers(len(self.saved))]
        self.shape = self.saved[name]
        return [Recall(kept=name)]

    def add(self):
        others = [name for name, shape in self.saved.items() if shape == self.shape]
        if not others:
            return self.keep() + self.activation() + self.add()
        return [Add(kept=others[self.chance.integers(len(others))])]

    def join(self):
        others = [name for name, shape in self.saved.items() if shape[1:] == self.shape[1:]]
        if not others:
            return self.keep()
        self.shape = (self.shape[0] + self.saved[others[0]][0], *self.shape[1:])
        return [Join(kept=(others[0],))]

    def part(self):
        along = "length" if len(self.shape) == 2 and self.chance.random() < 0.5 else "channels"
        side = self.shape[1] if along == "length" else self.shape[0]
        start = int(self.chance.integers(0, side))
        stop = int(self.chance.integers(start + 1, side + 1))
        count = stop - start
        self.shape = (self.shape[0], count) if along == "length" else (count, *self.shape[1:])
        return [Part(start=start, stop=stop, along=along)]

    def clip(self):
        return [Clip(low=-1.5, high=1.0)]

    def pool(self):
        channels, length = self.shape
        if length < 2:
            return []
        size = int(self.chance.integers(2, min(length, 4) + 1))
        self.shape = (channels, length // size)
        return [MaxPool(size=size)]

    def upsample(self):
        channels, length = self.shape
        if length > 16:
            return []
        self.shape = (channels, length * 2)
        return [Upsample(times=2)]

    def residual(self):
        channels, _ = self.shape
        inner = [Conv(weight=self.put(channels, channels, 3), bias=self.put(channels), pad=1)]
        return [Residual(steps=(*inner, Activation(function="tanh")))]

    def polar(self):
        channels, length = self.shape
        step = Conv(weight=self.put(2, channels, 1), bias=self.put(2))
        keep = [] if self.chance.random() < 0.5 else [Affine(gain=0.5), Cartesian()]
        self.shape = (2, length)
        return [step, Polar(), *keep]

    def mean(self):
        count, total = self.size(), int(np.prod(self.shape))
        self.shape = (count,)
        members = [Dense(weight=self.put(count, total), bias=self.put(count)) for _ in range(2)]
        return [Mean(members=tuple((member, Activation(function="tanh")) for member in members))]


def card_of(steps, inputs: int, outputs: int) -> Card:
    """A card with such steps."""
    takes = Port(kind="texture_window", size=inputs, unit="-")
    gives = Port(kind="acceleration", size=outputs, unit="-")
    weights = Weights(file="random.safetensors", sha256="0" * 64, bytes=0)
    return Card(name="random", title="random", method="x", weights=weights, takes=takes, gives=gives, steps=steps)


def random_model(seed: int, count: int = 10) -> Model:
    """A model of about `count` random steps from (3, length) to a list."""
    length = int(np.random.Generator(np.random.PCG64(seed)).integers(1, 24))
    draw = Draw(seed, (3, length))
    steps = [Reshape(shape=(3, length)), *draw.affine(), *draw.steps(count)]
    if len(draw.shape) == 2:
        steps.append(Reshape(shape=(int(np.prod(draw.shape)),)))
    return Model(card_of(tuple(steps), 3 * length, int(np.prod(draw.shape))), draw.tensors)
