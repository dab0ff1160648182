"""Which textures share content, so that no split may divide them: the same files, or an equal segment or picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.attributes.material import Rows, Texture
from palpate.signals.arrays import Array

SAME = 1e-5
"""Rows that differ by less, relative to their greatest number, are equal: a file may have been rounded on its way."""
DIGITS = 4
"""Coarser than `SAME`: what counts as equal between textures must not count as different within a blank row."""
HAND = "hand"
"""How the hand moved and pressed tells nothing of the texture: a robot does the same to all of them."""
Owners = list[tuple[str, NDArray[np.float32]]]


def groups_of(textures: Sequence[Texture]) -> tuple[tuple[str, ...], ...]:
    """The groups, each in alphabetical order, sorted by their first names; most hold one texture.

    Textures are joined that share a file (`made_from`), or a row of one kind of feature: of a segment, of a picture or
    of a variant of one. What is blank (silence, a black picture) is nobody's, in none of its kinds of features; nor is
    how the hand moved, where there is anything else.
    """
    parent = {each.id: each.id for each in textures}
    for one, other in (*_by_files(textures), *_by_rows(textures)):
        parent[_root(parent, one)] = _root(parent, other)
    found: dict[str, list[str]] = {}
    for name in sorted(parent):
        found.setdefault(_root(parent, name), []).append(name)
    return tuple(sorted(map(tuple, found.values())))


def _root(parent: dict[str, str], name: str) -> str:
    while parent[name] != name:
        parent[name] = parent[parent[name]]
        name = parent[name]
    return name


def _by_files(textures: Sequence[Texture]) -> Iterator[tuple[str, str]]:
    first: dict[str, str] = {}
    for each in textures:
        for digest in sorted(each.made_from):
            yield first.setdefault(digest, each.id), each.id


def _by_rows(textures: Sequence[Texture]) -> Iterator[tuple[str, str]]:
    """Pairs of textures with an equal row, for each kind of feature."""
    telling = [(each.id, _telling(each)) for each in textures]
    for kind in sorted({kind for _, rows in telling for kind in rows}):
        yield from _equal([(name, row) for name, rows in telling for each in rows.get(kind, ()) for row in each])


def _telling(texture: Texture) -> dict[str, list[Rows]]:
    """A texture's rows by kind, without those of what is blank; pictures and their variants are compared together."""
    touch = {kind: rows for kind, rows in texture.touch.items() if kind != HAND or len(texture.touch) == 1}
    seen, varied = _blanks(texture.sight), _blanks(texture.variants)
    if len(seen) and len(varied) % len(seen) == 0:
        varied = varied | np.resize(seen, len(varied))  # a version of a black picture shows its noise alone
    found: dict[str, list[Rows]] = {}
    for rows, blank in ((touch, _blanks(touch)), (texture.sight, seen), (texture.variants, varied)):
        for kind, each in rows.items():
            found.setdefault(kind, []).append(each[~blank])
    return found


def _blanks(kinds: Mapping[str, Rows]) -> NDArray[np.bool_]:
    """Which segments or pictures are blank: one kind of feature that says so is enough.

    A black picture's co-occurrence has one number; what a network makes of it has many, all of them the network's own.
    """
    each = [np.array([_blank(row) for row in rows], dtype=bool) for rows in kinds.values()]
    return np.logical_or.reduce(each) if each else np.zeros(0, dtype=bool)


def _blank(row: NDArray[np.float32]) -> bool:
    """At most two different numbers, as `_same` tells numbers apart: nothing was felt or seen."""
    greatest = float(np.max(np.abs(row), initial=0.0))
    return greatest == 0.0 or len(np.unique(np.round(row / greatest, DIGITS))) <= 2


def _equal(owners: Owners) -> Iterator[tuple[str, str]]:
    """Neighbours on a line that rows are projected to are compared as a whole: a look at each pair would take long."""
    by_size: dict[int, Owners] = {}
    for name, row in owners:
        by_size.setdefault(len(row), []).append((name, row))
    for size, own in by_size.items():
        places, reach = _projected([row for _, row in own], size)
        order = np.argsort(places, kind="stable")
        for i, at in enumerate(order):
            for other in order[i + 1 :]:
                if places[other] - places[at] > reach[at]:
                    break
                if own[at][0] != own[other][0] and _same(own[at][1], own[other][1]):
                    yield own[at][0], own[other][0]


def _projected(rows: Sequence[NDArray[np.float32]], size: int) -> tuple[Array, Array]:
    """Each row's place on a drawn line, and how far an equal row may lie from it: six SDs of what rounding does."""
    line = np.random.Generator(np.random.PCG64(size)).standard_normal(size)
    table = np.stack(rows).astype(np.float64)
    reach: Array = SAME * np.abs(table).max(axis=1) * 6.0 * float(np.linalg.norm(line))
    return table @ line, reach


def _same(one: NDArray[np.float32], other: NDArray[np.float32]) -> bool:
    greatest = float(max(np.max(np.abs(one)), np.max(np.abs(other))))
    return bool(np.max(np.abs(one.astype(np.float64) - other)) <= SAME * greatest)
