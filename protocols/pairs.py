"""Pairs of a study's stimuli: which there are, and which of the two comes first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    from repeat to repeat. With `rounds` a participant compares a part of the pairs: rounds of a tournament in which
    each stimulus meets one other, so that the comparisons connect all stimuli. The rounds change from row to row, so
    that all pairs come equally often over the rows (David 1988, The Method of Paired Comparisons, chapter 5).
    """

    orders: Literal["both", "one"] = "both"
    same: Annotated[Whole, Field(ge=0, le=100)] = 0
    rounds: Annotated[Whole, Field(ge=2, le=MOST_PAIRS)] | None = None

    def count(self, stimuli: int) -> int:
        """Return the number of pairs of so many stimuli."""
        pairs = stimuli * (stimuli - 1) // 2 if self.rounds is None else self.rounds * (stimuli // 2)
        return pairs * (2 if self.orders == "both" else 1) + self.same * stimuli

    def of(self, names: Sequence[str], row: int, label: tuple[Key, ...]) -> list[tuple[str, str]]:
        """Return the pairs of these stimuli; `label` is the key that draws which order a pair has in row 0."""
        pairs = []
        for a, b in combinations(names, 2) if self.rounds is None else tournament(names, row, self.rounds):
            turned = self.orders == "one" and (uniform("pair", *label, a, b) < 0.5) != (row % 2 == 1)
            pairs.append((b, a) if turned else (a, b))
            if self.orders == "both":
                pairs.append((b, a))
        return pairs + [(name, name) for name in names for _ in range(self.same)]


def rounds_of_all(stimuli: int) -> int:
    """Return the number of rounds in which each stimulus has met every other one."""
    return stimuli - 1 + stimuli % 2


def tournament(names: Sequence[str], row: int, rounds: int) -> Iterator[tuple[str, str]]:
    """Yield the pairs of so many rounds of a round-robin tournament, the first of them being the round of this row.

    One name stays and the others go round it (the circle method); of an odd number one has no partner in each round.
    Two successive rounds already connect all names. A pair is in the order of the names.
    """
    place = {name: n for n, name in enumerate(names)}
    stays, goes = (None, names) if len(names) % 2 else (names[0], names[1:])
    for turn in range(row * rounds, (row + 1) * rounds):
        circle = [goes[(turn + n) % len(goes)] for n in range(len(goes))]
        meets = [(stays, circle[0]), *((circle[n], circle[-n]) for n in range(1, len(circle) // 2 + 1))]
        for a, b in meets:
            if a is not None and b is not None:
                yield (a, b) if place[a] < place[b] else (b, a)


def pairs_from(value: Any) -> Pairs:
    """Return the pairs in a study file. Raises ValueError."""
    return Pairs.model_validate(value)
