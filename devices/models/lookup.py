"""Find trained models: a lab's own in LAB/models, shipped ones in devices/door/made and devices/render/made."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from palpate.protocols.did_you_mean import nearest
from palpate.signals.models.card import Card
from palpate.signals.models.errors import ModelFileError
from palpate.signals.models.file import CARD_SUFFIX, CODE, read_card
from palpate.signals.models.tensors import require_size, weights_file

SHIPPED = Path(__file__).resolve().parents[1] / "door" / "made"
TEXTURES = Path(__file__).resolve().parents[1] / "render" / "made"
FOLDER = "models"
OTHERS = {
    "palpate-attributes/1": "how textures feel, from features of touch and sight: read by `palpate textures index`"
}
"""Formats of cards of models that no rig runs, with what they are."""


@dataclass(frozen=True)
class Listed:
    """A model in a folder: its card, or what is wrong with it."""

    path: Path
    owner: str
    card: Card | None
    wrong: str = ""
    other: str = ""
    """What the file is if it is a model for another part of Palpate, else ""."""


def places(lab: Path) -> tuple[tuple[str, Path], ...]:
    """Return owner and path of the folders that are searched, the lab's own first."""
    return ("lab", lab / FOLDER), ("shipped", SHIPPED), ("shipped", TEXTURES)


def listed(lab: Path) -> Iterator[Listed]:
    """Yield every card in the folders, by name; whether its numbers are intact is checked when it is read."""
    for owner, folder in places(lab):
        for path in sorted(folder.glob(f"*{CARD_SUFFIX}")):
            try:
                card = read_card(path)
                require_size(weights_file(path, card.weights), path, card.weights)
            except ModelFileError as error:
                other = ""
                with suppress(OSError, ValueError, RecursionError):
                    document = json.loads(path.read_text(encoding="utf-8"))
                    other = OTHERS.get(str(document.get("format")), "") if isinstance(document, dict) else ""
                yield Listed(path, owner, None, "" if other else str(error), other)
                continue
            yield Listed(path, owner, card)


def find_model(name: str, lab: Path) -> Path:
    """Return the card of a name or a path. Raises ModelFileError that suggests the nearest model."""
    if "/" in name or "\\" in name:
        return Path(name)
    for _, folder in places(lab):
        if (path := folder / f"{name}{CARD_SUFFIX}").is_file():
            return path
    if Path(name).suffix in {CARD_SUFFIX, ".safetensors", *CODE} or Path(name).is_file():
        return Path(name)
    names = dict.fromkeys(path.stem for _, folder in places(lab) for path in sorted(folder.glob(f"*{CARD_SUFFIX}")))
    raise ModelFileError(f"no model {name!r} in {lab / FOLDER} or among the shipped ones; {nearest(name, names)}")
