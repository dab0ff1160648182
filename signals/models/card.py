"""The card of a trained model: its inputs, its steps, its outputs, and its provenance.

A model is two files: NAME.json, this card, and NAME.safetensors, its numbers. Neither can execute code. Training and
running a model share nothing but the card.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import Field, ValidationError, model_validator

from palpate.protocols.strict import StrictFinite
from palpate.protocols.wording import count
from palpate.signals.models.card_steps import (
    Add,
    Attention,
    Autoregression,
    Cartesian,
    Join,
    Keep,
    Lstm,
    Norm,
    Part,
    Polar,
    Recall,
    Tensor,
    Turn,
)

FORMAT = "palpate-model/1"


class Port(StrictFinite):
    """An input or output: `size` numbers in `unit`, named where they have names.

    Ratings are on 0..100; `scale` holds what 0 and 100 are on the scale that people answered on. A model refuses an
    input with a number outside `within`. A texture window is (3, window) in C order: acceleration in m/s^2, speed in
    mm/s, force in N, oldest first; an acceleration is the next one, in m/s^2: its mean, and where there are two numbers
    the log of its SD. A texture drive is speed, force and the numbers that are drawn; a spectrum is (bins, frames).
    """

    kind: Literal["force_profile", "ratings", "texture_window", "acceleration", "texture_drive", "spectrum"]
    size: int = Field(ge=1)
    unit: str
    names: tuple[str, ...] = ()
    antonyms: tuple[str, ...] = ()
    scale: tuple[float, float] | None = None
    within: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _one_name_each(self) -> Self:
        if len(self.names) not in (0, self.size) or len(set(self.names)) != len(self.names):
            raise ValueError(f"{count(len(self.names), 'name')} for {self.size} numbers: none, or another one for each")
        if len(self.antonyms) not in (0, len(self.names)):
            raise ValueError(f"{len(self.antonyms)} antonyms for {len(self.names)} names: none, or one for each")
        if self.scale is not None and self.scale[0] == self.scale[1]:
            raise ValueError(f"both ends of the scale are {self.scale[0]:g}")
        if self.within is not None and not self.within[0] < self.within[1]:
            raise ValueError(f"nothing is within {self.within[0]:g} and {self.within[1]:g}")
        return self


class Affine(StrictFinite):
    """The step y = gain * x + offset, by element; each is a number or a tensor that broadcasts to x."""

    do: Literal["affine"] = "affine"
    gain: float | Tensor = 1.0
    offset: float | Tensor = 0.0


class DoorFeatures(StrictFinite):
    """The engineered features of a force profile in newtons, in this order (signals/doors/model_features.py)."""

    do: Literal["door_features"] = "door_features"
    names: tuple[str, ...]


class Dense(StrictFinite):
    """The step y = weight x + bias; weight (out, in), bias (out). The input is read in C order."""

    do: Literal["dense"] = "dense"
    weight: Tensor
    bias: Tensor


class Conv(StrictFinite):
    """A cross-correlation over (channels, length); weight (out, in, width), bias (out); `pad` zeros on either side."""

    do: Literal["conv"] = "conv"
    weight: Tensor
    bias: Tensor
    pad: int = Field(ge=0, default=0)


class Activation(StrictFinite):
    """An activation function by element; softmax is along the length of each channel, or over a list's numbers.

    gelu is x times the normal distribution function (erf), leaky relu has a slope of 0.2 below zero, log is the natural
    logarithm of x, at least 1e-10.
    """

    do: Literal["activation"] = "activation"
    function: Literal[
        "relu", "tanh", "sigmoid", "gelu", "elu", "leaky", "softplus", "exp", "log", "square", "abs", "softmax"
    ]


class Residual(StrictFinite):
    """The step relu(x + steps(x)) (thesis 5.2)."""

    do: Literal["residual"] = "residual"
    steps: tuple[Step, ...]


class MaxPool(StrictFinite):
    """The maximum of every `size` neighbours along the length; an incomplete group at the end is dropped."""

    do: Literal["max_pool"] = "max_pool"
    size: int = Field(ge=2)


class Upsample(StrictFinite):
    """The repetition of every element along the length, `times` times."""

    do: Literal["upsample"] = "upsample"
    times: int = Field(ge=2)


class Reshape(StrictFinite):
    """The same numbers in C order, in another shape: (size) or (channels, length)."""

    do: Literal["reshape"] = "reshape"
    shape: tuple[int, ...]


class Kernel(StrictFinite):
    """The step y = weights^T k(x), k_i = variance * exp(-|x - points_i|^2 / (2 length^2)).

    points (n, in), weights (n, out).
    """

    do: Literal["kernel"] = "kernel"
    points: Tensor
    weights: Tensor
    length: float = Field(gt=0)
    variance: float = Field(gt=0, default=1.0)


class Forest(StrictFinite):
    """The mean of regression trees: node i goes left where x[feature_i] <= threshold_i; a leaf has feature -1.

    x is first rounded to the thresholds' precision; a child comes after its parent.
    """

    do: Literal["forest"] = "forest"
    roots: Tensor
    feature: Tensor
    threshold: Tensor
    left: Tensor
    right: Tensor
    value: Tensor


class Nearest(StrictFinite):
    """The row of `values` whose row of `points` is nearest to x (Euclidean; the first of equals)."""

    do: Literal["nearest"] = "nearest"
    points: Tensor
    values: Tensor


class Mean(StrictFinite):
    """The mean of several models' answers to the same input."""

    do: Literal["mean"] = "mean"
    members: tuple[tuple[Step, ...], ...]


class Clip(StrictFinite):
    """The limits low and high, by element."""

    do: Literal["clip"] = "clip"
    low: float
    high: float


class Playable(StrictFinite):
    """The limits of force profiles in newtons; a part that is too steep follows at the steepest slope."""

    do: Literal["playable"] = "playable"
    force_N: float = Field(gt=0)
    slope_N_deg: float = Field(gt=0)


Step: TypeAlias = Annotated[
    Affine | DoorFeatures | Dense | Conv | Activation | Residual | MaxPool | Upsample | Reshape | Kernel | Forest
    | Nearest | Mean | Clip | Playable
    | Keep | Recall | Add | Join | Part | Turn | Norm | Attention | Lstm | Polar | Cartesian | Autoregression,
    Field(discriminator="do"),
]  # fmt: skip
for _nested in (Residual, Mean):
    _nested.model_rebuild()


class Weights(StrictFinite):
    """The file with the numbers, beside the card."""

    file: str
    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    bytes: int = Field(ge=0)


class Interval(StrictFinite):
    """The half width around each output that covers the share `coverage` of new answers, and how it was calibrated."""

    method: str
    coverage: float = Field(gt=0, lt=1)
    half_width: tuple[Annotated[float, Field(ge=0)], ...]


class Texture(StrictFinite):
    """The texture that a model continues, and its bounds: at `rate_hz`, from the last `window` samples.

    `speed_mm_s` and `force_N` are the least and greatest of the recording; `rms_m_s2` is its level, and nothing beyond
    `peak_m_s2` is played. `start` names the acceleration (window) that it begins with, made by the model itself at
    45 mm/s and 0.8 N (thesis 4.5.1). Where the model gives a spectrum, `hop` samples lie between its frames.
    """

    id: str
    label: str
    rate_hz: float = Field(gt=0, default=1000.0)
    window: int = Field(ge=1)
    speed_mm_s: tuple[float, float]
    force_N: tuple[float, float]
    rms_m_s2: float = Field(ge=0)
    peak_m_s2: float = Field(gt=0)
    start: Tensor | None = None
    hop: int | None = Field(ge=1, default=None)
    picture: str | None = None

    @model_validator(mode="after")
    def _least_first(self) -> Self:
        for name, (least, greatest) in (("speed_mm_s", self.speed_mm_s), ("force_N", self.force_N)):
            if least > greatest:
                raise ValueError(f"{name} goes from {least:g} to {greatest:g}; the least comes first")
        return self


class Card(StrictFinite):
    """The card of one model. `training` is its run card; `metrics` are those of its evaluation, by name.

    `measured_on` says for groups of metrics (`one step ahead`, `free`) on which data they were measured. `missed` holds
    a sentence for each aim of its training that the model missed: such a model is played only on request.
    """

    format: Literal["palpate-model/1"] = "palpate-model/1"
    name: str
    title: str
    method: str
    weights: Weights
    takes: Port
    gives: Port
    steps: tuple[Step, ...]
    interval: Interval | None = None
    texture: Texture | None = None
    metrics: Mapping[str, float] = Field(default_factory=dict)
    measured_on: Mapping[str, str] = Field(default_factory=dict)
    missed: tuple[str, ...] = ()
    training: Mapping[str, Any] = Field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _one_half_width_each(self) -> Self:
        if self.interval is not None and len(self.interval.half_width) != self.gives.size:
            raise ValueError(f"{len(self.interval.half_width)} half widths for {self.gives.size} numbers")
        return self


NO_TENSORS = frozenset({"do", "function", "kept", "memory", "along"})
"""Fields of steps whose values are words, not names of tensors."""


def tensors_named(steps: Sequence[Step]) -> Iterator[str]:
    """Yield the names of all tensors that these steps use, in order, including those of nested steps."""
    for step in steps:
        for name in type(step).model_fields:
            value = getattr(step, name)
            if isinstance(value, str) and name not in NO_TENSORS:
                yield value
            elif name == "steps":
                yield from tensors_named(value)
            elif name == "members":
                for member in value:
                    yield from tensors_named(member)


def card_tensors(card: Card) -> Iterator[str]:
    """Yield the names of all tensors that belong to a card: those of its steps, and the start of a texture."""
    yield from tensors_named(card.steps)
    if card.texture is not None and card.texture.start is not None:
        yield card.texture.start


def complaint(error: ValidationError) -> str:
    """Return the first few problems of a card, each with its place."""
    wrong = [f"{'.'.join(map(str, item['loc'])) or 'card'}: {item['msg']}" for item in error.errors()[:3]]
    more = f" (and {error.error_count() - len(wrong)} more)" if error.error_count() > len(wrong) else ""
    return "; ".join(wrong) + more
