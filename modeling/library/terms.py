"""The words that a library knows: those of its own attributes, other words for them, and how much of each is meant.

How much is a soft range of the attribute: it says how well a value fits, also one that is not known for sure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

Knot = tuple[float, float]
SURE = 1e-9
"""An SD below this is none."""
ENDS = (0.0, 100.0)
Phrase = tuple[str, ...]
TELLING = ("extremely", "very", "", "slightly")
"""The degrees that a texture is described with, the strongest first."""


@dataclass(frozen=True)
class Soft:
    """A membership between 0 and 1: straight lines from knot (value, membership) to knot, level beyond the ends."""

    knots: tuple[Knot, ...]

    def at(self, value: float) -> float:
        """Return the membership of a value that is known for sure."""
        return self.expected(value, 0.0)

    def expected(self, mean: float, sd: float) -> float:
        """Return the membership to expect of a value that is normal about `mean`; in closed form, 0 to 1."""
        height = self.knots[0][1] + sum(
            (above[1] - below[1]) * _risen(below[0], above[0], mean, sd) for below, above in pairwise(self.knots)
        )
        return min(1.0, max(0.0, height))

    @cached_property
    def best(self) -> float:
        """The greatest membership that a value on the scale can have."""
        return max(self.at(value) for value in (*ENDS, *(x for x, _ in self.knots if ENDS[0] <= x <= ENDS[1])))

    def short_of(self, value: float) -> float:
        """How far a value is from what the range means at its best, 0 to 100: from the scale's end where the range is
        level to there, else from the middle of what fits wholly."""
        full = [x for x, share in self.knots if share == self.best] or [sum(ENDS) / 2]
        low, high = (self.at(end) == self.best for end in ENDS)
        if low == high:
            return abs(value - sum(full) / len(full)) if not low else 0.0
        return abs(value - ENDS[0 if low else 1])

    @property
    def met(self) -> tuple[float, float] | None:
        """The first and last value on the scale, in halves, that fits at least by half."""
        values = [value / 2 for value in range(201) if self.at(value / 2) >= 0.5]
        return (values[0], values[-1]) if values else None


def trapezoid(edges: Sequence[float | None]) -> Soft:
    """Nothing up to the first edge, all between the second and the third, nothing from the fourth; None: no bound."""
    rise, full, to, fall = edges
    knots = [(rise, 0.0), (full, 1.0)] if rise is not None and full is not None else []
    knots += [(to, 1.0), (fall, 0.0)] if to is not None and fall is not None else []
    return Soft(tuple(dict(knots).items()) or ((0.0, 1.0),))


def turned(soft: Soft) -> Soft:
    """Return the same range seen from the scale's other end."""
    return Soft(tuple((ENDS[1] - value, member) for value, member in reversed(soft.knots)))


def both(first: Soft, second: Soft) -> Soft:
    """Return the lesser membership of the two everywhere: what lies in both ranges."""
    values = sorted({value for term in (first, second) for value, _ in term.knots})
    crossings = []
    for low, high in pairwise(values):
        before, after = (first.at(value) - second.at(value) for value in (low, high))
        if before * after < 0:
            crossings.append(low + (high - low) * before / (before - after))
    values = sorted({*values, *crossings})
    return Soft(tuple((value, min(first.at(value), second.at(value))) for value in values))


def _risen(low: float, high: float, mean: float, sd: float) -> float:
    """How far a rise from 0 at `low` to 1 at `high` has got, on average: 1 - integral of the distribution / width."""
    if sd < SURE:
        return min(1.0, max(0.0, (mean - low) / (high - low)))
    below = sd * (_integral((high - mean) / sd) - _integral((low - mean) / sd))
    return 1.0 - below / (high - low)


def _integral(z: float) -> float:
    """Return the integral of the normal distribution function up to z."""
    return z * normal(z) + math.exp(-z * z / 2) / math.sqrt(2 * math.pi)


def normal(z: float) -> float:
    """Return the normal distribution function."""
    return math.erfc(-z / math.sqrt(2)) / 2


FILE = Path(__file__).resolve().with_name("terms.yaml")


@dataclass(frozen=True)
class Word:
    """A word's place: the attribute, and whether it stands for its high end. `high` is None for the pair's own name."""

    pair: int
    high: bool | None


@dataclass(frozen=True)
class Vocabulary:
    """The words for textures with these attributes."""

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
        """Return the range of the attribute's values that a degree of a word means."""
        return self.ranges[degree] if word.high else turned(self.ranges[degree])


def vocabulary(pairs: Sequence[tuple[str, str]], classes: Iterable[str] = ()) -> Vocabulary:
    """Return the words for these attributes of textures of these classes."""
    known = _vocabulary()
    own = {_phrase(text): word for text, word in _ends(pairs)}
    others = {_phrase(other): _phrase(head) for head, every in known["synonyms"].items() for other in every}
    words = {other: own[head] for other, head in others.items() if head in own}
    named = {_phrase(f"{low}-{high}"): Word(at, None) for at, (low, high) in enumerate(pairs)}
    heads = {**others, **{_phrase(head): _phrase(head) for head in known["synonyms"]}}
    foreign = {" ".join(other): " ".join(head) for other, head in heads.items() if head not in own}
    return Vocabulary(
        tuple(pairs), {**words, **named, **own}, _sayings(known["degrees"], known["sayings"]),
        {name: trapezoid(edges) for name, edges in known["degrees"].items()}, _sayings((), known["numbers"]),
        frozenset(_phrase(word) for word in known["silent"]), foreign, frozenset(word.lower() for word in classes),
    )  # fmt: skip


def in_words(known: Vocabulary, pair: int, value: float) -> str:
    """Return how a value of an attribute would be called, as `very rough`."""
    low, high = known.pairs[pair]
    towards, word = (value, high) if value >= 50 else (100 - value, low)
    if known.ranges["medium"].at(towards) >= 1:
        return f"neither {low.lower()} nor {high.lower()}"
    degree = next((word for word in TELLING if known.ranges[word].at(towards) >= 0.5), "slightly")
    words = {"slightly": "a bit"}.get(degree, degree)
    return f"{words} {word.lower()}".strip()


def known_words(known: Vocabulary) -> str:
    """Return all that is known, in three sentences."""
    texts = []
    for text, place in _ends(known.pairs):
        others = [" ".join(phrase) for phrase, word in known.words.items() if word == place]
        also = ", ".join(other for other in others if other != text.lower())
        texts.append(f"{text.lower()} ({also})" if also else text.lower())
    degrees = []
    for name in filter(None, known.ranges):
        phrases = [" ".join(phrase) for phrase, meant in known.degrees.items() if meant == name]
        others = [phrase for phrase in phrases if phrase != name]
        degrees.append(f"{name} ({', '.join(others[:2])})" if others else name)
    return (
        f"Words: {'; '.join(texts)}. Before them: {', '.join(degrees)}. After them a number from 0 to 100, as in "
        "'smooth 80' or 'soft 60-80'."
    )


@cache
def _vocabulary() -> Mapping[str, Any]:
    import yaml

    content: Mapping[str, Any] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return content


def _ends(pairs: Sequence[tuple[str, str]]) -> list[tuple[str, Word]]:
    """Return both words of each attribute."""
    return [(pair[high], Word(at, bool(high))) for at, pair in enumerate(pairs) for high in (0, 1)]


def _phrase(text: str) -> Phrase:
    return tuple(text.lower().split())


def _sayings(names: Iterable[str], others: Mapping[str, Sequence[str]]) -> dict[Phrase, str]:
    """Return each way to say it, with its name; the names say themselves."""
    phrases = {_phrase(name): name for name in names if name}
    return {**phrases, **{_phrase(word): name for name, every in others.items() for word in every}}
