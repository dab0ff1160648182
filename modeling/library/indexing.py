"""Build a library from textures: from their ratings, and a model's predictions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from palpate.modeling.attributes import material as attributes
from palpate.modeling.attributes.material import Material, MaterialError, Pair, Texture
from palpate.modeling.library.entries import Entry, Library, LibraryError, Predicted, Rated, Source
from palpate.signals.arrays import Array

UNKNOWN_SD = 20.0
"""The SD between people where it is unknown, chosen wider than raters of textures commonly have."""
USUAL_WEIGHS = 5
"""The degrees of freedom of the usual SD between people, beside those of a texture's own raters (a choice)."""
DIGITS = 3


@dataclass(frozen=True)
class Predictor:
    """A trained model as the library uses it.

    `predictions` returns for each texture (n, attributes), whose mean over n counts, or a MaterialError for missing
    features. `low` and `high`, (attributes,), are added to a prediction for its 90 % interval. `learned` are the
    textures of its training data.
    """

    attributes: tuple[Pair, ...]
    predictions: Callable[[Sequence[Texture]], Sequence[Array | MaterialError]]
    low: Array
    high: Array
    learned: frozenset[str] = frozenset()
    sources: tuple[Source, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class IndexedLibrary:
    """A library, and the textures that were left out because nothing is known of them, each with the reason."""

    library: Library
    left_out: Mapping[str, str] = field(default_factory=dict)


def library_of(material: Material, model: Predictor | None = None, *, sources: Sequence[Source] = ()) -> IndexedLibrary:
    """Return the library of these textures, in the order of their names.

    Raises LibraryError where nothing is known of any, and where the model predicts other attributes than people rated.
    """
    pairs = _pairs(material, model)
    # the root mean square SD between people, by attribute, over textures with two raters or more
    usual_sds = []
    for at in range(len(material.attributes)):
        known = [sd for texture in material.textures if texture.rated and (sd := _sd(texture.rated, at)) is not None]
        usual_sds.append(math.sqrt(sum(sd * sd for sd in known) / len(known)) if known else UNKNOWN_SD)
    usual, entries, left_out, unpredicted_reasons = tuple(usual_sds), [], {}, []
    ordered = sorted(material.textures, key=lambda texture: texture.id)
    predicted_textures = _all_predicted(ordered, model)
    for texture, (predicted, why) in zip(ordered, predicted_textures, strict=True):
        rated = None if texture.rated is None else _rated(texture.rated, usual)
        if rated is None and predicted is None:
            left_out[texture.id] = f"nobody rated it, and {why}"
            continue
        if model is not None and predicted is None:
            unpredicted_reasons.append(why)
        entries.append(
            Entry(id=texture.id, label=texture.label, category=texture.category, rated=rated, predicted=predicted,
                  made_from=tuple(sorted(texture.made_from)))
        )  # fmt: skip
    if not entries:
        first = next(iter(left_out.items()), ("no texture", "there is none"))
        raise LibraryError(f"nothing is known of any texture ({first[0]}: {first[1]}).")
    reasons = unpredicted_reasons
    unpredicted = (f"{len(reasons)} rated textures are not predicted; {reasons[0]}",) if reasons else ()
    notes = tuple(dict.fromkeys((*material.notes, *(model.notes if model else ()), *unpredicted)))
    return IndexedLibrary(
        Library(attributes=tuple((pair.low, pair.high) for pair in pairs), textures=tuple(entries), notes=notes,
                simulated=material.simulated, sources=(*sources, *(model.sources if model else ()))),
        left_out,
    )  # fmt: skip


def _pairs(material: Material, model: Predictor | None) -> tuple[Pair, ...]:
    """Return the attributes. Raises LibraryError where ratings and model have different ones."""
    rated = any(texture.rated is not None for texture in material.textures)
    if model is None or (rated and material.attributes == model.attributes):
        return material.attributes
    if not rated:
        return model.attributes
    people, predicted = (
        "; ".join(attribute.name for attribute in every) for every in (material.attributes, model.attributes)
    )
    raise LibraryError(f"people rated {people}, and the model predicts {predicted}: train it on these ratings.")


def _sd(rated: attributes.Rated, at: int) -> float | None:
    """Return the SD between people on an attribute; None for one rater or where it is unknown."""
    sd = float(rated.sd[at])
    return sd if rated.raters > 1 and math.isfinite(sd) else None


def _rated(rated: attributes.Rated, usual: Sequence[float]) -> Rated:
    """Return the ratings of a texture for the library.

    The SE uses `usual`, the SD between people by attribute, where the texture's own SD is unknown, and shrinks the SD
    of few raters towards it (`_shrunk_sd`).
    """
    mean = [float(number) for number in rated.mean]
    sd = [_sd(rated, at) for at in range(len(mean))]
    people = math.sqrt(max(1, rated.raters))
    se = [_shrunk_sd(own, general, rated.raters) / people for own, general in zip(sd, usual, strict=True)]
    return Rated(
        mean=tuple(round(number, DIGITS) if math.isfinite(number) else None for number in mean),
        sd=tuple(None if number is None else round(number, DIGITS) for number in sd),
        se=tuple(round(number, DIGITS) for number in se), raters=rated.raters,
    )  # fmt: skip


def _shrunk_sd(sd: float | None, usual: float, raters: int) -> float:
    """Return the SD from the mean of own and usual variance, weighted by their degrees of freedom."""
    if sd is None:
        return usual
    own = raters - 1
    return math.sqrt((own * sd * sd + USUAL_WEIGHS * usual * usual) / (own + USUAL_WEIGHS))


def _all_predicted(textures: Sequence[Texture], model: Predictor | None) -> list[tuple[Predicted | None, str]]:
    """Return for each texture its prediction, or None and the reason."""
    if model is None:
        return [(None, "there is no model")] * len(textures)
    answers = model.predictions(textures)
    return [_predicted(texture, model, rows) for texture, rows in zip(textures, answers, strict=True)]


def _predicted(texture: Texture, model: Predictor, rows: Array | MaterialError) -> tuple[Predicted | None, str]:
    """Return the model's prediction of a texture, or None and the reason. Raises LibraryError for one not finite."""
    if isinstance(rows, MaterialError):
        return None, f"the model predicts nothing: {rows}"
    value = np.clip(np.asarray(rows, dtype=np.float64).reshape(-1, len(model.attributes)).mean(axis=0), 0.0, 100.0)
    if not np.isfinite(value).all():
        raise LibraryError(f"{texture.id}: the model's answer is not a number; train it again.")
    low, high = (tuple(np.round(value + offset, DIGITS).tolist()) for offset in (model.low, model.high))
    values = tuple(np.round(value, DIGITS).tolist())
    return Predicted(value=values, low=low, high=high, learned=texture.id in model.learned), ""


def removed_textures(earlier: Library | None, now: Library) -> tuple[str, ...]:
    """Return the textures of an earlier library that this one does not have."""
    names = {texture.id for texture in now.textures}
    return tuple(texture.id for texture in (earlier.textures if earlier else ()) if texture.id not in names)
