"""The textures as one file that every worker reads once: fifty of them are too much to be sent with each job."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.attributes.material import Material, MaterialError, Pair, Rated, Texture
from palpate.modeling.files.result_store import ResultStore

FOLDER = "material"
"""Of the folder of finished jobs."""
MODALITIES = ("touch", "sight", "variants")


def parts_of(material: Material) -> dict[str, str]:
    """Return the SHA-256 of each kind of each texture ("T01/touch/mfcc") and of its ratings and class ("T01")."""
    parts = {name: hashlib.sha256(f"{rows.shape}".encode() + rows.tobytes()).hexdigest()
             for name, rows in _arrays(material)}  # fmt: skip
    for texture in material.textures:
        text = json.dumps([texture.id, texture.category, _ratings(texture), sorted(texture.made_from)], sort_keys=True)
        parts[texture.id] = hashlib.sha256(text.encode()).hexdigest()
    return parts


def digest_of(material: Material) -> str:
    """Return the SHA-256 of everything that a method can see of the textures, whatever their order.

    It stands in files: in evaluations, which decide what is trained, and in the cards of models.
    """
    text = json.dumps([sorted(parts_of(material).items()), [[p.low, p.high] for p in material.attributes]])
    return hashlib.sha256(text.encode()).hexdigest()


def save_material(material: Material, work: Path) -> str:
    """Save the textures below the folder, unless they are there, and return their digest."""
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


def _ratings(texture: Texture) -> list[Any] | None:
    rated = texture.rated
    return None if rated is None else [rated.mean.tolist(), rated.sd.tolist(), rated.raters]


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
