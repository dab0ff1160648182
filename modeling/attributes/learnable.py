"""Input of every fit: rated textures in a fixed order, their rows, and inner folds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from palpate.modeling.attributes.folds import groups_of
from palpate.modeling.attributes.material import FeatureRows, MaterialError, Modality, Texture, ratings_of
from palpate.modeling.attributes.methods import Learning
from palpate.protocols.wording import count
from palpate.signals.arrays import Array, Indices

INNER_FOLDS = 5


def textures_of(learning: Learning, least: int = 2) -> tuple[tuple[Texture, ...], Array]:
    """Return the training textures, sorted by name, and their ratings (textures, attributes).

    Raises MaterialError for fewer than `least`, for a texture without ratings, and for ratings that are not finite or
    not one for each attribute.
    """
    if len(learning.train) < least:
        raise MaterialError(f"{count(len(learning.train), 'texture')} to learn from; at least {least} are needed.")
    ordered = tuple(sorted(learning.train, key=lambda texture: texture.id))
    ratings = ratings_of(ordered)
    if ratings.shape[1] != len(learning.attributes) or not np.isfinite(ratings).all():
        names = ", ".join(pair.name for pair in learning.attributes)
        raise MaterialError(f"ratings are {ratings.shape}; a finite one of each texture on {names} is expected.")
    return ordered, ratings


def rows_of(texture: Texture, modality: Modality, kinds: Sequence[str], width: int | None = None) -> FeatureRows:
    """Return a texture's rows of these kinds side by side, (rows, width); `width` is the number of learned features.

    Raises MaterialError where a kind is missing, where there is no row, or where rows have another width.
    """
    rows = texture.rows(modality, kinds)
    if not len(rows):
        what = "recording" if modality == "touch" else "picture"
        raise MaterialError(f"{texture.id}: no {modality} rows; a {what} that features can be made of is needed.")
    if width is not None and rows.shape[1] != width:
        raise MaterialError(
            f"{texture.id}: {rows.shape[1]} {modality} features ({'+'.join(kinds)}); {width} were learned from. "
            "Make the features of all textures in the same way."
        )
    return rows


def inner_folds(textures: Sequence[Texture], folds: int = INNER_FOLDS) -> Iterator[tuple[Indices, Indices]]:
    """Yield places of training and of test textures; textures with common files stay on one side.

    Raises MaterialError where all have the same files.
    """
    from sklearn.model_selection import GroupKFold

    bare = [replace(texture, touch={}, sight={}, variants={}) for texture in textures]
    groups = groups_of(bare)
    if len(groups) < 2:
        raise MaterialError(f"{len(textures)} textures are all made from the same files: two that differ are needed.")
    number = {name: place for place, group in enumerate(groups) for name in group}
    places = np.array([number[texture.id] for texture in textures])
    yield from GroupKFold(min(folds, len(groups))).split(places, groups=places)
