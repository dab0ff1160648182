"""Why a texture lacks what is felt or seen of it, and why all of them do."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from palpate.modeling.attributes.material import (
    NOT_PHOTOGRAPHED,
    NOT_RECORDED,
    PICTURE_LEFT_OUT,
    RECORDINGS_LEFT_OUT,
    Material,
    Rows,
    Texture,
)

WHY = {"recording": (RECORDINGS_LEFT_OUT, NOT_RECORDED), "picture": (PICTURE_LEFT_OUT, NOT_PHOTOGRAPHED)}
"""How the notes begin that say why a texture lacks one."""
NOTHING = {"recording": "nothing was felt", "picture": "nothing was seen"}
"""How a material's note says that a lab has none at all."""
MOST = 3
"""Reasons that are told."""
VARIES = re.compile(r"\([^)]*\)|\d+(?:\.\d+)?")
"""Files in brackets and numbers: reasons that differ in these and in the texture's name alone are one."""


def has_rows(kinds: Mapping[str, Rows]) -> bool:
    """Whether there is a segment, or a picture."""
    return any(len(rows) for rows in kinds.values())


def senses(textures: Sequence[Texture]) -> tuple[bool, bool]:
    """Whether any of the textures was felt, and whether any was seen."""
    return any(has_rows(each.touch) for each in textures), any(has_rows(each.sight) for each in textures)


def why_of(texture: Texture, what: str) -> list[str]:
    """The texture's notes on why a recording or a picture of it cannot be used."""
    return [note for note in texture.notes if note.startswith(WHY[what])]


def lacking(material: Material) -> list[str]:
    """A sentence where no recording of any texture can be used, and one where no picture can: why, and how many."""
    there = zip(WHY, senses(material.textures), strict=True)
    return [_sentence(material, what) for what, any_of_it in there if not any_of_it]


def _sentence(material: Material, what: str) -> str:
    whole = [note for note in material.notes if NOTHING[what] in note]
    told = "; ".join((*whole, *_by_reason(material, what)))
    return f"No {what} of any of the {len(material.textures)} textures can be used{f': {told}' if told else ''}."


def _by_reason(material: Material, what: str) -> Iterator[str]:
    """Each reason in the words of the first texture that has it, those of most textures first."""
    found: dict[str, list[tuple[str, str]]] = {}
    for each in material.textures:
        alike = {VARIES.sub("", note.replace(each.id, "")): note for note in why_of(each, what)}
        for key, note in alike.items():
            found.setdefault(key, []).append((each.id, note))
    ordered = sorted(found.values(), key=len, reverse=True)
    for (name, note), *others in ordered[:MOST]:
        yield f"{name}{f' and {len(others)} more' if others else ''}: {note}"
    if len(ordered) > MOST:
        yield f"and {len(ordered) - MOST} more reasons (the report's Provenance has them)"
