"""What is told of a word that stands where a word of an attribute is expected."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.terms import Phrase, Vocabulary, known_words
from palpate.protocols.did_you_mean import nearest

COMPARING = {"more": "very", "most": "extremely", "less": "not very", "least": "not at all"}
"""Words that compare, and what says something like it of a texture by itself."""
LIKENESS = frozenset(("like", "similar", "same", "as", "than"))
ASK_NEAREST = "What feels like a texture that you know: palpate textures nearest ID."


def not_expected(text: str, words: Sequence[str], known: Vocabulary) -> LibraryError:
    """The error for the first of `words`, the rest of what was said in `text`."""
    return LibraryError(next(_reasons(text, words, known)))


def _reasons(text: str, words: Sequence[str], known: Vocabulary) -> Iterator[str]:
    """What can be said of it, the most particular first."""
    said = words[0]
    if said == "or":
        yield f"{text!r}: 'or' cannot be asked; ask once for each."
    if said in known.classes:
        yield f"{said!r} is a class, not a feeling: say --class {said}."
    if said in known.foreign:
        have = ", ".join(f"{low}-{high}" for low, high in known.pairs)
        yield f"{said!r}: these textures are not known as {known.foreign[said]} or not, only by {have}."
    if said in LIKENESS:
        yield f"{text!r}: 'find' takes how a texture feels, as 'very rough'. {ASK_NEAREST}"
    if tuple(words[:2]) == ("at", "all"):
        yield f"{text!r}: 'at all' goes with 'not': 'not rough at all', or 'not at all rough'."
    if (told := _compared(words, known)) is not None:
        yield f"{told} {ASK_NEAREST}"
    if any(phrase[0] == said for phrase in known.degrees):
        yield f"{text!r}: {said!r} cannot stand there; a word of an attribute is expected, as 'rough'."
    close = nearest(said, [" ".join(phrase) for phrase in (*known.words, *known.degrees)])
    if close.startswith("did"):
        yield f"{said!r} is not known. {close[0].upper()}{close[1:]}"
    yield f"{said!r} is not known. {known_words(known)}"


def _compared(words: Sequence[str], known: Vocabulary) -> str | None:
    """What to say instead, where words compare one texture with another: rougher, the roughest, more rough."""
    for way, instead in COMPARING.items():
        if words[0] == way:
            term = words[1] if (words[1:2] and tuple(words[1:2]) in known.words) else ""
            shown = f"{way} {term}".rstrip()
            return _told(shown, f"{instead} {term}") if term else f"{shown!r} compares, and one texture is asked for."
    for phrase in known.words:
        forms = dict(_forms(phrase))
        if words[0] in forms:
            term = " ".join(phrase)
            return _told(words[0], term, f"{COMPARING[forms[words[0]]]} {term}")
    return None


def _told(said: str, *instead: str) -> str:
    """A comparison has no texture to begin from, so that each wish is of one texture by itself."""
    shown = " or ".join(repr(each) for each in instead)
    return f"{said!r} compares, and 'find' takes how a texture feels by itself: say {shown}."


def _forms(phrase: Phrase) -> Iterator[tuple[str, str]]:
    """An English word's comparative and superlative, with the word that compares the same way."""
    if len(phrase) != 1:
        return
    word = phrase[0]
    stem = word[:-1] + "i" if word.endswith("y") else word.removesuffix("e")
    for one in (stem, word + word[-1]):
        yield f"{one}er", "more"
        yield f"{one}est", "most"
