"""Search the library: the textures that fit wishes, those nearest to a texture, and the wishes that exclude most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.modeling.evaluate.intervals import JND
from palpate.modeling.library.entries import Entry, Kind, Library, LibraryError, belief, is_known, value_of
from palpate.modeling.library.terms import normal, vocabulary
from palpate.modeling.library.wishes import Wish, combined, wishes_in
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import some

FITS = 0.005
"""The fit from which a texture counts as fitting."""
ALIKE = 3
"""Decimals of a fit that count for the order; among equal fits the texture furthest towards the wishes comes first."""


@dataclass(frozen=True)
class Match:
    """A texture, its fit (0 to 1), and its fit to each wish alone."""

    entry: Entry
    fit: float
    fits_by_wish: tuple[float, ...]


def wishes_of(library: Library, texts: Sequence[str]) -> tuple[Wish, ...]:
    """Return the wishes in these texts, in this library's vocabulary. Raises LibraryError for an unknown word."""
    return wishes_in(texts, vocabulary(library.attributes, (texture.category for texture in library.textures)))


def find(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> list[Match]:
    """Return all textures, the best first; of equal fits the one furthest towards the wishes, then by name.

    The fit is the product, over the attributes of the wishes, of the expected membership of a normal variable with the
    attribute's value and SD; those of `NOTHING_KNOWN` for an unknown attribute.
    """
    together = combined(wishes)
    ranked = []
    for entry in entries:
        fits = [soft.expected(*belief(value_of(entry, pair, kind))) for pair, soft in together]
        fits_by_wish = tuple(wish.soft.expected(*belief(value_of(entry, wish.pair, kind))) for wish in wishes)
        short = sum(soft.short_of(belief(value_of(entry, pair, kind))[0]) for pair, soft in together)
        ranked.append((short, Match(entry, math.prod(fits), fits_by_wish)))
    ranked.sort(key=lambda item: (-round(item[1].fit, ALIKE), item[0], item[1].entry.id))
    return [match for _, match in ranked]


def fitting(matches: Sequence[Match], count: int) -> list[Match]:
    """Return the best `count` of the textures that fit (`FITS`)."""
    return [match for match in matches if match.fit >= FITS][:count]


def select_textures(library: Library, classes: Sequence[str] = (), kind: Kind | None = None) -> tuple[Entry, ...]:
    """Return the textures of these classes (all, if none are given) with values of this kind.

    Raises LibraryError for an unknown class, and where no texture remains.
    """
    there = {texture.category.lower(): texture.category for texture in library.textures}
    for name in classes:
        if name.lower() not in there:
            raise LibraryError(f"no class {name!r} in this library; {nearest(name.lower(), there.values())}")
    names = {name.lower() for name in classes} or set(there)
    result = tuple(
        texture for texture in library.textures if texture.category.lower() in names and is_known(texture, kind)
    )
    if not result:
        how = {None: "", "rated": " that people rated", "predicted": " that a model predicted"}[kind]
        raise LibraryError(f"no texture{how} among the {len(library.textures)} of this library fits.")
    return result


def find_texture(library: Library, name: str) -> Entry:
    """Return the texture with this id, or else with this label; upper and lower case are equal.

    Raises LibraryError where there is none, and for a label of several textures.
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


def require_known(entry: Entry, kind: Kind | None) -> Entry:
    """Return the texture. Raises LibraryError unless it has values of this kind."""
    if is_known(entry, kind):
        return entry
    how = {None: "nothing is known of it", "rated": "nobody rated it", "predicted": "no model predicted it"}[kind]
    raise LibraryError(f"{entry.id}: {how}, so how it feels is unknown.")


@dataclass(frozen=True)
class Excluded:
    """The number of textures that a wish excludes by itself, and that fit all other wishes (None: no other wishes)."""

    text: str
    out: int
    without: int | None


def exclusions(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> list[Excluded]:
    """Return the exclusions of each wish, in the order of the wishes; those of one text count as one wish."""
    result = []
    for text in dict.fromkeys(wish.text for wish in wishes):
        own, others = [wish for wish in wishes if wish.text == text], [wish for wish in wishes if wish.text != text]
        out = len(entries) - _fit(entries, own, kind)
        result.append(Excluded(text, out, _fit(entries, others, kind) if others else None))
    return result


def none_fits(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> str:
    """Return the message that no texture fits, with the wish that excludes most, and the wish to give up."""
    every = exclusions(entries, wishes, kind)
    whole, most = len(entries), max(wish.out for wish in every)
    text = f"None of {whole} textures fits."
    if len(every) > 1 and most == 0:
        text += " Each wish alone leaves out none; all at once, none is left."
    elif len(every) > 1:
        names = [repr(wish.text) for wish in every if wish.out == most]
        text += f" Most are left out by {' and '.join(names)}: {most} of {whole}{' each' if len(names) > 1 else ''}."
    helps = max(every, key=lambda wish: wish.without or 0)
    if helps.without:
        text += f" Without {helps.text!r}, {helps.without} would fit."
    elif len(every) > 2:
        text += " Giving up one wish does not help."
    return text


def _fit(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None) -> int:
    return len(fitting(find(entries, wishes, kind), len(entries)))


@dataclass(frozen=True)
class Near:
    """A texture with its distance in JNDs, the SD of the distance, the signed differences in JNDs by attribute, and
    the probability that no attribute differs by a JND."""

    entry: Entry
    distance: float
    sd: float
    apart: tuple[float, ...]
    alike: float


def near(entry: Entry, others: Sequence[Entry], attributes: int, kind: Kind | None = None) -> list[Near]:
    """Return all other textures, the nearest first; at equal distances by name."""
    neighbours = [distance_between(entry, other, attributes, kind) for other in others if other.id != entry.id]
    return sorted(neighbours, key=lambda neighbour: (neighbour.distance, neighbour.sd, neighbour.entry.id))


def distance_between(entry: Entry, other: Entry, attributes: int, kind: Kind | None = None) -> Near:
    """Return the distance of two textures: the root mean square of the differences, in JNDs of 10 on 0..100.

    Its SD follows from that of the mean square by the delta method about its expected value: for a difference d with SD
    s, d^2 has the variance 2 s^4 + 4 d^2 s^2. `alike` is the probability that every attribute differs by less than one
    JND, if the errors of the attributes are independent.
    """
    own, theirs = ([belief(value_of(texture, at, kind)) for at in range(attributes)] for texture in (entry, other))
    apart = [(there[0] - here[0]) / JND for here, there in zip(own, theirs, strict=True)]
    sds = [math.hypot(here[1], there[1]) / JND for here, there in zip(own, theirs, strict=True)]
    expected = math.sqrt(sum(d * d + s * s for d, s in zip(apart, sds, strict=True)) / attributes)
    variance = sum(2 * s**4 + 4 * d * d * s * s for d, s in zip(apart, sds, strict=True)) / attributes**2
    alike = math.prod(_within(d, s) for d, s in zip(apart, sds, strict=True))
    distance, sd = math.sqrt(sum(d * d for d in apart) / attributes), math.sqrt(variance)
    return Near(other, distance, sd / (2 * expected) if expected else 0.0, tuple(apart), alike)


def _within(difference: float, sd: float) -> float:
    """Return the probability that a normal variable with this mean and SD lies between -1 and 1."""
    if sd == 0:
        return float(abs(difference) < 1)
    return normal((1 - difference) / sd) - normal((-1 - difference) / sd)
