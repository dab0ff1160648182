"""Search the library: the textures that feel as wished, those nearest to one, and the wishes that exclude most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.modeling.doors.scores import JND
from palpate.modeling.library.entries import Entry, Kind, Library, LibraryError, belief, known, value_of
from palpate.modeling.library.terms import normal, vocabulary
from palpate.modeling.library.wishes import Wish, combined, wishes_in
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import some

FITS = 0.005
"""Below this share a texture does not fit at all."""
ALIKE = 3
"""Decimals of a fit that count: of what differs by less the texture that goes further towards the wish comes first."""


@dataclass(frozen=True)
class Match:
    """A texture, its fit between 0 and 1, and that to each wish alone."""

    entry: Entry
    fit: float
    each: tuple[float, ...]


def wishes_of(library: Library, texts: Sequence[str]) -> tuple[Wish, ...]:
    """Return what is wished for in these words of this library. Raises LibraryError for what is not understood."""
    return wishes_in(texts, vocabulary(library.attributes, (texture.category for texture in library.textures)))


def find(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> list[Match]:
    """Return all of the textures, the best first; of those that fit alike the one that goes furthest, then by name.

    A texture's fit is the product, over the attributes that were spoken of, of the membership to expect of an attribute
    that is normal about its value. Of an attribute that is not known, any value may be so.
    """
    together = combined(wishes)
    ranked = []
    for entry in entries:
        fits = [soft.expected(*belief(value_of(entry, pair, kind))) for pair, soft in together]
        fits_by_wish = tuple(wish.soft.expected(*belief(value_of(entry, wish.pair, kind))) for wish in wishes)
        short = sum(soft.short_of(belief(value_of(entry, pair, kind))[0]) for pair, soft in together)
        ranked.append((short, Match(entry, math.prod(fits), fits_by_wish)))
    ranked.sort(key=lambda one: (-round(one[1].fit, ALIKE), one[0], one[1].entry.id))
    return [one for _, one in ranked]


def fitting(matches: Sequence[Match], count: int) -> list[Match]:
    """Return the best few of those that fit at all."""
    return [match for match in matches if match.fit >= FITS][:count]


def chosen(library: Library, classes: Sequence[str] = (), kind: Kind | None = None) -> tuple[Entry, ...]:
    """Return the textures of these classes that something is known of.

    Raises LibraryError for a class that there is not, and where none is left.
    """
    there = {texture.category.lower(): texture.category for texture in library.textures}
    for name in classes:
        if name.lower() not in there:
            raise LibraryError(f"no class {name!r} in this library; {nearest(name.lower(), there.values())}")
    names = {name.lower() for name in classes} or set(there)
    result = tuple(
        texture for texture in library.textures if texture.category.lower() in names and known(texture, kind)
    )
    if not result:
        how = {None: "", "rated": " that people rated", "predicted": " that a model predicted"}[kind]
        raise LibraryError(f"no texture{how} among the {len(library.textures)} of this library fits.")
    return result


def named(library: Library, name: str) -> Entry:
    """Return the texture of this id, or else of this label, in capitals or not.

    Raises LibraryError where there is none, and for a label that several have.
    """
    key = name.lower()
    for texture in library.textures:
        if key == texture.id.lower():
            return texture
    textures = [texture for texture in library.textures if key == texture.label.lower()]
    if len(textures) > 1:
        raise LibraryError(
            f"{len(textures)} textures are called {name!r}: {some(texture.id for texture in textures)}. Say which."
        )
    if textures:
        return textures[0]
    names = [text for texture in library.textures for text in (texture.id, texture.label)]
    raise LibraryError(f"no texture {name!r} in this library; {nearest(name, names)}")


def known_of(entry: Entry, kind: Kind | None) -> Entry:
    """The texture, if anything is known of it in this way. Raises LibraryError otherwise: nothing is near to it."""
    if known(entry, kind):
        return entry
    how = {None: "nothing is known of it", "rated": "nobody rated it", "predicted": "no model predicted it"}[kind]
    raise LibraryError(f"{entry.id}: {how}, so how it feels is unknown.")


@dataclass(frozen=True)
class Excluded:
    """How many textures a wish leaves out by itself, and how many fit all the others (None: there are no others)."""

    said: str
    out: int
    without: int | None


def excluded(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> list[Excluded]:
    """What each wish leaves out, in the order in which they were said; what was said in one breath is one wish."""
    result = []
    for text in dict.fromkeys(wish.said for wish in wishes):
        own, others = [wish for wish in wishes if wish.said == text], [wish for wish in wishes if wish.said != text]
        out = len(entries) - _fit(entries, own, kind)
        result.append(Excluded(text, out, _fit(entries, others, kind) if others else None))
    return result


def none_fits(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> str:
    """In words that none of the textures fits, which wish leaves out most of them, and what would help."""
    every = excluded(entries, wishes, kind)
    whole, most = len(entries), max(wish.out for wish in every)
    text = f"None of {whole} textures fits."
    if len(every) > 1 and most == 0:
        text += " Each wish alone leaves out none; all at once, none is left."
    elif len(every) > 1:
        names = [repr(wish.said) for wish in every if wish.out == most]
        text += f" Most are left out by {' and '.join(names)}: {most} of {whole}{' each' if len(names) > 1 else ''}."
    helps = max(every, key=lambda wish: wish.without or 0)
    if helps.without:
        text += f" Without {helps.said!r}, {helps.without} would fit."
    elif len(every) > 2:
        text += " Giving up one wish does not help."
    return text


def _fit(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None) -> int:
    return len(fitting(find(entries, wishes, kind), len(entries)))


@dataclass(frozen=True)
class Near:
    """A texture, how far it is in JNDs (with an SD), by attribute with a sign, and how likely nobody could tell."""

    entry: Entry
    distance: float
    sd: float
    apart: tuple[float, ...]
    alike: float


def near(entry: Entry, others: Sequence[Entry], attributes: int, kind: Kind | None = None) -> list[Near]:
    """Return all other textures, the nearest first; equal ones by name."""
    neighbours = [measured(entry, other, attributes, kind) for other in others if other.id != entry.id]
    return sorted(neighbours, key=lambda neighbour: (neighbour.distance, neighbour.sd, neighbour.entry.id))


def measured(entry: Entry, other: Entry, attributes: int, kind: Kind | None = None) -> Near:
    """Return how far two textures are apart: the root of the mean square of the differences, in JNDs of 10 on 0..100.

    Its SD is that of the mean square, through the delta method about what is to be expected of it: for a difference d
    that is known with an SD s, d^2 has the variance 2 s^4 + 4 d^2 s^2. `alike` is the probability that each attribute
    differs by less than one JND, if the attributes err independently.
    """
    ones, twos = ([belief(value_of(texture, at, kind)) for at in range(attributes)] for texture in (entry, other))
    apart = [(two[0] - one[0]) / JND for one, two in zip(ones, twos, strict=True)]
    unsure = [math.hypot(one[1], two[1]) / JND for one, two in zip(ones, twos, strict=True)]
    expected = math.sqrt(sum(d * d + s * s for d, s in zip(apart, unsure, strict=True)) / attributes)
    variance = sum(2 * s**4 + 4 * d * d * s * s for d, s in zip(apart, unsure, strict=True)) / attributes**2
    alike = math.prod(_within(d, s) for d, s in zip(apart, unsure, strict=True))
    distance, sd = math.sqrt(sum(d * d for d in apart) / attributes), math.sqrt(variance)
    return Near(other, distance, sd / (2 * expected) if expected else 0.0, tuple(apart), alike)


def _within(difference: float, sd: float) -> float:
    """Return the probability that a normal difference lies within one of zero."""
    if sd == 0:
        return float(abs(difference) < 1)
    return normal((1 - difference) / sd) - normal((-1 - difference) / sd)
