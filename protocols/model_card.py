"""The card of a trained model: what goes in, what is done step by step, what comes out, and where it comes from.

A model is two files: NAME.json, this card, and NAME.safetensors, its numbers. Neither can execute code. The card is
all that the side that trains and the side that runs a model have in common.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

FORMAT = "palpate-model/1"
Tensor = Annotated[str, Field(min_length=1)]
"""The name of an array in the weights file."""


class Strict(BaseModel):
    """Unknown keys are refused, and so are numbers that are none."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Port(Strict):
    """What goes in or comes out: `size` numbers in `unit`, named where they have names.

    Ratings are on 0..100; `scale` holds what 0 and 100 are on the scale that people answered on. A model refuses an
    input with a number outside `within`.
    """

    kind: Literal["force_profile", "ratings"]
    size: int = Field(ge=1)
    unit: str
    names: tuple[str, ...] = ()
    antonyms: tuple[str, ...] = ()
    scale: tuple[float, float] | None = None
    within: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _one_name_each(self) -> Self:
        if len(self.names) not in (0, self.size) or len(set(self.names)) != len(self.names):
            raise ValueError(f"{len(self.names)} names for {self.size} numbers: none, or another one for each")
        if len(self.antonyms) not in (0, len(self.names)):
            raise ValueError(f"{len(self.antonyms)} antonyms for {len(self.names)} names: none, or one for each")
        if self.scale is not None and self.scale[0] == self.scale[1]:
            raise ValueError(f"both ends of the scale are {self.scale[0]:g}")
        if self.within is not None and not self.within[0] < self.within[1]:
            raise ValueError(f"nothing lies within {self.within[0]:g} and {self.within[1]:g}")
        return self


class Affine(Strict):
    """y = gain * x + offset, by element; each a number or a tensor that fits x."""

    do: Literal["affine"] = "affine"
    gain: float | Tensor = 1.0
    offset: float | Tensor = 0.0


class DoorFeatures(Strict):
    """The engineered features of a force profile in newtons, in this order (devices/door/model_features.py)."""

    do: Literal["door_features"] = "door_features"
    names: tuple[str, ...]


class Dense(Strict):
    """y = weight x + bias; weight (out, in), bias (out). The input is read in C order."""

    do: Literal["dense"] = "dense"
    weight: Tensor
    bias: Tensor


class Conv(Strict):
    """Cross-correlation over (channels, length); weight (out, in, width), bias (out); `pad` zeros on either side."""

    do: Literal["conv"] = "conv"
    weight: Tensor
    bias: Tensor
    pad: int = Field(ge=0, default=0)


class Activation(Strict):
    """relu or tanh, by element."""

    do: Literal["activation"] = "activation"
    function: Literal["relu", "tanh"]


class Residual(Strict):
    """relu(x + steps(x)) (thesis 5.2)."""

    do: Literal["residual"] = "residual"
    steps: tuple[Step, ...]


class MaxPool(Strict):
    """The greatest of every `size` neighbours along the length; what is left over at the end is dropped."""

    do: Literal["max_pool"] = "max_pool"
    size: int = Field(ge=2)


class Upsample(Strict):
    """Every element along the length, `times` times."""

    do: Literal["upsample"] = "upsample"
    times: int = Field(ge=2)


class Reshape(Strict):
    """The same numbers in C order, in this shape: (size) or (channels, length)."""

    do: Literal["reshape"] = "reshape"
    shape: tuple[int, ...]


class Kernel(Strict):
    """y = weights^T k(x), k_i = variance * exp(-|x - points_i|^2 / (2 length^2)); points (n, in), weights (n, out)."""

    do: Literal["kernel"] = "kernel"
    points: Tensor
    weights: Tensor
    length: float = Field(gt=0)
    variance: float = Field(gt=0, default=1.0)


class Forest(Strict):
    """The mean of regression trees: node i goes left where x[feature_i] <= threshold_i; a leaf has feature -1.

    x is first rounded to the thresholds' precision; a child stands after its parent.
    """

    do: Literal["forest"] = "forest"
    roots: Tensor
    feature: Tensor
    threshold: Tensor
    left: Tensor
    right: Tensor
    value: Tensor


class Nearest(Strict):
    """The row of `values` whose row of `points` is nearest to x (Euclidean; the first of equals)."""

    do: Literal["nearest"] = "nearest"
    points: Tensor
    values: Tensor


class Mean(Strict):
    """The mean of several models' answers to the same input."""

    do: Literal["mean"] = "mean"
    members: tuple[tuple[Step, ...], ...]


class Clip(Strict):
    """Within low and high, by element."""

    do: Literal["clip"] = "clip"
    low: float
    high: float


class Playable(Strict):
    """A force profile in newtons within these limits: where it is too steep, it follows as fast as it may."""

    do: Literal["playable"] = "playable"
    force_N: float = Field(gt=0)
    slope_N_deg: float = Field(gt=0)


Step: TypeAlias = Annotated[
    Affine | DoorFeatures | Dense | Conv | Activation | Residual | MaxPool | Upsample | Reshape | Kernel | Forest
    | Nearest | Mean | Clip | Playable,
    Field(discriminator="do"),
]  # fmt: skip
for _nested in (Residual, Mean):
    _nested.model_rebuild()


class Weights(Strict):
    """The file with the numbers, beside the card."""

    file: str
    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    bytes: int = Field(ge=0)


class Interval(Strict):
    """Half widths around each output that hold `coverage` of new answers, and how that was calibrated."""

    method: str
    coverage: float = Field(gt=0, lt=1)
    half_width: tuple[Annotated[float, Field(ge=0)], ...]


class Card(Strict):
    """The card of one model. `training` is its run card; `metrics` are those of its evaluation, by name."""

    format: Literal["palpate-model/1"] = "palpate-model/1"
    name: str
    title: str
    method: str
    weights: Weights
    takes: Port
    gives: Port
    steps: tuple[Step, ...]
    interval: Interval | None = None
    metrics: Mapping[str, float] = Field(default_factory=dict)
    training: Mapping[str, Any] = Field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _one_half_width_each(self) -> Self:
        if self.interval is not None and len(self.interval.half_width) != self.gives.size:
            raise ValueError(f"{len(self.interval.half_width)} half widths for {self.gives.size} numbers")
        return self


def tensors_named(steps: Sequence[Step]) -> Iterator[str]:
    """The names of all tensors that these steps use, in order, nested ones too."""
    for step in steps:
        for name in type(step).model_fields:
            value = getattr(step, name)
            if isinstance(value, str) and name not in ("do", "function"):
                yield value
            elif name == "steps":
                yield from tensors_named(value)
            elif name == "members":
                for member in value:
                    yield from tensors_named(member)


def complaint(error: ValidationError) -> str:
    """The first few things that are wrong with a card, each with its place."""
    wrong = [f"{'.'.join(map(str, each['loc'])) or 'card'}: {each['msg']}" for each in error.errors()[:3]]
    more = f" (and {error.error_count() - len(wrong)} more)" if error.error_count() > len(wrong) else ""
    return "; ".join(wrong) + more
