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
from palpate.protocols.files import write_bytes

FOLDER = "material"
MODALITIES = ("touch", "sight", "variants")


def parts_of(material: Material) -> dict[str, str]:
    """SHA-256 of each kind of each texture ("T01/touch/mfcc") and of its ratings and class ("T01")."""
    found = {name: hashlib.sha256(f"{rows.shape}".encode() + rows.tobytes()).hexdigest()
             for name, rows in _arrays(material)}  # fmt: skip
    for each in material.textures:
        told = json.dumps([each.id, each.category, _ratings(each), sorted(each.made_from)], sort_keys=True)
        found[each.id] = hashlib.sha256(told.encode()).hexdigest()
    return found


def digest_of(material: Material) -> str:
    """SHA-256 of everything that a method can see of the textures, whatever their order."""
    told = json.dumps([sorted(parts_of(material).items()), [[p.low, p.high] for p in material.attributes]])
    return hashlib.sha256(told.encode()).hexdigest()


def stored(material: Material, work: Path) -> Path:
    """Put the textures into a folder (once for the same ones) and give the file."""
    from safetensors.numpy import save

    path = work / FOLDER / f"{digest_of(material)[:32]}.safetensors"
    if not path.is_file():
        write_bytes(path, save(dict(_arrays(material)), {"material": json.dumps(_told(material))}))
    return path


@lru_cache(maxsize=1)
def reread(path: Path) -> Material:
    """The textures of such a file; each process reads it once. Raises MaterialError where there is none."""
    from safetensors import safe_open

    if not path.is_file():
        raise MaterialError(
            f"{path} is not here: the cluster's workers need the lab's folder under the same path as this process."
        )
    with safe_open(path, framework="np") as file:
        told = json.loads(file.metadata()["material"])
        rows = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - it is no mapping
    textures = tuple(_texture(each, rows) for each in told["textures"])
    attributes = tuple(Pair(low, high) for low, high in told["attributes"])
    return Material(textures, attributes, told["weights"], told["simulated"])


def _arrays(material: Material) -> Iterator[tuple[str, NDArray[np.float32]]]:
    for each in material.textures:
        for modality in MODALITIES:
            for kind, rows in sorted(getattr(each, modality).items()):
                yield f"{each.id}/{modality}/{kind}", np.ascontiguousarray(rows, dtype=np.float32)


def _told(material: Material) -> dict[str, Any]:
    textures = [
        {"id": each.id, "label": each.label, "category": each.category, "rated": _ratings(each),
         "made_from": sorted(each.made_from), "notes": list(each.notes),
         "kinds": {modality: sorted(getattr(each, modality)) for modality in MODALITIES}}
        for each in material.textures
    ]  # fmt: skip
    attributes = [[pair.low, pair.high] for pair in material.attributes]
    return {"textures": textures, "attributes": attributes, "weights": material.weights,
            "simulated": material.simulated}  # fmt: skip


def _ratings(texture: Texture) -> list[Any] | None:
    rated = texture.rated
    return None if rated is None else [rated.mean.tolist(), rated.sd.tolist(), rated.raters]


def _texture(told: Mapping[str, Any], rows: Mapping[str, NDArray[np.float32]]) -> Texture:
    own = {m: {kind: rows[f"{told['id']}/{m}/{kind}"] for kind in told["kinds"][m]} for m in MODALITIES}
    rated = None
    if told["rated"] is not None:
        mean, sd, raters = told["rated"]
        rated = Rated(np.array(mean), np.array(sd), raters)
    return Texture(
        told["id"], told["label"], told["category"], rated=rated,
        made_from=frozenset(told["made_from"]), notes=tuple(told["notes"]), **own,
    )  # fmt: skip
