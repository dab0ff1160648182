"""Where a value lies while a program is put together, and how it is read."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from palpate.signals.arrays import Array


class NotCompiled(ValueError):
    """A step that the kernel does not know, or not in this place; the message says which."""


@dataclass(eq=False)
class Room:
    """So many numbers of the workspace. `fixed`: nothing else may ever lie there (it holds zeros that stay)."""

    size: int
    fixed: bool = False
    start: int = -1


@dataclass(frozen=True)
class Spot:
    """A place in a room, which is given a start only when all operations are known."""

    room: Room
    past: int = 0

    def beyond(self, count: int) -> Spot:
        """Return the spot so many numbers further on."""
        return Spot(self.room, self.past + count)


@dataclass(frozen=True)
class Linear:
    """A value that is still y = matrix x + offset of the input x, in double precision: nothing was run for it yet."""

    matrix: Array
    offset: Array


@dataclass(eq=False)
class Product:
    """A product of matrices that will be run: y = a weight + bias (+ more), then relu; bias (1 or m, n)."""

    a: Spot
    row_step: int
    col_step: int
    m: int
    weight: Array
    bias: Array
    y: Spot
    more: Spot | None = None
    more_step: int = 0
    relu: bool = False


@dataclass(frozen=True)
class Value:
    """A value of shape (size,) or (channels, length).

    It lies as a matrix of `rows` that are `step` apart: a row is a place if `length_first`, else a channel; a list is
    one row. `sides`: a list that still lies as (channels, length), length first. `made`: the product that gave it, and
    `free`: nothing else has seen it yet, so it may be changed where it lies.
    `wide`: where it lies in double precision too, or -1.
    """

    shape: tuple[int, ...]
    at: Spot | None = None
    step: int = 0
    length_first: bool = False
    linear: Linear | None = field(default=None, repr=False)
    sides: tuple[int, int] | None = None
    made: Product | None = field(default=None, repr=False)
    free: bool = False
    wide: int = -1

    @property
    def size(self) -> int:
        """Return how many numbers."""
        return math.prod(self.shape)

    @property
    def spot(self) -> Spot:
        """Return where it lies."""
        if self.at is None:
            raise NotCompiled("a value was needed before it was computed")
        return self.at

    @property
    def matrix(self) -> tuple[int, int]:
        """Return rows and columns as it lies."""
        if len(self.shape) == 1:
            return 1, self.size
        channels, length = self.shape
        return (length, channels) if self.length_first else (channels, length)

    @property
    def packed(self) -> bool:
        """Return whether no gaps lie between its rows."""
        rows, cols = self.matrix
        return rows == 1 or self.step == cols
