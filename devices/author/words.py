"""The window's words in a language: its own beside those that all windows share."""

from __future__ import annotations

from pathlib import Path

from palpate.devices.door.making import NEUTRAL, Array, Maker
from palpate.devices.window.texts import MASTER, Texts, window_texts

FOLDER = Path(__file__).resolve().parent / "texts"
NAMED_OFF, NOTICED = 3, 10.0
"""So many of the wishes that cannot be had are named at most: those missed by more than people just notice."""


def author_texts(language: str = MASTER) -> Texts:
    """The words of the window and of the pages that it shares with others. Raises WindowError."""
    return window_texts(FOLDER, "designer", language)


def word(texts: Texts, name: str) -> str:
    """An attribute's word in the language; as the model has it where there is none."""
    return texts.words.get(f"word.{name}", name)


def what_is_off(texts: Texts, maker: Maker, wish: tuple[float, ...], predicted: Array) -> str:
    """In the language's own words: which wishes the nearest door misses most."""
    off = [abs(felt - wished) for felt, wished in zip(predicted.tolist(), wish, strict=True)]
    misses = sorted((number for number in range(len(wish)) if off[number] > NOTICED), key=lambda number: -off[number])
    parts = [
        texts(
            "not_had_part", word=word(texts, _end(maker, number, wish[number])), wished=f"{wish[number]:.0f}",
            feels=f"{predicted[number]:.0f}",
        )
        for number in sorted(misses[:NAMED_OFF])
    ]  # fmt: skip
    return texts("not_had", list=", ".join(parts))


def _end(maker: Maker, number: int, wish: float) -> str:
    """The word of the slider's end that is wished towards."""
    return (maker.antonyms if wish >= NEUTRAL else maker.attributes)[number]
