"""Textures joined by their ids: what was felt, what was seen, how it was rated; what lacks is noted."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from palpate.modeling.attributes.material import (
    NOT_PHOTOGRAPHED,
    NOT_RECORDED,
    PICTURE_LEFT_OUT,
    RECORDINGS_LEFT_OUT,
    FeatureRows,
    Material,
    Texture,
)
from palpate.modeling.attributes.reading_pictures import TexturePictures
from palpate.modeling.attributes.reading_ratings import RatedTextures
from palpate.modeling.attributes.seeing import PictureRows

if TYPE_CHECKING:
    from palpate.modeling.attributes.reading_touch import FeltRows


LABEL, CATEGORY = "label", "class"
"""Columns of a stimulus table."""
WHY = {"recording": (RECORDINGS_LEFT_OUT, NOT_RECORDED), "picture": (PICTURE_LEFT_OUT, NOT_PHOTOGRAPHED)}
"""How the notes begin that say why a texture lacks one."""
NOTHING = {"recording": "nothing was felt", "picture": "nothing was seen"}
"""How a material's note says that a lab has none at all."""
MOST = 3
"""Reasons that are named at most."""
VARIES = re.compile(r"\([^)]*\)|\d+(?:\.\d+)?")
"""Files in brackets and numbers: reasons that differ in these and in the texture's name alone are one."""


@dataclass(frozen=True)
class Parts:
    """What was read of a lab; `touch` and `sight`: whether recordings and pictures were requested."""

    rated: RatedTextures
    felt: Mapping[str, FeltRows] = field(default_factory=dict)
    photos: Mapping[str, TexturePictures] = field(default_factory=dict)
    looked: Mapping[str, PictureRows] = field(default_factory=dict)
    touch: bool = True
    sight: bool = True

    @property
    def ids(self) -> tuple[str, ...]:
        """All textures, in the order of their first appearance."""
        return tuple(dict.fromkeys((*self.felt, *self.photos, *self.rated.rated, *self.rated.incomplete)))


def join_textures(parts: Parts) -> tuple[Texture, ...]:
    """Return every texture with what there is of it."""
    return tuple(_texture(name, parts) for name in parts.ids)


def _texture(name: str, parts: Parts) -> Texture:
    felt, photo, looked = parts.felt.get(name), parts.photos.get(name), parts.looked.get(name)
    # label and category, of whichever study has them
    known: Sequence[FeltRows | TexturePictures] = [
        source[name] for source in (parts.felt, parts.photos) if name in source
    ]
    columns = parts.rated.columns.get(name, {})
    labels = [*(part.label for part in known), columns.get(LABEL, "")]
    categories = [*(part.category for part in known), columns.get(CATEGORY, "")]
    label, category = next((text for text in labels if text and text != name), name), next(filter(None, categories), "")
    pictures, blank = photo.pictures if photo else (), looked.blank if looked else frozenset()
    return Texture(
        name,
        label,
        category,
        touch=felt.touch if felt else {},
        sight=looked.sight if looked else {},
        variants=looked.variants if looked else {},
        rated=parts.rated.rated.get(name),
        made_from=(felt.made_from if felt else frozenset()) | ({picture.sha256 for picture in pictures} - blank),
        notes=tuple(dict.fromkeys(_notes(name, parts))),
    )


def _notes(name: str, parts: Parts) -> Iterator[str]:
    felt, photo, looked = parts.felt.get(name), parts.photos.get(name), parts.looked.get(name)
    yield from felt.notes if felt else ()
    yield from photo.notes if photo else ()
    yield from looked.notes if looked else ()
    yield from missing_touch_notes(felt) if parts.touch else ()
    if parts.sight and not (looked and looked.sight):
        yield "no picture of it can be used" if photo else NOT_PHOTOGRAPHED
    if name not in parts.rated.rated:
        yield parts.rated.incomplete.get(name, "not rated")


def missing_touch_notes(felt: FeltRows | None) -> Iterator[str]:
    """Yield why there is nothing to be felt of a texture, where there is not."""
    if not (felt and felt.touch):
        yield "no recording of it can be used" if felt else NOT_RECORDED


def has_rows(kinds: Mapping[str, FeatureRows]) -> bool:
    """Return whether there is a segment, or a picture."""
    return any(len(rows) for rows in kinds.values())


def modalities_of(textures: Sequence[Texture]) -> tuple[bool, bool]:
    """Return whether any of the textures was felt, and whether any was seen."""
    return any(has_rows(texture.touch) for texture in textures), any(has_rows(texture.sight) for texture in textures)


def reasons_of(texture: Texture, what: str) -> list[str]:
    """Return the texture's notes on why a recording or a picture of it cannot be used."""
    return [note for note in texture.notes if note.startswith(WHY[what])]


def missing_modalities(material: Material) -> list[str]:
    """A sentence where no recording of any texture can be used, and one where no picture can: why, and how many."""
    sentences = []
    for what, any_of_it in zip(WHY, modalities_of(material.textures), strict=True):
        if not any_of_it:
            reasons = [note for note in material.notes if NOTHING[what] in note] + list(_by_reason(material, what))
            why = f": {'; '.join(reasons)}" if reasons else ""
            sentences.append(f"No {what} of any of the {len(material.textures)} textures can be used{why}.")
    return sentences


def _by_reason(material: Material, what: str) -> Iterator[str]:
    """Yield each reason in the words of the first texture that has it, those of most textures first."""
    noted: dict[str, list[tuple[str, str]]] = {}
    for texture in material.textures:
        alike = {VARIES.sub("", note.replace(texture.id, "")): note for note in reasons_of(texture, what)}
        for key, note in alike.items():
            noted.setdefault(key, []).append((texture.id, note))
    ordered = sorted(noted.values(), key=len, reverse=True)
    for (name, note), *others in ordered[:MOST]:
        yield f"{name}{f' and {len(others)} more' if others else ''}: {note}"
    if len(ordered) > MOST:
        yield f"and {len(ordered) - MOST} more reasons (the report's Provenance has them)"
