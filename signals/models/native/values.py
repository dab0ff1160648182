"""Where a value lies while a program is compiled, and how it is read."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from palpate.signals.arrays import Array


class NotCompiled(ValueError):
    """A step that the kernel does not support, or not in this place; the message says which."""


@dataclass(eq=False)
class Room:
    """A part of the workspace, `size` numbers long. `fixed`: nothing else may use it (it holds zeros that must
    stay).
    """

    size: int
    fixed: bool = False
    start: int = -1


@dataclass(frozen=True)
class Spot:
    """A place in a room; the room's start is known only when all operations are."""

    room: Room
    past: int = 0

    def beyond(self, count: int) -> Spot:
        """Return the spot `count` numbers further on."""
        return Spot(self.room, self.past + count)


@dataclass(frozen=True)
class Linear:
    """A value that is still a formula, y = matrix x + offset of the input x, in double precision."""

    matrix: Array
    offset: Array


@dataclass(eq=False)
class Product:
    """A product of matrices to be run: y = a weight + bias (+ more), then relu; bias (1 or m, n)."""

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
    one row. `sides`: a list that still lies as (channels, length), length first. `made`: the product that computes it,
    and `free`: nothing else reads it yet, so it may be changed in place. `wide`: where it lies in double precision too,
    or -1.
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
        """Return how many numbers the value has."""
        return math.prod(self.shape)

    @property
    def spot(self) -> Spot:
        """Return where the value lies. Raises NotCompiled if it has no place yet."""
        if self.at is None:
            raise NotCompiled("a value was needed before it was computed")
        return self.at

    @property
    def matrix(self) -> tuple[int, int]:
        """Return the numbers of rows and columns in memory."""
        if len(self.shape) == 1:
            return 1, self.size
        channels, length = self.shape
        return (length, channels) if self.length_first else (channels, length)

    @property
    def packed(self) -> bool:
        """Return whether there are no gaps between its rows."""
        rows, cols = self.matrix
        return rows == 1 or self.step == cols
