"""The user's choices in the window, with their texts: texture, method of its model, volume, a mouse's force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.devices.window.texts import MASTER, Texts, window_texts

LIGHTEST_N, FIRMEST_N = 0.2, 3.0
"""Range of a mouse's force: a mouse has no pressure, so a slider sets it, within what hands do (thesis 4.5.3)."""
USUAL_N = 0.8
"""Force at the beginning (thesis 4.5.1)."""
Models = Mapping[str, Mapping[str, Path]]
"""{texture: {method: card}}, as palpate.devices.render.texture_models.available gives it."""
FOLDER = Path(__file__).resolve().parent / "texts"


@dataclass(frozen=True)
class Choice:
    """The user's choice; `volume` is from 0 to 1, where 1 is as recorded."""

    texture: str
    method: str
    volume: float = 1.0
    force_N: float = USUAL_N

    def of_texture(self, texture: str, models: Models) -> Choice:
        """Return the choice of another texture with the same method, or its first one if it has no such model."""
        methods = models[texture]
        return replace(self, texture=texture, method=self.method if self.method in methods else next(iter(methods)))

    def louder(self, volume: float) -> Choice:
        """Return the choice with another volume, in whole hundredths."""
        return replace(self, volume=round(min(max(volume, 0.0), 1.0), 2))

    def firmer(self, force_N: float) -> Choice:
        """Return the choice with another force, in tenths of a newton."""
        return replace(self, force_N=round(min(max(force_N, LIGHTEST_N), FIRMEST_N), 1))


def beside(names: Sequence[str], name: str, by: int) -> str:
    """Return the name `by` places further on, cyclically."""
    return names[(names.index(name) + by) % len(names)]


def in_view(names: Sequence[str], name: str, most: int) -> tuple[str, ...]:
    """Return at most `most` neighbours of a name, including itself."""
    first = min(max(0, names.index(name) - most // 2), max(0, len(names) - most))
    return tuple(names[first : first + most])


def render_texts(language: str = MASTER) -> Texts:
    """Return the texts of the window and of what it shares with others. Raises WindowError."""
    return window_texts(FOLDER, "renderer", language)


def texture_word(texts: Texts, texture: str) -> str:
    """Return a texture's word in the language, or its name if there is none."""
    return texts.words.get(f"texture.{texture}", texture.replace("_", " "))


def method_word(texts: Texts, method: str) -> str:
    """Return a method's word in the language, or its name if there is none."""
    return texts.words.get(f"method.{method}", method)
