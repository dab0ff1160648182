"""Random numbers for a loop, drawn a block at a time; each depends on its key and its index alone."""

from __future__ import annotations

import numpy as np

BLOCK = 1024


class Normals:
    """A sequence of standard normal numbers; the n-th is the same however many are drawn at once.

    Block k comes from a PCG64 of its own, keyed by (key, k): there is no stream whose state could be lost.
    """

    __slots__ = ("_at", "_block", "_drawn", "_key")

    def __init__(self, *key: int) -> None:
        """Take the key: whole numbers of at least 0."""
        self._key = key
        self._block = 0
        self._at = BLOCK
        self._drawn: list[float] = []

    def next(self) -> float:
        """Return the next number."""
        at = self._at
        if at == BLOCK:
            seeds = np.random.SeedSequence((*self._key, self._block))
            self._drawn = np.random.Generator(np.random.PCG64(seeds)).standard_normal(BLOCK).tolist()
            self._block += 1
            at = 0
        self._at = at + 1
        return self._drawn[at]
