"""Textures as models of attributes see them: what was felt and seen, and how people rated it (thesis 3.3, 3.4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array

Rows = NDArray[np.float32]
Modality = Literal["touch", "sight"]
TOUCH_KINDS = ("mfcc", "dft", "dwt", "hand")
"""Rows of a segment: cepstral coefficients, spectrum, wavelets (of which one is taken), and the hand's statistics."""
SIGHT_KINDS = ("resnet", "glcm")
"""Rows of a picture: ResNet-50's average pool, co-occurrence of grey levels."""
TOUCH, SIGHT = ("mfcc", "hand"), ("resnet", "glcm")
"""The thesis' choice: 526 and 2304 numbers."""


class MaterialError(ValueError):
    """Textures that nothing can be learned from: the message says where, what was found and what to do."""


@dataclass(frozen=True)
class Pair:
    """A bipolar attribute: 0 is the first adjective, 100 the second."""

    low: str
    high: str

    @property
    def name(self) -> str:
        """As tables name it."""
        return f"{self.low}-{self.high}"


@dataclass(frozen=True)
class Rated:
    """How people rated one texture: mean and SD between them (attributes,) on 0..100, and how many they were."""

    mean: Array
    sd: Array
    raters: int


NOT_RECORDED, NOT_PHOTOGRAPHED = "not recorded", "not photographed"
RECORDINGS_LEFT_OUT, PICTURE_LEFT_OUT = "recordings left out", "left out"
"""How a texture's notes begin that say why it lacks what others have."""
FEW_READ = "only some of the lab's textures were read"
HURRIED = "looked at in a hurry: 2 x 2 of 7 x 7 patches of at most 3 pictures of a texture"
"""What a material's notes say of a quick reading."""


@dataclass(frozen=True)
class Texture:
    """One texture, whole: no split divides it.

    `touch` holds a row for each segment, `sight` one for each picture, by kind of feature; either may be empty where
    there is no recording, or no picture. `variants` are rows of further versions of the same pictures, for training
    alone. `made_from` are the SHA-256 of what it was made from: textures that share one are one group in any split.
    """

    id: str
    label: str
    category: str
    touch: Mapping[str, Rows] = field(default_factory=dict)
    sight: Mapping[str, Rows] = field(default_factory=dict)
    variants: Mapping[str, Rows] = field(default_factory=dict)
    rated: Rated | None = None
    made_from: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for what, rows in (("touch", self.touch), ("sight", self.sight), ("variants", self.variants)):
            if len({len(each) for each in rows.values()}) > 1:
                sizes = ", ".join(f"{kind} {len(each)}" for kind, each in rows.items())
                raise MaterialError(f"{self.id}: {what} has as many rows of each kind; found {sizes}.")
            for kind, each in rows.items():
                if each.ndim != 2 or not np.isfinite(each).all():
                    raise MaterialError(f"{self.id}: {kind} is {each.shape}; finite rows (n, features) are expected.")

    def rows(self, modality: Modality, kinds: Sequence[str]) -> Rows:
        """These kinds of features side by side: (segments, features) of touch, (pictures, features) of sight.

        Raises MaterialError where a kind is missing.
        """
        own = self.touch if modality == "touch" else self.sight
        missing = [kind for kind in kinds if kind not in own]
        if missing or not kinds:
            there = ", ".join(own) or "none"
            raise MaterialError(f"{self.id}: no {missing[0] if missing else modality} features; there are {there}.")
        return np.concatenate([own[kind] for kind in kinds], axis=1)


@dataclass(frozen=True)
class Material:
    """All textures with their attributes, and what made their features.

    `weights` says which weights ResNet-50 had; `simulated` whether nothing of it was measured on a person or a
    material.
    """

    textures: tuple[Texture, ...]
    attributes: tuple[Pair, ...]
    weights: str = ""
    simulated: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [each.id for each in self.textures]
        if len(set(names)) != len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise MaterialError(f"texture {twice!r} stands twice: its recordings and pictures belong to one.")

    @property
    def ids(self) -> tuple[str, ...]:
        """The textures' names, in order."""
        return tuple(each.id for each in self.textures)

    def rated(self) -> Material:
        """Only what was rated. Raises MaterialError where nothing was."""
        found = tuple(each for each in self.textures if each.rated is not None)
        if not found:
            raise MaterialError("no texture was rated: run texture_ratings, or give a table of ratings.")
        return Material(found, self.attributes, self.weights, self.simulated, self.notes)


def ratings_of(textures: Sequence[Texture]) -> Array:
    """Mean ratings (textures, attributes) on 0..100. Raises MaterialError where one was not rated."""
    missing = [each.id for each in textures if each.rated is None]
    if missing:
        raise MaterialError(f"{missing[0]} was not rated.")
    return np.stack([each.rated.mean for each in textures if each.rated is not None])
