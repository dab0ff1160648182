"""Wishes in words: a parser of texts as `rough, a bit sticky, not bumpy, soft 60-80` into soft ranges of attributes."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from itertools import groupby
from typing import TypeVar

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.terms import Phrase, Soft, Vocabulary, Word, both, known_words, mirrored, trapezoid
from palpate.protocols.did_you_mean import nearest

TOKEN = re.compile(r"[0-9]+(?:\.[0-9]+)?|[^\W\d_]+(?:[-'’][^\W\d_]+)*|>=|<=|\.\.+|\S")
SEPARATORS = frozenset((",", ";", ".", "and", "but", "yet", "also", "with", "&"))
MINUS = ("-", "–", "−")
RANGE = frozenset((*MINUS, "to", "..", "..."))
WEAKER = ("at", "all")
"""The words that may follow a negated word: not rough at all."""
DIGITS = "0123456789"
HALF_FIT, ROUNDING = 0.5, 1e-9
"""Wishes about one attribute contradict each other where no value has a membership above one half."""
NEAR, EDGE = 5.0, 10.0
"""Half a JND to either side of a number has membership 1; the membership falls to 0 within one further JND."""
T = TypeVar("T")
COMPARING = {"more": "very", "most": "extremely", "less": "not very", "least": "not at all"}
"""Words that compare, each with a degree to suggest instead."""
LIKENESS = frozenset(("like", "similar", "same", "as", "than"))
ASK_NEAREST = "What feels like a texture that you know: palpate textures nearest ID."


@dataclass(frozen=True)
class Wish:
    """A wish: its text, the attribute's position, and the range of values that fit."""

    text: str
    pair: int
    soft: Soft


@dataclass
class _Reader:
    """A text split into words, with the position of the parser and the wishes so far."""

    text: str
    words: Sequence[str]
    known: Vocabulary
    at: int = 0
    phrase_start: int = 0
    wishes: list[Wish] = field(default_factory=list)

    def peek(self, ahead: int = 0) -> str:
        """Return the word `ahead` of the position; "" at the end."""
        return self.words[self.at + ahead] if self.at + ahead < len(self.words) else ""

    def match(self, phrases: Collection[Phrase]) -> Phrase | None:
        """Return the longest of the phrases at the position; None where there is none."""
        longest = max(map(len, phrases), default=0)
        for size in range(min(longest, len(self.words) - self.at), 0, -1):
            if (result := tuple(self.words[self.at : self.at + size])) in phrases:
                return result
        return None

    def take(self, phrases: Mapping[Phrase, T]) -> T | None:
        """Move past the longest phrase at the position and return its meaning; None where there is none."""
        phrase = self.match(phrases)
        self.at += len(phrase or ())
        return None if phrase is None else phrases[phrase]

    def wish(self, pair: int, soft: Soft) -> None:
        """Append a wish whose text ends at the position."""
        self.wishes.append(Wish(" ".join(self.words[self.phrase_start : self.at]), pair, soft))


def wishes_in(texts: Sequence[str], known: Vocabulary) -> tuple[Wish, ...]:
    """Return the wishes in all these texts.

    Raises LibraryError for no wish, an unknown word, a number outside 0..100, and wishes that contradict each other.
    """
    result = tuple(wish for text in texts for wish in _read(text, known))
    if not result:
        raise LibraryError(f"{' '.join(texts)!r}: nothing is wished for. {known_words(known)}")
    for pair in combined(result):
        wishes = [wish for wish in result if wish.pair == pair[0]]
        if len(wishes) > 1 and combined(wishes)[0][1].best < HALF_FIT + ROUNDING:
            low, high = known.pairs[wishes[0].pair]
            quoted = " and ".join(dict.fromkeys(repr(wish.text) for wish in wishes))
            raise LibraryError(
                f"{quoted} contradict each other: they are about one attribute, {low}-{high}, and no value fits both. "
                f"Leave one out, or say 'neither {low.lower()} nor {high.lower()}' for the middle."
            )
    return result


def combined(wishes: Sequence[Wish]) -> list[tuple[int, Soft]]:
    """Return the attributes of the wishes, each with the intersection of its wishes' ranges."""
    ordered = sorted(wishes, key=lambda wish: (wish.pair, wish.soft.knots))
    return [(pair, reduce(both, (wish.soft for wish in every))) for pair, every in groupby(ordered, lambda w: w.pair)]


def _read(text: str, known: Vocabulary) -> list[Wish]:
    reader = _Reader(text, [word.replace("’", "'") for word in TOKEN.findall(text.lower())], known)
    while reader.at < len(reader.words):
        reader.phrase_start = reader.at
        if reader.peek() in SEPARATORS:
            reader.at += 1
        elif reader.peek() == "neither":
            # neither rough nor smooth, nor ...: each word is negated
            reader.at += 1
            negated = [_negated(reader)]
            while reader.peek() in ("nor", "or"):
                reader.at += 1
                negated.append(_negated(reader))
            if len(negated) < 2:
                raise LibraryError(f"{reader.text!r}: 'neither' is followed by a word, 'nor' and another word.")
            for pair in dict.fromkeys(pair for pair, _ in negated):
                reader.wish(pair, reduce(both, (soft for about, soft in negated if about == pair)))
        elif reader.peek() == "between":
            _between(reader)
        elif reader.match(reader.known.degrees) or not (silent := reader.match(reader.known.silent)):
            _clause(reader)
        else:
            reader.at += len(silent)
    return reader.wishes


def _negated(reader: _Reader) -> tuple[int, Soft]:
    """Read a word with its degree after neither or nor; return its attribute and range: neither very rough nor ..."""
    degree = _degree(reader, "not") or "not"
    word = _end(reader, _word(reader))
    return word.pair, reader.known.soft(_degree_behind(reader, degree) or degree, word)


def _between(reader: _Reader) -> None:
    """Read `between rough and smooth` as the middle of the attribute."""
    reader.at += 1
    if _is_number(reader.peek()):
        raise LibraryError(f"{reader.text!r}: the numbers stand after the word: 'rough between 20 and 40'.")
    first = _end(reader, _word(reader))
    reader.at += reader.peek() == "and"
    second = _end(reader, _word(reader))
    if first.pair != second.pair or first.high == second.high:
        low, high = reader.known.pairs[first.pair]
        raise LibraryError(
            f"{reader.text!r}: 'between' comes before the two ends of one attribute, as 'between {low.lower()} and "
            f"{high.lower()}'."
        )
    reader.wish(first.pair, reader.known.soft("medium", first))


def _clause(reader: _Reader) -> None:
    """Read a wish of the form [degree] word [degree], word number, or number word."""
    degree = _degree(reader)
    while silent := reader.match(reader.known.silent):
        reader.at += len(silent)
    before = _number(reader) if degree is None else None
    if before is not None and reader.peek() in ("", *SEPARATORS):
        raise LibraryError(
            f"{reader.text!r}: a number has no word next to it. Write a range as 'soft 60-80' or 'soft between 60 and "
            "80', two wishes as 'soft 60, smooth 80'."
        )
    word = _word(reader)
    number = before or _number(reader)
    degree = _degree_behind(reader, degree) if number is None else degree
    if number is not None:
        if degree is not None:
            raise LibraryError(f"{reader.text!r}: {degree!r} and a number are both given; give one of them.")
        reader.wish(word.pair, mirrored(number) if word.high is False else number)
    elif degree == "medium":
        reader.wish(word.pair, reader.known.ranges["medium"])
    else:
        reader.wish(word.pair, reader.known.soft(degree or "", _end(reader, word)))


def _degree(reader: _Reader, before: str | None = None) -> str | None:
    """Read all degrees at the position into one, after `before`: not + very is `not very`, very + very `extremely`."""
    result = reader.take(reader.known.degrees) if before is None else before
    while result is not None and (further := reader.take(reader.known.degrees)) is not None:
        together = "extremely" if (result, further) == ("very", "very") else f"{result} {further}"
        meant = reader.known.degrees.get(tuple(together.split()))
        if meant is None:
            raise LibraryError(
                f"{reader.text!r}: what is meant by {together!r}? Known: "
                f"{', '.join(name for name in reader.known.ranges if name)}."
            )
        result = meant
    return result


def _degree_behind(reader: _Reader, before: str | None) -> str | None:
    """Read the degree behind a word, if there is one: not rough at all; sticky a bit, where no further word follows."""
    if before == "not" and reader.match((WEAKER,)):
        reader.at += len(WEAKER)
        return "not at all"
    start = reader.at
    degree = reader.take(reader.known.degrees) if before is None else None
    if degree is not None and (degree.startswith("not") or reader.peek() not in ("", *SEPARATORS)):
        reader.at, degree = start, None
    return degree or before


def _word(reader: _Reader) -> Word:
    """Read the attribute's word at the position. Raises LibraryError where there is none."""
    result = reader.take(reader.known.words)
    if result is not None:
        return result
    word = reader.peek()
    if not word or word in SEPARATORS:
        raise LibraryError(f"{reader.text!r}: a word is missing{f' before {word!r}' if word else ' at the end'}.")
    raise not_expected(reader.text, reader.words[reader.at :], reader.known)


def _end(reader: _Reader, word: Word) -> Word:
    """Return the word. Raises LibraryError for an attribute's name in place of one of its ends."""
    if word.high is None:
        low, high = reader.known.pairs[word.pair]
        raise LibraryError(
            f"{reader.text!r}: {low}-{high} names the attribute: a number is expected after it, 0 for {low.lower()} to "
            f"100 for {high.lower()}, or one of the two words alone."
        )
    return word


def _number(reader: _Reader) -> Soft | None:
    """Read a number or a range of numbers as a range of values; None where none begins."""
    start = reader.at
    joining = RANGE
    if reader.peek() == "between" and _begins_number(reader, 1):
        reader.at += 1
        joining = RANGE | {"and"}
        low, high = _value(reader), None
    else:
        how = reader.take(reader.known.numbers)
        while how == "about" and (further := reader.take(reader.known.numbers)):
            how = further
        if not _begins_number(reader):
            reader.at = start
            return None
        low = _value(reader)
        if how == "at least" and not (reader.peek() in RANGE and _is_number(reader.peek(1))):
            return trapezoid((low - EDGE, low, None, None))
        if how == "at most":
            return trapezoid((None, None, low, low + EDGE))
        high = low
    if reader.peek() in joining and _begins_number(reader, 1):
        reader.at += 1
        high = _value(reader)
    if high is None or high < low:
        raise LibraryError(f"{reader.text!r}: a range goes from the lesser number to the greater, as in 60-80.")
    about = NEAR if high == low else 0.0
    below = (low - about - EDGE, low - about) if low - about > 0 else (None, None)
    above = (high + about, high + about + EDGE) if high + about < 100 else (None, None)
    return trapezoid((*below, *above))


def _is_number(word: str) -> bool:
    return word[:1] in DIGITS and bool(word)


def _begins_number(reader: _Reader, ahead: int = 0) -> bool:
    """Return whether a number begins there. Raises LibraryError for a negative one; "-" only joins two numbers."""
    if reader.peek(ahead) in MINUS and _is_number(reader.peek(ahead + 1)):
        raise _off_scale(reader, -float(reader.peek(ahead + 1)))
    return _is_number(reader.peek(ahead))


def _value(reader: _Reader) -> float:
    result = float(reader.peek())
    reader.at += 1
    reader.at += reader.peek() == "%"
    if not 0 <= result <= 100:
        raise _off_scale(reader, result)
    return result


def _off_scale(reader: _Reader, value: float) -> LibraryError:
    return LibraryError(f"{reader.text!r}: {value:g} is not on the scale, 0 to 100.")


def not_expected(text: str, words: Sequence[str], known: Vocabulary) -> LibraryError:
    """Return the error for an unexpected word, the first of `words`, which are the rest of `text`."""
    return LibraryError(next(_reasons(text, words, known)))


def _reasons(text: str, words: Sequence[str], known: Vocabulary) -> Iterator[str]:
    """Yield the explanations, the most specific first."""
    word = words[0]
    if word == "or":
        yield f"{text!r}: 'or' is not supported; search once for each."
    if word in known.classes:
        yield f"{word!r} is a class, not a feeling: say --class {word}."
    if word in known.foreign:
        have = ", ".join(f"{low}-{high}" for low, high in known.pairs)
        yield f"{word!r}: these textures are not known as {known.foreign[word]} or not, only by {have}."
    if word in LIKENESS:
        yield f"{text!r}: 'find' takes how a texture feels, as 'very rough'. {ASK_NEAREST}"
    if tuple(words[:2]) == ("at", "all"):
        yield f"{text!r}: 'at all' goes with 'not': 'not rough at all', or 'not at all rough'."
    if (comparison := _compared(words, known)) is not None:
        yield f"{comparison} {ASK_NEAREST}"
    if any(phrase[0] == word for phrase in known.degrees):
        yield f"{text!r}: {word!r} cannot stand there; a word of an attribute is expected, as 'rough'."
    close = nearest(word, [" ".join(phrase) for phrase in (*known.words, *known.degrees)])
    if close.startswith("did"):
        yield f"{word!r} is not known. {close[0].upper()}{close[1:]}"
    yield f"{word!r} is not known. {known_words(known)}"


def _compared(words: Sequence[str], known: Vocabulary) -> str | None:
    """Return the message for words that compare textures (rougher, the roughest, more rough); None for other words."""
    for way, instead in COMPARING.items():
        if words[0] == way:
            term = words[1] if (words[1:2] and tuple(words[1:2]) in known.words) else ""
            shown = f"{way} {term}".rstrip()
            return (
                _comparison_message(shown, f"{instead} {term}")
                if term
                else f"{shown!r} compares, and one texture is asked for."
            )
    for phrase in known.words:
        forms = dict(_forms(phrase))
        if words[0] in forms:
            term = " ".join(phrase)
            return _comparison_message(words[0], term, f"{COMPARING[forms[words[0]]]} {term}")
    return None


def _comparison_message(text: str, *instead: str) -> str:
    """Return the message that a comparison is refused, with what to write instead."""
    shown = " or ".join(repr(wish) for wish in instead)
    return f"{text!r} compares, and 'find' takes how a texture feels by itself: say {shown}."


def _forms(phrase: Phrase) -> Iterator[tuple[str, str]]:
    """Yield an English word's comparative and superlative, with the word that compares the same way."""
    if len(phrase) != 1:
        return
    word = phrase[0]
    stem = word[:-1] + "i" if word.endswith("y") else word.removesuffix("e")
    for base in (stem, word + word[-1]):
        yield f"{base}er", "more"
        yield f"{base}est", "most"
