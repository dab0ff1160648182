"""The window's words in a language: its own beside those that all windows share."""

from __future__ import annotations

from pathlib import Path

from palpate.devices.window.texts import MASTER, Texts, window_texts

FOLDER = Path(__file__).resolve().parent / "texts"


def render_texts(language: str = MASTER) -> Texts:
    """The words of the window and of what it shares with others. Raises WindowError."""
    return window_texts(FOLDER, "renderer", language)


def texture_word(texts: Texts, texture: str) -> str:
    """A texture in the language; by its name where there is no word for it."""
    return texts.words.get(f"texture.{texture}", texture.replace("_", " "))


def method_word(texts: Texts, method: str) -> str:
    """A method in the language; by its name where there is no word for it."""
    return texts.words.get(f"method.{method}", method)
