"""The model as arrays: sorted values, fixed design, random effects, and which factor's groups are eliminated first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.analysis.mixed_models.design import Design
from palpate.analysis.mixed_models.grouping import Random
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.labels import Codes

WIDEST = 20_000


@dataclass(frozen=True)
class Block:
    """A random term within the blocks: a level's slot in its block, and the first column of slot 0."""

    term: int
    slots: Codes
    count: int
    start: int


@dataclass(frozen=True)
class Layout:
    """Rows fall into blocks that share no random effect of `inside`; the terms `outside` are eliminated after them.

    A block's random effects have `width` columns (slots that a block lacks are columns of zeros).
    """

    codes: Codes
    blocks: int
    inside: tuple[Block, ...]
    outside: tuple[int, ...]
    width: int


@dataclass(frozen=True)
class Problem:
    """y, the fixed effects' design and the random terms.

    y is y + y_low without rounding, the outcome minus one of its values, divided by a power of two.
    """

    y: Floats
    y_low: Floats
    fixed: Design
    random: tuple[Random, ...]
    layout: Layout

    @property
    def columns(self) -> int:
        """The number of fixed effects."""
        return sum(self.fixed.widths)


def best_layout(random: Sequence[Random], fixed: int) -> Layout:
    """The layout whose evaluation costs least: one factor's groups as blocks, with or without those nested in it."""
    options = [_layout(random, i, nested) for i in range(len(random)) for nested in (True, False)]
    return min(options, key=lambda option: _cost(option, random, fixed))


def _layout(random: Sequence[Random], outer: int, nested: bool) -> Layout:
    codes, blocks = random[outer].codes, len(random[outer].levels)
    inside = [Block(outer, np.zeros(blocks, dtype=np.intp), 1, 0)]
    width = random[outer].size
    for i, term in enumerate(random):
        if i == outer or not nested or (home := _home(term, codes)) is None:
            continue
        slots, count = _slots(home, blocks)
        inside.append(Block(i, slots, count, width))
        width += count * term.size
    placed = {block.term for block in inside}
    return Layout(codes, blocks, tuple(inside), tuple(i for i in range(len(random)) if i not in placed), width)


def _home(term: Random, blocks: Codes) -> Codes | None:
    """Each level's block, or None where a level has rows in several blocks."""
    home = np.zeros(len(term.levels), dtype=np.intp)
    home[term.codes] = blocks
    return home if bool((home[term.codes] == blocks).all()) else None


def _slots(home: Codes, blocks: int) -> tuple[Codes, int]:
    order = np.argsort(home, kind="stable")
    counts = np.bincount(home, minlength=blocks)
    starts = np.cumsum(counts) - counts
    slots = np.empty(len(home), dtype=np.intp)
    slots[order] = np.arange(len(home)) - starts[home[order]]
    return slots, int(counts.max())


def _cost(layout: Layout, random: Sequence[Random], fixed: int) -> tuple[float, float]:
    late = sum(len(random[i].levels) * random[i].size for i in layout.outside) + fixed + 1
    early, blocks = float(layout.width), float(layout.blocks)
    return blocks * early**2 * (early + late) + (blocks * early + late) * float(late) ** 2, early
