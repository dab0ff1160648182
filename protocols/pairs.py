"""Pairs of a study's stimuli: which there are, and which of the two comes first."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import Field

from palpate.protocols.keyed import Key, uniform
from palpate.protocols.strict import KnownKeys
from palpate.protocols.study import Whole

PAIRS = "pairs"
"""What stands in the place of a procedure where trials are pairs."""
MOST_PAIRS = 2000
"""Greatest number of pairs in a session, as of trials of a track."""


class Pairs(KnownKeys):
    """The pairs of the stimuli of each block: `both` orders of each, or `one`; `same` pairs each with itself so often.

    Of one order, half of the participants have the first stimulus first: it changes from row to row of the square, and
    from repeat to repeat.
    """

    orders: Literal["both", "one"] = "both"
    same: Annotated[Whole, Field(ge=0, le=100)] = 0

    def count(self, stimuli: int) -> int:
        """Return the number of pairs of so many stimuli."""
        return stimuli * (stimuli - 1) // (1 if self.orders == "both" else 2) + self.same * stimuli

    def of(self, names: Sequence[str], row: int, label: tuple[Key, ...]) -> list[tuple[str, str]]:
        """Return the pairs of these stimuli; `label` is the key that draws which order a pair has in row 0."""
        pairs = []
        for a, b in combinations(names, 2):
            turned = self.orders == "one" and (uniform("pair", *label, a, b) < 0.5) != (row % 2 == 1)
            pairs.append((b, a) if turned else (a, b))
            if self.orders == "both":
                pairs.append((b, a))
        return pairs + [(name, name) for name in names for _ in range(self.same)]


def pairs_from(value: Any) -> Pairs:
    """Return the pairs in a study file. Raises ValueError."""
    return Pairs.model_validate(value)
