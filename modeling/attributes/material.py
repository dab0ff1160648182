"""Textures as models of attributes use them: features of touch and sight, and ratings (thesis 3.3, 3.4).

All textures are stored in one file that every worker reads once: fifty textures are too large to send with each job."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.files.result_store import ResultStore
from palpate.signals.arrays import Array

FeatureRows = NDArray[np.float32]
Modality = Literal["touch", "sight"]
TOUCH_KINDS = ("mfcc", "dft", "dwt", "hand")
"""Features of a segment: cepstral coefficients, spectrum, wavelets (one of the three), and the hand's statistics."""
SIGHT_KINDS = ("resnet", "glcm")
"""Features of a picture: ResNet-50's average pool, co-occurrence of grey levels."""
TOUCH, SIGHT = ("mfcc", "hand"), ("resnet", "glcm")
"""The thesis' features: 526 and 2304 numbers."""
NOT_RECORDED, NOT_PHOTOGRAPHED = "not recorded", "not photographed"
RECORDINGS_LEFT_OUT, PICTURE_LEFT_OUT = "recordings left out", "left out"
"""Beginnings of a texture's notes on why data are missing."""
FEW_READ = "only some of the lab's textures were read"
QUICK_LOOK = "quick look: 2 x 2 of 7 x 7 patches of at most 3 pictures of a texture"
"""The material's note on a quick reading."""
FOLDER = "material"
"""The folder of the stored textures, in that of finished jobs."""
MODALITIES = ("touch", "sight", "variants")


class MaterialError(ValueError):
    """Textures that nothing can be learned from: the message names the place, the fault and what to do."""


@dataclass(frozen=True)
class Pair:
    """A bipolar attribute: 0 is the first adjective, 100 the second."""

    low: str
    high: str

    @property
    def name(self) -> str:
        """The attribute's name in tables."""
        return f"{self.low}-{self.high}"


@dataclass(frozen=True)
class Rated:
    """Ratings of one texture: mean and SD between people, (attributes,) each on 0..100, and the number of raters."""

    mean: Array
    sd: Array
    raters: int


@dataclass(frozen=True)
class Texture:
    """One texture; no split divides it.

    `touch` has a row for each segment, (segments, features), and `sight` one for each picture, (pictures, features), by
    kind of feature; either may be empty. `variants` are rows of augmented versions of the same pictures, for training
    alone. `made_from` are the SHA-256 of its data: textures that share one are one group in any split. Raises
    MaterialError for rows that are not finite or differ in number between kinds.
    """

    id: str
    label: str
    category: str
    touch: Mapping[str, FeatureRows] = field(default_factory=dict)
    sight: Mapping[str, FeatureRows] = field(default_factory=dict)
    variants: Mapping[str, FeatureRows] = field(default_factory=dict)
    rated: Rated | None = None
    made_from: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for what, rows in (("touch", self.touch), ("sight", self.sight), ("variants", self.variants)):
            if len({len(row) for row in rows.values()}) > 1:
                sizes = ", ".join(f"{kind} {len(values)}" for kind, values in rows.items())
                raise MaterialError(f"{self.id}: {what} has as many rows of each kind; found {sizes}.")
            for kind, values in rows.items():
                if values.ndim != 2 or not np.isfinite(values).all():
                    raise MaterialError(f"{self.id}: {kind} is {values.shape}; finite rows (n, features) are expected.")

    def rows(self, modality: Modality, kinds: Sequence[str]) -> FeatureRows:
        """Return these kinds of features side by side: (segments, features) of touch, (pictures, features) of sight.

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
    """All textures with their attributes.

    `weights` names the weights of ResNet-50; `simulated` is whether any ratings, recordings or pictures are simulated.
    Raises MaterialError for a texture that appears twice.
    """

    textures: tuple[Texture, ...]
    attributes: tuple[Pair, ...]
    weights: str = ""
    simulated: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [texture.id for texture in self.textures]
        if len(set(names)) != len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise MaterialError(f"texture {twice!r} appears twice: its recordings and pictures belong to one.")

    @property
    def ids(self) -> tuple[str, ...]:
        """The textures' ids, in order."""
        return tuple(texture.id for texture in self.textures)

    def rated(self) -> Material:
        """Return the material with its rated textures only. Raises MaterialError where there are none."""
        rated_textures = tuple(texture for texture in self.textures if texture.rated is not None)
        if not rated_textures:
            raise MaterialError("no texture was rated: run texture_ratings, or give a table of ratings.")
        return Material(rated_textures, self.attributes, self.weights, self.simulated, self.notes)


def ratings_of(textures: Sequence[Texture]) -> Array:
    """Return mean ratings (textures, attributes) on 0..100. Raises MaterialError for a texture without ratings."""
    missing = [texture.id for texture in textures if texture.rated is None]
    if missing:
        raise MaterialError(f"{missing[0]} was not rated.")
    return np.stack([texture.rated.mean for texture in textures if texture.rated is not None])


def parts_of(material: Material) -> dict[str, str]:
    """Return the SHA-256 of each kind of each texture ("T01/touch/mfcc") and of its ratings and class ("T01")."""
    parts = {name: hashlib.sha256(f"{rows.shape}".encode() + rows.tobytes()).hexdigest()
             for name, rows in _arrays(material)}  # fmt: skip
    for texture in material.textures:
        rated = texture.rated
        ratings = None if rated is None else [rated.mean.tolist(), rated.sd.tolist(), rated.raters]
        text = json.dumps([texture.id, texture.category, ratings, sorted(texture.made_from)], sort_keys=True)
        parts[texture.id] = hashlib.sha256(text.encode()).hexdigest()
    return parts


def digest_of(material: Material) -> str:
    """Return the SHA-256 of all data that a method can use, whatever the textures' order.

    Stored in evaluations, which choose the method that is trained, and in models' cards.
    """
    text = json.dumps([sorted(parts_of(material).items()), [[p.low, p.high] for p in material.attributes]])
    return hashlib.sha256(text.encode()).hexdigest()


def save_material(material: Material, work: Path) -> str:
    """Save the textures in the folder, unless they are there, and return their digest."""
    store, key = ResultStore(work / FOLDER), digest_of(material)
    if store.load(key) is None:
        ratings = {f"{texture.id}/rated": np.stack([texture.rated.mean, texture.rated.sd])
                   for texture in material.textures if texture.rated is not None}  # fmt: skip
        store.save(key, {**dict(_arrays(material)), **ratings}, _metadata(material))
    return key


@lru_cache(maxsize=1)
def load_material(work: Path, key: str) -> Material:
    """Return the textures of this digest; each process reads them once. Raises MaterialError where they are missing."""
    stored = ResultStore(work / FOLDER).load(key)
    if stored is None:
        raise MaterialError(
            f"{work / FOLDER / key}.npz is not here: the cluster's workers need the lab's folder under the same path "
            "as this process."
        )
    metadata = stored.metadata
    textures = tuple(_texture(texture, stored.arrays) for texture in metadata["textures"])
    attributes = tuple(Pair(low, high) for low, high in metadata["attributes"])
    return Material(textures, attributes, metadata["weights"], metadata["simulated"])


def _arrays(material: Material) -> Iterator[tuple[str, NDArray[np.float32]]]:
    for texture in material.textures:
        for modality in MODALITIES:
            for kind, rows in sorted(getattr(texture, modality).items()):
                yield f"{texture.id}/{modality}/{kind}", np.ascontiguousarray(rows, dtype=np.float32)


def _metadata(material: Material) -> dict[str, Any]:
    textures = [
        {"id": texture.id, "label": texture.label, "category": texture.category,
         "raters": None if texture.rated is None else texture.rated.raters,
         "made_from": sorted(texture.made_from), "notes": list(texture.notes),
         "kinds": {modality: sorted(getattr(texture, modality)) for modality in MODALITIES}}
        for texture in material.textures
    ]  # fmt: skip
    attributes = [[pair.low, pair.high] for pair in material.attributes]
    return {"textures": textures, "attributes": attributes, "weights": material.weights,
            "simulated": material.simulated}  # fmt: skip


def _texture(metadata: Mapping[str, Any], rows: Mapping[str, NDArray[Any]]) -> Texture:
    own = {
        modality: {kind: rows[f"{metadata['id']}/{modality}/{kind}"] for kind in metadata["kinds"][modality]}
        for modality in MODALITIES
    }
    rated = None
    if metadata["raters"] is not None:
        mean, sd = rows[f"{metadata['id']}/rated"]
        rated = Rated(mean, sd, metadata["raters"])
    return Texture(
        metadata["id"], metadata["label"], metadata["category"], rated=rated,
        made_from=frozenset(metadata["made_from"]), notes=tuple(metadata["notes"]), **own,
    )  # fmt: skip
