"""Leave one texture out: folds in which nothing of the texture that is asked about was learned from (thesis 3.6.4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from palpate.modeling.attributes.folds_groups import groups_of
from palpate.modeling.attributes.material import Material, MaterialError
from palpate.protocols.wording import some

HELD = 0.1
"""The share of the training side that a network watches to stop early."""
SOME = 5
"""Tells `some_of`'s chance from others of the same seed."""
LEAST = 3
"""Groups of textures that are needed: one to ask about, one to learn from, one to watch."""


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
    """A fold for each texture (or for those named by `only`), in the material's order; all of them rated.

    Textures that share content (`made_from`, or an equal row of a segment or a picture) are one group, and no group is
    divided. About `share` of the training side is held for early stopping: whole groups, in turn from each class, drawn
    by the seed and the tested texture's name. The order of textures and rows decides nothing. Raises MaterialError for
    too few groups, a share outside 0..0.5, a name that is none, or a texture that was not rated.
    """
    if not 0 <= share <= 0.5:
        raise MaterialError(f"the share that is held is {share:g}; 0 to 0.5 is expected.")
    missing = [each.id for each in material.textures if each.rated is None]
    if missing:
        raise MaterialError(f"{missing[0]} was not rated: take Material.rated() of it.")
    groups = groups_of(material.textures)
    if len(groups) < LEAST:
        raise MaterialError(
            f"leaving one texture out needs at least {LEAST} that share no recording and no picture; there are "
            f"{len(groups)} of {len(material.textures)} textures. Record and rate more."
        )
    asked = material.ids if only is None else tuple(only)
    unknown = [name for name in asked if name not in material.ids]
    if unknown:
        raise MaterialError(f"no texture {unknown[0]!r} can be left out: there are {some(material.ids)}.")
    classes = {each.id: each.category for each in material.textures}
    return tuple(_fold(name, groups, classes, seed, share) for name in asked)


def all_of_them(material: Material, seed: int = 0, share: float = HELD) -> Fold:
    """Every rated texture, nothing left out: what a model that is to be used learns from and what it watches."""
    groups = groups_of(material.textures)
    classes = {each.id: each.category for each in material.textures}
    return _split("", (), groups, classes, _chance(seed, ""), share)


def _fold(test: str, groups: Sequence[tuple[str, ...]], classes: Mapping[str, str], seed: int, share: float) -> Fold:
    own = next(group for group in groups if test in group)
    others = [group for group in groups if group is not own]
    return _split(test, tuple(name for name in own if name != test), others, classes, _chance(seed, test), share)


def _split(
    test: str, apart: tuple[str, ...], others: Sequence[tuple[str, ...]], classes: Mapping[str, str],
    chance: np.random.Generator, share: float,
) -> Fold:  # fmt: skip
    held = _drawn(others, classes, chance, share)
    train = sorted(name for group in others if group not in held for name in group)
    return Fold(test, tuple(train), tuple(sorted(name for group in held for name in group)), apart)


def _chance(seed: int, test: str) -> np.random.Generator:
    """Its own for each tested texture, whatever stands beside it."""
    named = int.from_bytes(sha256(test.encode()).digest()[:8], "big")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, named])))


def _drawn(
    groups: Sequence[tuple[str, ...]], classes: Mapping[str, str], chance: np.random.Generator, share: float
) -> list[tuple[str, ...]]:
    """Groups until the share is reached, one class after the other; one group stays to learn from."""
    wanted = max(1, round(share * sum(map(len, groups)))) if share > 0 else 0
    found: list[tuple[str, ...]] = []
    for group in _in_turn(groups, classes, chance):
        short = wanted - sum(map(len, found))
        if short > 0 and len(found) < len(groups) - 1 and (len(group) <= short or not found):
            found.append(group)
    return found


def _in_turn(
    groups: Sequence[tuple[str, ...]], classes: Mapping[str, str], chance: np.random.Generator
) -> list[tuple[str, ...]]:
    """All groups: a first one of each class in a drawn order of the classes, then a second one, and so on.

    Classes of a single group come last in each turn, so that a class is seldom missing from what is learned.
    """
    by_class: dict[str, list[tuple[str, ...]]] = {}
    for group in sorted(groups):
        by_class.setdefault(classes[group[0]], []).append(group)
    order = [sorted(by_class)[place] for place in chance.permutation(len(by_class))]
    shuffled = {name: [by_class[name][i] for i in chance.permutation(len(by_class[name]))] for name in order}
    turns = [(turn, len(shuffled[name]) == 1, place, group)
             for place, name in enumerate(order) for turn, group in enumerate(shuffled[name])]  # fmt: skip
    return [group for *_, group in sorted(turns, key=lambda each: each[:3])]


def some_of(classes: Mapping[str, str], count: int, seed: int = 0) -> tuple[str, ...]:
    """So many of these textures (class by name), in turn from each class, drawn by the seed; in alphabetical order.

    The fewer are among the more. Raises MaterialError for less than one.
    """
    if count < 1:
        raise MaterialError(f"{count} textures to leave out: at least one is expected.")
    chance = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, SOME])))
    order = _in_turn([(name,) for name in classes], classes, chance)
    return tuple(sorted(name for (name,) in order[:count]))
