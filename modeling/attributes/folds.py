"""Leave one texture out: folds whose training data share nothing with the tested texture (thesis 3.6.4)."""

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
"""Distinguishes the random numbers of `sample_textures` from others of the same seed."""
LEAST = 3
"""The least number of groups of textures: one to test, one to learn from, one to watch."""
SAME = 1e-5
"""The difference, relative to the greatest number, below which rows are equal: a file may have been rounded."""
DIGITS = 4
"""Decimals that count within a blank row: coarser than `SAME`, so that equal rows are equally blank."""
HAND = "hand"
"""Features of the hand's motion and force, which do not identify a texture: a robot moves alike on all of them."""
Owners = list[tuple[str, NDArray[np.float32]]]


@dataclass(frozen=True)
class Fold:
    """A fold that tests one texture. `train` and `held` are the others, sorted by name; `apart` are textures that share
    content with the tested one and are on neither side."""

    test: str
    train: tuple[str, ...]
    held: tuple[str, ...]
    apart: tuple[str, ...] = ()

    @property
    def known(self) -> tuple[str, ...]:
        """All textures to learn from, for a method that does not watch held ones."""
        return tuple(sorted((*self.train, *self.held)))


def leave_one_texture_out(
    material: Material, seed: int = 0, share: float = HELD, only: Sequence[str] | None = None
) -> tuple[Fold, ...]:
    """Return a fold for each texture, or for those in `only`, in the material's order.

    Textures that share content (`made_from`, or an equal row of a segment or a picture) are one group, and no group is
    divided. About `share` of the training side is held for early stopping: whole groups, in turn from each class, drawn
    by the seed and the tested texture's name. The order of textures and rows does not matter. Raises MaterialError for
    too few groups, a share outside 0..0.5, an unknown name, or a texture without ratings.
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
    """Return a fold without a tested texture, for the training of a lab's model."""
    groups = groups_of(material.textures)
    classes = {texture.id: texture.category for texture in material.textures}
    return _split("", (), groups, classes, _chance(seed, ""), share)


def _split(
    test: str, apart: tuple[str, ...], others: Sequence[tuple[str, ...]], classes: Mapping[str, str],
    chance: np.random.Generator, share: float,
) -> Fold:  # fmt: skip
    """Return a fold: groups are held out, one class after the other, up to the share; one group stays to learn from."""
    goal = max(1, round(share * sum(map(len, others)))) if share > 0 else 0
    held: list[tuple[str, ...]] = []
    for group in _in_turn(others, classes, chance):
        short = goal - sum(map(len, held))
        if short > 0 and len(held) < len(others) - 1 and (len(group) <= short or not held):
            held.append(group)
    train = sorted(name for group in others if group not in held for name in group)
    return Fold(test, tuple(train), tuple(sorted(name for group in held for name in group)), apart)


def _chance(seed: int, test: str) -> np.random.Generator:
    """Return the random generator of a tested texture, which depends on the seed and its name alone."""
    number = int.from_bytes(sha256(test.encode()).digest()[:8], "big")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, number])))


def _in_turn(
    groups: Sequence[tuple[str, ...]], classes: Mapping[str, str], chance: np.random.Generator
) -> list[tuple[str, ...]]:
    """Return all groups in random order: a first group of each class, then a second one, and so on.

    Classes with a single group come last in each turn, so that few classes are missing from the training side.
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
    """Return `count` of the textures (class by name), in turn from each class, drawn by the seed; sorted by name.

    A smaller sample is part of a larger one. Raises MaterialError for a count below 1.
    """
    if count < 1:
        raise MaterialError(f"{count} textures to leave out: at least one is expected.")
    chance = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, SOME])))
    order = _in_turn([(name,) for name in classes], classes, chance)
    return tuple(sorted(name for (name,) in order[:count]))


def groups_of(textures: Sequence[Texture]) -> tuple[tuple[str, ...], ...]:
    """Return the groups of textures that share content, each sorted by name; most have one texture.

    Textures share content through a file (`made_from`), or an equal row of one kind of feature: of a segment, a picture
    or a variant of a picture. Blank rows (silence, a black picture) do not count; nor do the hand's features, where
    there are others.
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
    counting = [(texture.id, _counting_rows(texture)) for texture in textures]
    for kind in sorted({kind for _, rows in counting for kind in rows}):
        yield from _equal_pairs(
            [(name, row) for name, rows in counting for row_set in rows.get(kind, ()) for row in row_set]
        )


def _counting_rows(texture: Texture) -> dict[str, list[FeatureRows]]:
    """Return a texture's rows by kind, without blank ones; a kind's pictures and variants are in one list."""
    touch = {kind: rows for kind, rows in texture.touch.items() if kind != HAND or len(texture.touch) == 1}
    blank_pictures, blank_variants = _blanks(texture.sight), _blanks(texture.variants)
    if len(blank_pictures) and len(blank_variants) % len(blank_pictures) == 0:
        # a variant of a black picture has only noise
        blank_variants = blank_variants | np.resize(blank_pictures, len(blank_variants))
    result: dict[str, list[FeatureRows]] = {}
    parts = ((touch, _blanks(touch)), (texture.sight, blank_pictures), (texture.variants, blank_variants))
    for rows, blank in parts:
        for kind, row_set in rows.items():
            result.setdefault(kind, []).append(row_set[~blank])
    return result


def _blanks(kinds: Mapping[str, FeatureRows]) -> NDArray[np.bool_]:
    """Return whether each segment or picture is blank, (rows,): in at least one kind of feature.

    The co-occurrence of a black picture has one number, while a network's features of it have many.
    """
    marks = [np.array([_blank(row) for row in rows], dtype=bool) for rows in kinds.values()]
    return np.logical_or.reduce(marks) if marks else np.zeros(0, dtype=bool)


def _blank(row: NDArray[np.float32]) -> bool:
    """Return whether a row has at most two different numbers up to rounding, as for silence or a black picture."""
    greatest = float(np.max(np.abs(row), initial=0.0))
    return greatest == 0.0 or len(np.unique(np.round(row / greatest, DIGITS))) <= 2


def _equal_pairs(owners: Owners) -> Iterator[tuple[str, str]]:
    """Yield pairs of owners of equal rows. For speed, only neighbours on a random projection are compared."""
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
    """Return each row's place on a random line, and the distance of equal rows, six SDs of rounding: (rows,) each."""
    line = np.random.Generator(np.random.PCG64(size)).standard_normal(size)
    table = np.stack(rows).astype(np.float64)
    reach: Array = SAME * np.abs(table).max(axis=1) * 6.0 * float(np.linalg.norm(line))
    return table @ line, reach


def _same(one: NDArray[np.float32], other: NDArray[np.float32]) -> bool:
    """Return whether two rows are equal up to rounding (`SAME`)."""
    greatest = float(max(np.max(np.abs(one)), np.max(np.abs(other))))
    return bool(np.max(np.abs(one.astype(np.float64) - other)) <= SAME * greatest)
