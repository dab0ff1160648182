"""Which textures feel as wished, the best first, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.modeling.library.asking import Wish, combined, wishes_in
from palpate.modeling.library.entries import Entry, Kind, Library, LibraryError, belief, felt, known
from palpate.modeling.library.terms import vocabulary
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import some

FITS = 0.005
"""Below this share a texture does not fit at all."""
ALIKE = 3
"""Decimals of a fit that count: of what differs by less the texture that goes further towards the wish comes first."""


@dataclass(frozen=True)
class Found:
    """A texture, its fit between 0 and 1, and that to each wish alone."""

    entry: Entry
    fit: float
    each: tuple[float, ...]


def wishes_of(library: Library, texts: Sequence[str]) -> tuple[Wish, ...]:
    """What is wished for in these words of this library. Raises LibraryError for what is not understood."""
    return wishes_in(texts, vocabulary(library.attributes, (each.category for each in library.textures)))


def find(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> list[Found]:
    """All of the textures, the best first; of those that fit alike the one that goes furthest, then by name.

    A texture's fit is the product, over the attributes that were spoken of, of the membership to expect of an attribute
    that is normal about its value. Of an attribute that is not known, any value may be so.
    """
    together = combined(wishes)
    found = []
    for entry in entries:
        fits = [soft.expected(*belief(felt(entry, pair, kind))) for pair, soft in together]
        each = tuple(wish.soft.expected(*belief(felt(entry, wish.pair, kind))) for wish in wishes)
        short = sum(soft.short_of(belief(felt(entry, pair, kind))[0]) for pair, soft in together)
        found.append((short, Found(entry, math.prod(fits), each)))
    found.sort(key=lambda one: (-round(one[1].fit, ALIKE), one[0], one[1].entry.id))
    return [one for _, one in found]


def fitting(found: Sequence[Found], count: int) -> list[Found]:
    """The best few of those that fit at all."""
    return [each for each in found if each.fit >= FITS][:count]


def chosen(library: Library, classes: Sequence[str] = (), kind: Kind | None = None) -> tuple[Entry, ...]:
    """The textures of these classes that something is known of.

    Raises LibraryError for a class that there is not, and where none is left.
    """
    there = {each.category.lower(): each.category for each in library.textures}
    for name in classes:
        if name.lower() not in there:
            raise LibraryError(f"no class {name!r} in this library; {nearest(name.lower(), there.values())}")
    wanted = {name.lower() for name in classes} or set(there)
    found = tuple(each for each in library.textures if each.category.lower() in wanted and known(each, kind))
    if not found:
        how = {None: "", "rated": " that people rated", "predicted": " that a model predicted"}[kind]
        raise LibraryError(f"no texture{how} among the {len(library.textures)} of this library as asked.")
    return found


def named(library: Library, name: str) -> Entry:
    """The texture of this id, or else of this label, in capitals or not.

    Raises LibraryError where there is none, and for a label that several have.
    """
    wanted = name.lower()
    for each in library.textures:
        if wanted == each.id.lower():
            return each
    found = [each for each in library.textures if wanted == each.label.lower()]
    if len(found) > 1:
        raise LibraryError(f"{len(found)} textures are called {name!r}: {some(each.id for each in found)}. Say which.")
    if found:
        return found[0]
    names = [text for each in library.textures for text in (each.id, each.label)]
    raise LibraryError(f"no texture {name!r} in this library; {nearest(name, names)}")


def known_of(entry: Entry, kind: Kind | None) -> Entry:
    """The texture, if anything is known of it in this way. Raises LibraryError otherwise: nothing is near to it."""
    if known(entry, kind):
        return entry
    how = {None: "nothing is known of it", "rated": "nobody rated it", "predicted": "no model predicted it"}[kind]
    raise LibraryError(f"{entry.id}: {how}, so nothing can be said of how it feels.")
