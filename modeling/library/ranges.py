"""Soft ranges of an attribute, and how well a value fits one that is not known for sure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

Knot = tuple[float, float]
SURE = 1e-9
"""An SD below this is none."""
ENDS = (0.0, 100.0)


@dataclass(frozen=True)
class Soft:
    """A membership between 0 and 1: straight lines from knot (value, membership) to knot, level beyond the ends."""

    knots: tuple[Knot, ...]

    def at(self, value: float) -> float:
        """The membership of a value that is known for sure."""
        return self.expected(value, 0.0)

    def expected(self, mean: float, sd: float) -> float:
        """The membership to expect of a value that is normal about `mean`; in closed form, 0 to 1."""
        found = self.knots[0][1] + sum(
            (above[1] - below[1]) * _risen(below[0], above[0], mean, sd) for below, above in pairwise(self.knots)
        )
        return min(1.0, max(0.0, found))

    @cached_property
    def best(self) -> float:
        """The greatest membership that a value on the scale can have."""
        return max(self.at(value) for value in (*ENDS, *(x for x, _ in self.knots if ENDS[0] <= x <= ENDS[1])))

    def short_of(self, value: float) -> float:
        """How far a value is from what the range means at its best, 0 to 100: from the scale's end where the range is
        level to there, else from the middle of what fits wholly."""
        full = [x for x, share in self.knots if share == self.best] or [sum(ENDS) / 2]
        low, high = (self.at(end) == self.best for end in ENDS)
        if low == high:
            return abs(value - sum(full) / len(full)) if not low else 0.0
        return abs(value - ENDS[0 if low else 1])

    @property
    def met(self) -> tuple[float, float] | None:
        """The first and last value on the scale, in halves, that fits at least by half."""
        values = [value / 2 for value in range(201) if self.at(value / 2) >= 0.5]
        return (values[0], values[-1]) if values else None


def trapezoid(edges: Sequence[float | None]) -> Soft:
    """Nothing up to the first edge, all between the second and the third, nothing from the fourth; None: no bound."""
    rise, full, to, fall = edges
    knots = [(rise, 0.0), (full, 1.0)] if rise is not None and full is not None else []
    knots += [(to, 1.0), (fall, 0.0)] if to is not None and fall is not None else []
    return Soft(tuple(dict(knots).items()) or ((0.0, 1.0),))


def turned(soft: Soft) -> Soft:
    """The same range seen from the scale's other end."""
    return Soft(tuple((ENDS[1] - value, member) for value, member in reversed(soft.knots)))


def both(first: Soft, second: Soft) -> Soft:
    """The lesser membership of the two everywhere: what lies in both ranges."""
    values = sorted({value for each in (first, second) for value, _ in each.knots})
    values = sorted({*values, *_crossings(first, second, values)})
    return Soft(tuple((value, min(first.at(value), second.at(value))) for value in values))


def _crossings(first: Soft, second: Soft, values: Sequence[float]) -> list[float]:
    found = []
    for low, high in pairwise(values):
        before, after = (first.at(value) - second.at(value) for value in (low, high))
        if before * after < 0:
            found.append(low + (high - low) * before / (before - after))
    return found


def _risen(low: float, high: float, mean: float, sd: float) -> float:
    """How far a rise from 0 at `low` to 1 at `high` has got, on average: 1 - integral of the distribution / width."""
    if sd < SURE:
        return min(1.0, max(0.0, (mean - low) / (high - low)))
    below = sd * (_integral((high - mean) / sd) - _integral((low - mean) / sd))
    return 1.0 - below / (high - low)


def _integral(z: float) -> float:
    """The integral of the normal distribution function up to z."""
    return z * normal(z) + math.exp(-z * z / 2) / math.sqrt(2 * math.pi)


def normal(z: float) -> float:
    """The normal distribution function."""
    return math.erfc(-z / math.sqrt(2)) / 2
