"""The entries of a library of textures, as LAB/library/index.json holds them."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.protocols.strict import StrictFinite

FORMAT = "palpate-library/1"
Kind = Literal["rated", "predicted"]
KINDS: tuple[Kind, ...] = ("rated", "predicted")
Z90 = 1.6448536269514722
"""The 95 % quantile of the standard normal distribution: 90 % lie within this many SDs of the mean."""
NOTHING_KNOWN = (50.0, 28.867513459481287)
"""Mean and SD of the uniform distribution on 0..100."""
Sha256 = Annotated[str, Field(pattern="[0-9a-f]{64}")]
Spread = Annotated[float, Field(ge=0, le=1000)]
Value = Annotated[float, Field(ge=-1000, le=1000)]


class LibraryError(ValueError):
    """A library that is missing or unusable, or a question that it cannot answer."""


class Source(StrictFinite):
    """A file that the attributes come from."""

    what: str
    file: str
    sha256: Sha256


class Rated(StrictFinite):
    """Ratings of a texture on 0..100, by attribute: the mean, the SD between people, the SE of the mean.

    A mean is None where the attribute was not rated; an SD also for a single rater and where it is unknown.
    """

    mean: tuple[Value | None, ...]
    sd: tuple[Spread | None, ...]
    se: tuple[Spread, ...]
    raters: int = Field(ge=0)


class Predicted(StrictFinite):
    """A model's prediction of a texture on 0..100, by attribute, with the interval that holds 90 % of new ratings.

    `learned`: this texture's ratings were among the model's training data, so the prediction is no test of it.
    """

    value: tuple[Value, ...]
    low: tuple[Value, ...]
    high: tuple[Value, ...]
    learned: bool = False

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if any(low > high for low, high in zip(self.low, self.high, strict=False)):
            raise ValueError("an interval ends before it begins")
        return self


class Entry(StrictFinite):
    """A texture. `picture` is a path from the index's folder; `made_from` digests of its recordings and pictures."""

    id: str = Field(min_length=1)
    label: str
    category: str
    rated: Rated | None = None
    predicted: Predicted | None = None
    picture: str | None = None
    made_from: tuple[str, ...] = ()


class AttributeValue(StrictFinite):
    """An attribute of a texture: its value on 0..100, and the SD of that estimate."""

    value: float
    sd: Spread
    kind: Kind


class Library(StrictFinite):
    """Textures with their attributes: 0 is the first word of a pair, 100 the second."""

    format: Literal["palpate-library/1"] = "palpate-library/1"
    attributes: tuple[tuple[str, str], ...] = Field(min_length=1)
    textures: tuple[Entry, ...]
    simulated: bool = False
    sources: tuple[Source, ...] = ()
    notes: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        names = [texture.id for texture in self.textures]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise ValueError(f"texture {twice!r} appears twice")
        for texture in self.textures:
            rated, predicted = texture.rated, texture.predicted
            numbers = [
                *((rated.mean, rated.sd, rated.se) if rated else ()),
                *((predicted.value, predicted.low, predicted.high) if predicted else ()),
            ]
            if any(len(values) != len(self.attributes) for values in numbers):
                raise ValueError(f"texture {texture.id!r} does not tell {len(self.attributes)} attributes")
        return self


def value_of(entry: Entry, at: int, kind: Kind | None = None) -> AttributeValue | None:
    """Return an attribute of a texture, of one kind, or with None as rated, else as predicted; None if unknown."""
    rated, predicted = entry.rated, entry.predicted
    if kind != "predicted" and rated is not None and (value := rated.mean[at]) is not None:
        return AttributeValue(value=value, sd=rated.se[at], kind="rated")
    if kind != "rated" and predicted is not None:
        sd = (predicted.high[at] - predicted.low[at]) / (2 * Z90)
        return AttributeValue(value=predicted.value[at], sd=sd, kind="predicted")
    return None


def is_known(entry: Entry, kind: Kind | None = None) -> bool:
    """Return whether the texture has values of this kind, or with None of any kind."""
    return bool(entry.rated or entry.predicted) if kind is None else getattr(entry, kind) is not None


def belief(estimate: AttributeValue | None) -> tuple[float, float]:
    """Return the mean and SD of an attribute on 0..100; those of `NOTHING_KNOWN` where it is unknown."""
    return NOTHING_KNOWN if estimate is None else (estimate.value, estimate.sd)
