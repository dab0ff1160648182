"""Find the model of a texture and a method: a lab's own first, then the shipped ones."""

from __future__ import annotations

from pathlib import Path

from palpate.protocols.did_you_mean import nearest
from palpate.signals.textures.sounds import RenderError

SHIPPED = Path(__file__).resolve().parent / "made"
FOLDER = "models"
PREFIX, SUFFIX = "texture-", ".json"
DEFAULT_METHOD = "foten_generative"


def folders(lab: Path) -> tuple[Path, Path]:
    """Return the folders of models: the lab's and the shipped ones."""
    return lab / FOLDER, SHIPPED


def available(lab: Path) -> dict[str, dict[str, Path]]:
    """Return {texture: {method: card}}; a lab's model replaces a shipped one of the same name."""
    cards: dict[str, dict[str, Path]] = {}
    for folder in reversed(folders(lab)):
        for path in sorted(folder.glob(f"{PREFIX}*-*{SUFFIX}")):
            texture, _, method = path.stem.removeprefix(PREFIX).rpartition("-")
            cards.setdefault(texture, {})[method] = path
    return {texture: dict(sorted(methods.items())) for texture, methods in sorted(cards.items())}


def card_for(texture: str, method: str, lab: Path) -> Path:
    """Return the card of a texture's model by that method. Raises RenderError that lists the available ones."""
    there = available(lab)
    if not there:
        raise RenderError(f"no texture has a model in {lab / FOLDER} or among the shipped ones: palpate train textures")
    if texture not in there:
        raise RenderError(f"no model of a texture {texture!r}; {nearest(texture, there)}")
    if method not in there[texture]:
        raise RenderError(f"{texture} has no model by the method {method!r}; {nearest(method, there[texture])}")
    return there[texture][method]
