"""A texture as one row: the mean of its segments and pictures, and their SD.

Fifty textures of 110 segments are fifty samples, not 5,500: what cannot tell rows from textures is given textures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.attributes.learnable import rows_of
from palpate.modeling.attributes.material import MaterialError, Modality, Texture
from palpate.modeling.columns import Standard, standard_of
from palpate.signals.arrays import Array

LIMIT = 10.0
"""A texture's numbers are kept within so many SDs: what is far off all that was learned from says no more than that."""


@dataclass(frozen=True)
class Part:
    """One modality of a texture as a row: `kinds` side by side, `widths` numbers each; the means, and then the SDs."""

    modality: Modality
    kinds: tuple[str, ...]
    widths: tuple[int, ...]

    @classmethod
    def of(cls, texture: Texture, modality: Modality, kinds: Sequence[str]) -> Self:
        """As this texture has them. Raises MaterialError where it has not."""
        return cls(modality, tuple(kinds), tuple(rows_of(texture, modality, [kind]).shape[1] for kind in kinds))

    @property
    def size(self) -> int:
        """Numbers in a row of a segment or picture; a texture's row has twice as many."""
        return sum(self.widths)

    def rows(self, texture: Texture) -> Array:
        """(segments or pictures, size)."""
        return rows_of(texture, self.modality, self.kinds, self.size).astype(np.float64)

    def row(self, texture: Texture) -> Array:
        """(2 x size,): means and SDs. An SD of one row is not known: NaN."""
        rows = self.rows(texture)
        spread = rows.std(axis=0, ddof=1) if len(rows) > 1 else np.full(self.size, np.nan)
        return np.concatenate([rows.mean(axis=0), spread])

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Where each kind's means and each kind's SDs stand in a texture's row."""
        ends = np.cumsum([0, *self.widths, *self.widths]).tolist()
        return tuple(slice(start, end) for start, end in pairwise(ends))


@dataclass(frozen=True)
class Whole:
    """All parts of a texture in one standardised row; what is constant or not known becomes 0."""

    parts: tuple[Part, ...]
    standard: Standard

    def __call__(self, texture: Texture) -> Array:
        """(1, columns). Raises MaterialError for features that were not learned from."""
        return self.scaled(_row(self.parts, texture)[None])

    def scaled(self, rows: Array) -> Array:
        """Rows as they are, (n, columns), to standardised ones."""
        return np.clip(np.nan_to_num(self.standard(rows), nan=0.0), -LIMIT, LIMIT)

    def told(self) -> dict[str, Any]:
        """What `of` makes the same from, with the arrays `gain` and `offset`."""
        return {"parts": [[part.modality, list(part.kinds), list(part.widths)] for part in self.parts]}

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The standardisation."""
        return {"gain": self.standard.gain, "offset": self.standard.offset}

    @classmethod
    def of(cls, arrays: Any, told: Any) -> Self:
        """From what `told` and `arrays` gave."""
        parts = (Part(modality, tuple(kinds), tuple(widths)) for modality, kinds, widths in told["parts"])
        return cls(tuple(parts), Standard(arrays["gain"], arrays["offset"]))


def whole_of(textures: Sequence[Texture], touch: Sequence[str], sight: Sequence[str]) -> tuple[Whole, Array]:
    """How these textures become rows, and the rows (textures, columns), standardised; a modality may be left out.

    Raises MaterialError where there is no kind at all, where a texture lacks one, or where their sizes differ.
    """
    named: tuple[tuple[Modality, Sequence[str]], ...] = (("touch", touch), ("sight", sight))
    parts = tuple(Part.of(textures[0], modality, kinds) for modality, kinds in named if kinds)
    if not parts:
        raise MaterialError("no kind of feature was named: at least one of touch or sight is looked at.")
    rows = np.stack([_row(parts, each) for each in textures])
    whole = Whole(parts, standard_of(_filled(rows)))
    return whole, whole.scaled(rows)


def _row(parts: Sequence[Part], texture: Texture) -> Array:
    return np.concatenate([part.row(texture) for part in parts])


def _filled(rows: Array) -> Array:
    """What is not known is the mean of what is, or 0 where nothing is."""
    known = np.isfinite(rows)
    total = np.where(known, rows, 0.0).sum(axis=0)
    return np.where(known, rows, total / np.maximum(known.sum(axis=0), 1))
