"""The choices in the window: a texture, the method of its model, volume, a mouse's force; and their words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.devices.window.texts import MASTER, Texts, window_texts

LIGHTEST_N, FIRMEST_N = 0.2, 3.0
"""A mouse has no pressure: it presses as firmly as a slider says, within what hands do (thesis 4.5.3)."""
USUAL_N = 0.8
"""What hands begin with (thesis 4.5.1)."""
Models = Mapping[str, Mapping[str, Path]]
"""{texture: {method: card}}, as palpate.devices.render.texture_models.available gives it."""
FOLDER = Path(__file__).resolve().parent / "texts"


@dataclass(frozen=True)
class Choice:
    """The choice; `volume` from 0 to 1, 1 as it was recorded."""

    texture: str
    method: str
    volume: float = 1.0
    force_N: float = USUAL_N

    def of_texture(self, texture: str, models: Models) -> Choice:
        """Return another texture by the same method, or by its first one where it has no such model."""
        methods = models[texture]
        return replace(self, texture=texture, method=self.method if self.method in methods else next(iter(methods)))

    def louder(self, volume: float) -> Choice:
        """Return the choice with another volume, in whole hundredths."""
        return replace(self, volume=round(min(max(volume, 0.0), 1.0), 2))

    def firmer(self, force_N: float) -> Choice:
        """Return the choice with another force, in tenths of a newton."""
        return replace(self, force_N=round(min(max(force_N, LIGHTEST_N), FIRMEST_N), 1))


def beside(names: Sequence[str], name: str, by: int) -> str:
    """Return the name so many places further, cyclically."""
    return names[(names.index(name) + by) % len(names)]


def in_view(names: Sequence[str], name: str, most: int) -> tuple[str, ...]:
    """Return at most so many neighbours of a name, including itself."""
    first = min(max(0, names.index(name) - most // 2), max(0, len(names) - most))
    return tuple(names[first : first + most])


def render_texts(language: str = MASTER) -> Texts:
    """Return the words of the window and of what it shares with others. Raise WindowError."""
    return window_texts(FOLDER, "renderer", language)


def texture_word(texts: Texts, texture: str) -> str:
    """Return a texture in the language; by its name where there is no word for it."""
    return texts.words.get(f"texture.{texture}", texture.replace("_", " "))


def method_word(texts: Texts, method: str) -> str:
    """Return a method in the language; by its name where there is no word for it."""
    return texts.words.get(f"method.{method}", method)
