"""Steps of a model that continues a signal: attention, recurrence, spectra, and values that are stored for later.

They are steps of a card like those in signals/models/card.py. A value has shape (channels, length), or (size) where it
is a list; "place" is a position along the length.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from palpate.protocols.strict import StrictFinite

Name = Annotated[str, Field(min_length=1, max_length=60)]
"""The name under which a value is kept; unique within a model, and not the name of a tensor."""


Tensor = Annotated[str, Field(min_length=1)]
"""The name of an array in a model's weights file."""


class Keep(StrictFinite):
    """A step that keeps the value under a name and passes it on."""

    do: Literal["keep"] = "keep"
    kept: Name


class Recall(StrictFinite):
    """A step that goes on with a kept value."""

    do: Literal["recall"] = "recall"
    kept: Name


class Add(StrictFinite):
    """The step x + a kept value of the same shape."""

    do: Literal["add"] = "add"
    kept: Name


class Join(StrictFinite):
    """The value with kept values below it: along the channels, or lists one after another."""

    do: Literal["join"] = "join"
    kept: tuple[Name, ...] = Field(min_length=1)


class Part(StrictFinite):
    """A selection of channels from `start` to before `stop`; of a list, numbers; with along = "length", places."""

    do: Literal["part"] = "part"
    start: int = Field(ge=0)
    stop: int = Field(ge=1)
    along: Literal["channels", "length"] = "channels"


class Turn(StrictFinite):
    """The transposition of (channels, length) to (length, channels)."""

    do: Literal["turn"] = "turn"


class Norm(StrictFinite):
    """Layer normalisation over the channels of each place (Ba et al. 2016); of a list, over all its numbers.

    y = (x - mean) / sqrt(variance + tiny) * weight + bias; weight and bias (channels).
    """

    do: Literal["norm"] = "norm"
    weight: Tensor
    bias: Tensor
    tiny: float = Field(gt=0, default=1e-5)


class Attention(StrictFinite):
    """Multi-head scaled dot-product attention (Vaswani et al. 2017) over (width, length).

    weight (3 width, width): queries, keys, values, one below the other, bias (3 width); out (width, width), out_bias
    (width). Queries come from the value; keys and values from it too, or from the value kept as `memory`. `causal`: a
    place attends to none after itself. `sparse`: only this many places with the largest max - mean of their scores
    attend, the others get the mean of the values, or if causal their sum up to there (Zhou et al. 2021, with all keys).
    """

    do: Literal["attention"] = "attention"
    heads: int = Field(ge=1)
    weight: Tensor
    bias: Tensor
    out: Tensor
    out_bias: Tensor
    memory: Name | None = None
    causal: bool = False
    sparse: int | None = Field(ge=1, default=None)


class Lstm(StrictFinite):
    """A long short-term memory along the length, starting at rest: (in, length) to (hidden, length).

    weight (4 hidden, in), state (4 hidden, hidden), bias (4 hidden); input, forget, cell, output gates in this order.
    `reverse`: from the last place to the first, each answer at its own place.
    """

    do: Literal["lstm"] = "lstm"
    weight: Tensor
    state: Tensor
    bias: Tensor
    reverse: bool = False


class Polar(StrictFinite):
    """The conversion of (2, n) real and imaginary parts to (2, n) magnitudes and phases in radians (atan2)."""

    do: Literal["polar"] = "polar"


class Cartesian(StrictFinite):
    """The conversion of (2, n) magnitudes and phases to (2, n) real and imaginary parts."""

    do: Literal["cartesian"] = "cartesian"


class Autoregression(StrictFinite):
    """A stochastic linear predictor whose spectrum follows speed and force (Culbertson et al. 2014).

    Takes (3, length): acceleration in m/s^2, speed in mm/s, force in N, oldest first; gives mean and log SD of the next
    acceleration. points (k, 2): speed and force of each model; frequencies (k, order): its line spectral frequencies in
    radians, rising; log_sd (k): of its innovation; triangles (t, 3): rows of points. Frequencies and log SD are
    interpolated between a triangle's corners, at the newest speed and force divided by `per`; outside all triangles at
    the nearest place inside one. Line spectral frequencies that rise make a stable predictor, interpolated ones too.
    """

    do: Literal["autoregression"] = "autoregression"
    points: Tensor
    frequencies: Tensor
    log_sd: Tensor
    triangles: Tensor
    per: tuple[Annotated[float, Field(gt=0)], Annotated[float, Field(gt=0)]] = (100.0, 1.0)
