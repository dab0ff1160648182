"""The vocabulary of a library: its attributes' words, synonyms, and degrees ("very") as soft ranges.

A soft range gives the membership of a value, and the expected membership of a value known with an SD."""

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
"""An SD below this counts as zero."""
ENDS = (0.0, 100.0)
Phrase = tuple[str, ...]
DESCRIBING = ("extremely", "very", "", "slightly")
"""The degrees that describe a texture, the strongest first."""


@dataclass(frozen=True)
class Soft:
    """A membership (0 to 1) over values: linear between knots (value, membership), constant beyond the ends."""

    knots: tuple[Knot, ...]

    def at(self, value: float) -> float:
        """Return the membership of an exact value."""
        return self.expected(value, 0.0)

    def expected(self, mean: float, sd: float) -> float:
        """Return the expected membership of a normal variable, in closed form."""
        height = self.knots[0][1] + sum(
            (above[1] - below[1]) * _mean_rise(below[0], above[0], mean, sd) for below, above in pairwise(self.knots)
        )
        return min(1.0, max(0.0, height))

    @cached_property
    def best(self) -> float:
        """The greatest membership of any value on the scale."""
        return max(self.at(value) for value in (*ENDS, *(x for x, _ in self.knots if ENDS[0] <= x <= ENDS[1])))

    def short_of(self, value: float) -> float:
        """Return the distance (0 to 100) of a value from the best value of the range.

        The best value is the scale's end where the membership is greatest there, else the mean of the best knots. A
        range with the greatest membership at both ends has distance 0.
        """
        full = [x for x, share in self.knots if share == self.best] or [sum(ENDS) / 2]
        low, high = (self.at(end) == self.best for end in ENDS)
        if low == high:
            return abs(value - sum(full) / len(full)) if not low else 0.0
        return abs(value - ENDS[0 if low else 1])

    @property
    def half_fit(self) -> tuple[float, float] | None:
        """The first and last value, in steps of 0.5, with a membership of at least 0.5; None where there is none."""
        values = [value / 2 for value in range(201) if self.at(value / 2) >= 0.5]
        return (values[0], values[-1]) if values else None


def trapezoid(edges: Sequence[float | None]) -> Soft:
    """Return a range with membership 1 from the second to the third edge and 0 beyond the first and the fourth.

    None instead of two edges leaves that side unbounded.
    """
    rise, full, to, fall = edges
    knots = [(rise, 0.0), (full, 1.0)] if rise is not None and full is not None else []
    knots += [(to, 1.0), (fall, 0.0)] if to is not None and fall is not None else []
    return Soft(tuple(dict(knots).items()) or ((0.0, 1.0),))


def mirrored(soft: Soft) -> Soft:
    """Return the range mirrored about the scale's middle."""
    return Soft(tuple((ENDS[1] - value, member) for value, member in reversed(soft.knots)))


def both(first: Soft, second: Soft) -> Soft:
    """Return the intersection of two ranges: the lesser membership at every value."""
    values = sorted({value for term in (first, second) for value, _ in term.knots})
    crossings = []
    for low, high in pairwise(values):
        before, after = (first.at(value) - second.at(value) for value in (low, high))
        if before * after < 0:
            crossings.append(low + (high - low) * before / (before - after))
    values = sorted({*values, *crossings})
    return Soft(tuple((value, min(first.at(value), second.at(value))) for value in values))


def _mean_rise(low: float, high: float, mean: float, sd: float) -> float:
    """Return the expected value of a ramp from 0 at `low` to 1 at `high` for a normal variable."""
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
    """A word's meaning: the attribute's position, and whether it is the high end; None for its name."""

    pair: int
    high: bool | None


@dataclass(frozen=True)
class Vocabulary:
    """The words for textures with these attributes: phrases (tuples of words) and their meaning."""

    pairs: tuple[tuple[str, str], ...]
    words: Mapping[Phrase, Word]
    degrees: Mapping[Phrase, str]
    ranges: Mapping[str, Soft]
    numbers: Mapping[Phrase, str]
    silent: frozenset[Phrase]
    foreign: Mapping[str, str]
    """Words for attributes that these textures do not have, each with that attribute's main word."""
    classes: frozenset[str] = frozenset()
    """Classes of textures, which are no words for a feeling, for the error message."""

    def soft(self, degree: str, word: Word) -> Soft:
        """Return the range of the attribute's values for a word with a degree."""
        return self.ranges[degree] if word.high else mirrored(self.ranges[degree])


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
        tuple(pairs), {**words, **named, **own}, _phrases(known["degrees"], known["sayings"]),
        {name: trapezoid(edges) for name, edges in known["degrees"].items()}, _phrases((), known["numbers"]),
        frozenset(_phrase(word) for word in known["silent"]), foreign, frozenset(word.lower() for word in classes),
    )  # fmt: skip


def in_words(known: Vocabulary, pair: int, value: float) -> str:
    """Return the words for a value (0 to 100) of an attribute, as "very rough"."""
    low, high = known.pairs[pair]
    towards, word = (value, high) if value >= 50 else (100 - value, low)
    if known.ranges["medium"].at(towards) >= 1:
        return f"neither {low.lower()} nor {high.lower()}"
    degree = next((word for word in DESCRIBING if known.ranges[word].at(towards) >= 0.5), "slightly")
    words = {"slightly": "a bit"}.get(degree, degree)
    return f"{words} {word.lower()}".strip()


def known_words(known: Vocabulary) -> str:
    """Return all known words, degrees and numbers as text."""
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


def _phrases(names: Iterable[str], others: Mapping[str, Sequence[str]]) -> dict[Phrase, str]:
    """Return the phrases for each name, with the name; a name is also a phrase for itself."""
    phrases = {_phrase(name): name for name in names if name}
    return {**phrases, **{_phrase(word): name for name, every in others.items() for word in every}}
