"""The words that a library knows: those of its own attributes, other words for them, and how much of each is meant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from palpate.modeling.library.ranges import Soft, trapezoid, turned

FILE = Path(__file__).resolve().with_name("terms.yaml")
Phrase = tuple[str, ...]
TELLING = ("extremely", "very", "", "slightly")
"""The degrees that a texture is described with, the strongest first."""


@dataclass(frozen=True)
class Word:
    """A word's place: the attribute, and whether it stands for its high end. `high` is None for the pair's own name."""

    pair: int
    high: bool | None


@dataclass(frozen=True)
class Vocabulary:
    """What can be said about textures with these attributes."""

    pairs: tuple[tuple[str, str], ...]
    words: Mapping[Phrase, Word]
    degrees: Mapping[Phrase, str]
    ranges: Mapping[str, Soft]
    numbers: Mapping[Phrase, str]
    silent: frozenset[Phrase]
    foreign: Mapping[str, str]
    """Words for attributes that these textures do not have, each with its attribute's word."""
    classes: frozenset[str] = frozenset()
    """Classes of textures: no words for a feeling, but people try them."""

    def soft(self, degree: str, word: Word) -> Soft:
        """The range of the attribute's values that a degree of a word means."""
        return self.ranges[degree] if word.high else turned(self.ranges[degree])


def vocabulary(pairs: Sequence[tuple[str, str]], classes: Iterable[str] = ()) -> Vocabulary:
    """The words for these attributes of textures of these classes."""
    told = _told()
    own = {_phrase(text): word for text, word in _ends(pairs)}
    others = {_phrase(other): _phrase(head) for head, every in told["synonyms"].items() for other in every}
    words = {other: own[head] for other, head in others.items() if head in own}
    named = {_phrase(f"{low}-{high}"): Word(at, None) for at, (low, high) in enumerate(pairs)}
    heads = {**others, **{_phrase(head): _phrase(head) for head in told["synonyms"]}}
    foreign = {" ".join(other): " ".join(head) for other, head in heads.items() if head not in own}
    return Vocabulary(
        tuple(pairs), {**words, **named, **own}, _sayings(told["degrees"], told["sayings"]),
        {name: trapezoid(edges) for name, edges in told["degrees"].items()}, _sayings((), told["numbers"]),
        frozenset(_phrase(each) for each in told["silent"]), foreign, frozenset(each.lower() for each in classes),
    )  # fmt: skip


def in_words(known: Vocabulary, pair: int, value: float) -> str:
    """How a value of an attribute would be called, as `very rough`."""
    low, high = known.pairs[pair]
    towards, word = (value, high) if value >= 50 else (100 - value, low)
    if known.ranges["medium"].at(towards) >= 1:
        return f"neither {low.lower()} nor {high.lower()}"
    degree = next((each for each in TELLING if known.ranges[each].at(towards) >= 0.5), "slightly")
    said = {"slightly": "a bit"}.get(degree, degree)
    return f"{said} {word.lower()}".strip()


def known_words(known: Vocabulary) -> str:
    """All that is known, in three sentences."""
    told = []
    for text, place in _ends(known.pairs):
        others = [" ".join(phrase) for phrase, word in known.words.items() if word == place]
        also = ", ".join(other for other in others if other != text.lower())
        told.append(f"{text.lower()} ({also})" if also else text.lower())
    degrees = []
    for name in filter(None, known.ranges):
        said = [" ".join(phrase) for phrase, meant in known.degrees.items() if meant == name]
        others = [each for each in said if each != name]
        degrees.append(f"{name} ({', '.join(others[:2])})" if others else name)
    return (
        f"Words: {'; '.join(told)}. Before them: {', '.join(degrees)}. After them a number from 0 to 100, as in "
        "'smooth 80' or 'soft 60-80'."
    )


@cache
def _told() -> Mapping[str, Any]:
    import yaml

    told: Mapping[str, Any] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return told


def _ends(pairs: Sequence[tuple[str, str]]) -> list[tuple[str, Word]]:
    """Both words of each attribute."""
    return [(pair[high], Word(at, bool(high))) for at, pair in enumerate(pairs) for high in (0, 1)]


def _phrase(text: str) -> Phrase:
    return tuple(text.lower().split())


def _sayings(names: Iterable[str], others: Mapping[str, Sequence[str]]) -> dict[Phrase, str]:
    """Each way to say it, with its name; the names say themselves."""
    found = {_phrase(name): name for name in names if name}
    return {**found, **{_phrase(each): name for name, every in others.items() for each in every}}
