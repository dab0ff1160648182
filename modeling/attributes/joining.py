"""Textures joined by their ids from recordings, pictures and ratings, with notes on what is missing."""

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
"""The beginnings of notes on why a texture has no recording or no picture."""
NOTHING = {"recording": "nothing was felt", "picture": "nothing was seen"}
"""The texts in a material's notes where a lab has no recording or no picture at all."""
MOST = 3
"""The most reasons that a message names."""
VARIES = re.compile(r"\([^)]*\)|\d+(?:\.\d+)?")
"""Files in brackets, and numbers: reasons that differ only in these and in the texture's name are equal."""


@dataclass(frozen=True)
class Parts:
    """The data of a lab by texture; `touch` and `sight`: whether recordings and pictures were requested."""

    rated: RatedTextures
    felt: Mapping[str, FeltRows] = field(default_factory=dict)
    photos: Mapping[str, TexturePictures] = field(default_factory=dict)
    picture_rows: Mapping[str, PictureRows] = field(default_factory=dict)
    touch: bool = True
    sight: bool = True

    @property
    def ids(self) -> tuple[str, ...]:
        """The ids of all textures, in the order of their first appearance."""
        return tuple(dict.fromkeys((*self.felt, *self.photos, *self.rated.rated, *self.rated.incomplete)))


def join_textures(parts: Parts) -> tuple[Texture, ...]:
    """Return every texture with all of its data."""
    return tuple(_texture(name, parts) for name in parts.ids)


def _texture(name: str, parts: Parts) -> Texture:
    felt, photo, rows = parts.felt.get(name), parts.photos.get(name), parts.picture_rows.get(name)
    # label and category come from the first study that has them
    known: Sequence[FeltRows | TexturePictures] = [
        source[name] for source in (parts.felt, parts.photos) if name in source
    ]
    columns = parts.rated.columns.get(name, {})
    labels = [*(part.label for part in known), columns.get(LABEL, "")]
    categories = [*(part.category for part in known), columns.get(CATEGORY, "")]
    label, category = next((text for text in labels if text and text != name), name), next(filter(None, categories), "")
    pictures, blank = photo.pictures if photo else (), rows.blank if rows else frozenset()
    return Texture(
        name,
        label,
        category,
        touch=felt.touch if felt else {},
        sight=rows.sight if rows else {},
        variants=rows.variants if rows else {},
        rated=parts.rated.rated.get(name),
        made_from=(felt.made_from if felt else frozenset()) | ({picture.sha256 for picture in pictures} - blank),
        notes=tuple(dict.fromkeys(_notes(name, parts))),
    )


def _notes(name: str, parts: Parts) -> Iterator[str]:
    felt, photo, rows = parts.felt.get(name), parts.photos.get(name), parts.picture_rows.get(name)
    yield from felt.notes if felt else ()
    yield from photo.notes if photo else ()
    yield from rows.notes if rows else ()
    yield from missing_touch_notes(felt) if parts.touch else ()
    if parts.sight and not (rows and rows.sight):
        yield "no picture of it can be used" if photo else NOT_PHOTOGRAPHED
    if name not in parts.rated.rated:
        yield parts.rated.incomplete.get(name, "not rated")


def missing_touch_notes(felt: FeltRows | None) -> Iterator[str]:
    """Yield a note where a texture has no touch features."""
    if not (felt and felt.touch):
        yield "no recording of it can be used" if felt else NOT_RECORDED


def has_rows(kinds: Mapping[str, FeatureRows]) -> bool:
    """Return whether there is at least one row, of a segment or a picture."""
    return any(len(rows) for rows in kinds.values())


def modalities_of(textures: Sequence[Texture]) -> tuple[bool, bool]:
    """Return whether any of the textures has touch features, and whether any has features of pictures."""
    return any(has_rows(texture.touch) for texture in textures), any(has_rows(texture.sight) for texture in textures)


def reasons_of(texture: Texture, what: str) -> list[str]:
    """Return the texture's notes on why a recording or a picture of it cannot be used."""
    return [note for note in texture.notes if note.startswith(WHY[what])]


def missing_modalities(material: Material) -> list[str]:
    """Return a sentence with the reasons where no texture has a recording, and where none has a picture."""
    sentences = []
    for what, is_available in zip(WHY, modalities_of(material.textures), strict=True):
        if not is_available:
            reasons = [note for note in material.notes if NOTHING[what] in note] + list(_by_reason(material, what))
            why = f": {'; '.join(reasons)}" if reasons else ""
            sentences.append(f"No {what} of any of the {len(material.textures)} textures can be used{why}.")
    return sentences


def _by_reason(material: Material, what: str) -> Iterator[str]:
    """Yield the reasons, the most frequent first, each as the note of its first texture."""
    textures_by_reason: dict[str, list[tuple[str, str]]] = {}
    for texture in material.textures:
        notes_by_reason = {VARIES.sub("", note.replace(texture.id, "")): note for note in reasons_of(texture, what)}
        for reason, note in notes_by_reason.items():
            textures_by_reason.setdefault(reason, []).append((texture.id, note))
    ordered = sorted(textures_by_reason.values(), key=len, reverse=True)
    for (name, note), *others in ordered[:MOST]:
        yield f"{name}{f' and {len(others)} more' if others else ''}: {note}"
    if len(ordered) > MOST:
        yield f"and {len(ordered) - MOST} more reasons (the report's Provenance has them)"
