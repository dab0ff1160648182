"""The window's words in a language: its own beside those that all windows share."""

from __future__ import annotations

from pathlib import Path

from devices.window.geometry import WindowError
from devices.window.texts import Texts, load_texts, read_words
from protocols.did_you_mean import nearest

FOLDER = Path(__file__).parent / "texts"
MASTER = "en"


def render_texts(language: str = MASTER) -> Texts:
    """The words of the window and of what it shares with others. Raises WindowError."""
    file = FOLDER / f"{language}.yaml"
    if not file.is_file():
        known = nearest(language, sorted(path.stem for path in FOLDER.glob("*.yaml")))
        raise WindowError(f"the renderer's window has no texts in language {language!r}; {known}")
    return Texts(language, {**load_texts(language).words, **read_words(file)})


def texture_word(texts: Texts, texture: str) -> str:
    """A texture in the language; by its name where there is no word for it."""
    return texts.words.get(f"texture.{texture}", texture.replace("_", " "))


def method_word(texts: Texts, method: str) -> str:
    """A method in the language; by its name where there is no word for it."""
    return texts.words.get(f"method.{method}", method)
