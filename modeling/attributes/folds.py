"""Leave one texture out: folds in which nothing of the tested texture was learned from (thesis 3.6.4)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.attributes.material import FeatureRows, Material, MaterialError, Texture
from palpate.protocols.wording import some
from palpate.signals.arrays import Array

HELD = 0.1
"""The share of the training side that a network watches to stop early."""
SOME = 5
"""Tells `sample_textures`'s chance from others of the same seed."""
LEAST = 3
"""Groups of textures that are needed: one to ask about, one to learn from, one to watch."""
SAME = 1e-5
"""Rows that differ by less, relative to their greatest number, are equal: a file may have been rounded on its way."""
DIGITS = 4
"""Coarser than `SAME`: what counts as equal between textures must not count as different within a blank row."""
HAND = "hand"
"""How the hand moved and pressed tells nothing of the texture: a robot does the same to all of them."""
Owners = list[tuple[str, NDArray[np.float32]]]


@dataclass(frozen=True)
class Fold:
    """One texture left out. `train` and `held` are the others, by name and in alphabetical order; `apart` are those
    that share content with the tested one and stand on neither side."""

    test: str
    train: tuple[str, ...]
    held: tuple[str, ...]
    apart: tuple[str, ...] = ()

    @property
    def known(self) -> tuple[str, ...]:
        """All that may be learned from, for a method that does not ask for `held`."""
        return tuple(sorted((*self.train, *self.held)))


def leave_one_texture_out(
    material: Material, seed: int = 0, share: float = HELD, only: Sequence[str] | None = None
) -> tuple[Fold, ...]:
    """Return a fold for each texture (or for those named by `only`), in the material's order; all of them rated.

    Textures that share content (`made_from`, or an equal row of a segment or a picture) are one group, and no group is
    divided. About `share` of the training side is held for early stopping: whole groups, in turn from each class, drawn
    by the seed and the tested texture's name. The order of textures and rows decides nothing. Raises MaterialError for
    too few groups, a share outside 0..0.5, a name that is none, or a texture that was not rated.
    """
    if not 0 <= share <= 0.5:
        raise MaterialError(f"the share that is held is {share:g}; 0 to 0.5 is expected.")
    missing = [texture.id for texture in material.textures if texture.rated is None]
    if missing:
        raise MaterialError(f"{missing[0]} was not rated: take Material.rated() of it.")
    groups = groups_of(material.textures)
    if len(groups) < LEAST:
        raise MaterialError(
            f"leaving one texture out needs at least {LEAST} that share no recording and no picture; there are "
            f"{len(groups)} of {len(material.textures)} textures. Record and rate more."
        )
    tested = material.ids if only is None else tuple(only)
    unknown = [name for name in tested if name not in material.ids]
    if unknown:
        raise MaterialError(f"no texture {unknown[0]!r} can be left out: there are {some(material.ids)}.")
    classes = {texture.id: texture.category for texture in material.textures}
    folds = []
    for test in tested:
        own = next(group for group in groups if test in group)
        apart = tuple(name for name in own if name != test)
        others = [group for group in groups if group is not own]
        folds.append(_split(test, apart, others, classes, _chance(seed, test), share))
    return tuple(folds)


def whole_fold(material: Material, seed: int = 0, share: float = HELD) -> Fold:
    """Return every rated texture, nothing left out: what a model that is to be used learns from and what it watches."""
    groups = groups_of(material.textures)
    classes = {texture.id: texture.category for texture in material.textures}
    return _split("", (), groups, classes, _chance(seed, ""), share)


def _split(
    test: str, apart: tuple[str, ...], others: Sequence[tuple[str, ...]], classes: Mapping[str, str],
    chance: np.random.Generator, share: float,
) -> Fold:  # fmt: skip
    # hold groups out until the share is reached, one class after the other; one group stays to learn from
    goal = max(1, round(share * sum(map(len, others)))) if share > 0 else 0
    held: list[tuple[str, ...]] = []
    for group in _in_turn(others, classes, chance):
        short = goal - sum(map(len, held))
        if short > 0 and len(held) < len(others) - 1 and (len(group) <= short or not held):
            held.append(group)
    train = sorted(name for group in others if group not in held for name in group)
    return Fold(test, tuple(train), tuple(sorted(name for group in held for name in group)), apart)


def _chance(seed: int, test: str) -> np.random.Generator:
    """Return its own for each tested texture, whatever stands beside it."""
    named = int.from_bytes(sha256(test.encode()).digest()[:8], "big")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, named])))


def _in_turn(
    groups: Sequence[tuple[str, ...]], classes: Mapping[str, str], chance: np.random.Generator
) -> list[tuple[str, ...]]:
    """Return all groups: a first one of each class in a drawn order of the classes, then a second one, and so on.

    Classes of a single group come last in each turn, so that a class is seldom missing from what is learned.
    """
    by_class: dict[str, list[tuple[str, ...]]] = {}
    for group in sorted(groups):
        by_class.setdefault(classes[group[0]], []).append(group)
    order = [sorted(by_class)[place] for place in chance.permutation(len(by_class))]
    shuffled = {name: [by_class[name][i] for i in chance.permutation(len(by_class[name]))] for name in order}
    turns = [(turn, len(shuffled[name]) == 1, place, group)
             for place, name in enumerate(order) for turn, group in enumerate(shuffled[name])]  # fmt: skip
    return [group for *_, group in sorted(turns, key=lambda turn: turn[:3])]


def sample_textures(classes: Mapping[str, str], count: int, seed: int = 0) -> tuple[str, ...]:
    """So many of these textures (class by name), in turn from each class, drawn by the seed; in alphabetical order.

    The fewer are among the more. Raises MaterialError for less than one.
    """
    if count < 1:
        raise MaterialError(f"{count} textures to leave out: at least one is expected.")
    chance = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, SOME])))
    order = _in_turn([(name,) for name in classes], classes, chance)
    return tuple(sorted(name for (name,) in order[:count]))


def groups_of(textures: Sequence[Texture]) -> tuple[tuple[str, ...], ...]:
    """Return the groups, each in alphabetical order, sorted by their first names; most hold one texture.

    Textures are joined that share a file (`made_from`), or a row of one kind of feature: of a segment, of a picture or
    of a variant of one. Blank rows (silence, a black picture) do not count, in any kind of feature; nor does how the
    hand moved, where there is anything else.
    """
    parent = {texture.id: texture.id for texture in textures}
    first: dict[str, str] = {}
    by_files = [
        (first.setdefault(digest, texture.id), texture.id)
        for texture in textures
        for digest in sorted(texture.made_from)
    ]
    for one, other in (*by_files, *_by_rows(textures)):
        parent[_root(parent, one)] = _root(parent, other)
    names_by_root: dict[str, list[str]] = {}
    for name in sorted(parent):
        names_by_root.setdefault(_root(parent, name), []).append(name)
    return tuple(sorted(map(tuple, names_by_root.values())))


def _root(parent: dict[str, str], name: str) -> str:
    while parent[name] != name:
        parent[name] = parent[parent[name]]
        name = parent[name]
    return name


def _by_rows(textures: Sequence[Texture]) -> Iterator[tuple[str, str]]:
    """Yield pairs of textures with an equal row, for each kind of feature."""
    telling = [(texture.id, _counting_rows(texture)) for texture in textures]
    for kind in sorted({kind for _, rows in telling for kind in rows}):
        yield from _equal_pairs(
            [(name, row) for name, rows in telling for row_set in rows.get(kind, ()) for row in row_set]
        )


def _counting_rows(texture: Texture) -> dict[str, list[FeatureRows]]:
    """A texture's rows by kind, without those of what is blank; pictures and their variants are compared together."""
    touch = {kind: rows for kind, rows in texture.touch.items() if kind != HAND or len(texture.touch) == 1}
    seen, varied = _blanks(texture.sight), _blanks(texture.variants)
    if len(seen) and len(varied) % len(seen) == 0:
        varied = varied | np.resize(seen, len(varied))  # a version of a black picture shows its noise alone
    result: dict[str, list[FeatureRows]] = {}
    for rows, blank in ((touch, _blanks(touch)), (texture.sight, seen), (texture.variants, varied)):
        for kind, row_set in rows.items():
            result.setdefault(kind, []).append(row_set[~blank])
    return result


def _blanks(kinds: Mapping[str, FeatureRows]) -> NDArray[np.bool_]:
    """Return which segments or pictures are blank: one kind of feature that says so is enough.

    A black picture's co-occurrence has one number; what a network makes of it has many, all of them the network's own.
    """
    marks = [np.array([_blank(row) for row in rows], dtype=bool) for rows in kinds.values()]
    return np.logical_or.reduce(marks) if marks else np.zeros(0, dtype=bool)


def _blank(row: NDArray[np.float32]) -> bool:
    """Return whether a row has at most two different numbers up to rounding, as silence or a black picture has."""
    greatest = float(np.max(np.abs(row), initial=0.0))
    return greatest == 0.0 or len(np.unique(np.round(row / greatest, DIGITS))) <= 2


def _equal_pairs(owners: Owners) -> Iterator[tuple[str, str]]:
    """Yield pairs of owners of equal rows; only neighbours on a random projection are compared, which saves time."""
    by_size: dict[int, Owners] = {}
    for name, row in owners:
        by_size.setdefault(len(row), []).append((name, row))
    for size, own in by_size.items():
        places, reach = _projections([row for _, row in own], size)
        order = np.argsort(places, kind="stable")
        for i, at in enumerate(order):
            for other in order[i + 1 :]:
                if places[other] - places[at] > reach[at]:
                    break
                if own[at][0] != own[other][0] and _same(own[at][1], own[other][1]):
                    yield own[at][0], own[other][0]


def _projections(rows: Sequence[NDArray[np.float32]], size: int) -> tuple[Array, Array]:
    """Return each row's place on a random line, and the reach of equal rows: six SDs of their rounding."""
    line = np.random.Generator(np.random.PCG64(size)).standard_normal(size)
    table = np.stack(rows).astype(np.float64)
    reach: Array = SAME * np.abs(table).max(axis=1) * 6.0 * float(np.linalg.norm(line))
    return table @ line, reach


def _same(one: NDArray[np.float32], other: NDArray[np.float32]) -> bool:
    greatest = float(max(np.max(np.abs(one)), np.max(np.abs(other))))
    return bool(np.max(np.abs(one.astype(np.float64) - other)) <= SAME * greatest)
