"""A certificate of balance: how often every item was at every position and followed every other item."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from palpate.protocols.plan import main_order
from palpate.protocols.study import Stimulus, Study
from palpate.protocols.trial import ParticipantRow


@dataclass(frozen=True)
class Balance:
    """Counts over sequences of the same items.

    positions[item][p] counts the sequences with the item at position p (0-based); carry_over[(a, b)] counts how often b
    came directly after a. In a design in which each sequence has a `part` of the items, it is balanced if all items
    came equally often.
    """

    sequences: int
    items: tuple[str, ...]
    positions: dict[str, tuple[int, ...]]
    carry_over: dict[tuple[str, str], int]
    part: bool = False

    @property
    def times_range(self) -> tuple[int, int]:
        """Return how often the rarest and the commonest item came."""
        counts = [sum(row) for row in self.positions.values()]
        return (min(counts), max(counts)) if counts else (0, 0)

    @property
    def position_range(self) -> tuple[int, int]:
        """Return the least and the greatest position count, which are equal in a design balanced for order."""
        counts = [count for row in self.positions.values() for count in row]
        return (min(counts), max(counts)) if counts else (0, 0)

    @property
    def carry_over_range(self) -> tuple[int, int]:
        """Return the least and the greatest count over all ordered pairs of different items."""
        counts = [self.carry_over.get((a, b), 0) for a in self.items for b in self.items if a != b]
        return (min(counts), max(counts)) if counts else (0, 0)

    @property
    def balanced(self) -> bool:
        """Return whether all positions and all carry-overs are equally frequent; of parts, whether all items are."""
        if self.part:
            return self.times_range[0] == self.times_range[1]
        return all(low == high for low, high in (self.position_range, self.carry_over_range))

    def text(self) -> str:
        """Return the certificate in words."""
        (p_low, p_high), (c_low, c_high) = self.position_range, self.carry_over_range
        verdict = "balanced" if self.balanced else "not balanced (yet)"
        sequences = f"{self.sequences} sequence{'s' if self.sequences != 1 else ''}"
        if self.part:
            came = _times(*self.times_range)
            return f"{sequences} of a part of {len(self.items)} items: {verdict}. Each item came {came}."
        return (
            f"{sequences} of {len(self.items)} items: {verdict}. "
            f"Each item stood at each position {_times(p_low, p_high)} "
            f"and followed each other item {_times(c_low, c_high)}."
        )


def certificate(sequences: Iterable[Sequence[str]], part: bool = False) -> Balance:
    """Return the counts of positions and carry-overs.

    Every sequence must hold the same items, or, with `part`, as many of them.
    """
    rows = [tuple(row) for row in sequences]
    items = tuple(sorted({item for row in (rows if part else rows[:1]) for item in row}))
    for number, row in enumerate(rows):
        if (not part and tuple(sorted(set(row))) != items) or len(row) != len(rows[0]):
            raise ValueError(f"sequence {number} does not hold the same items as sequence 0")
    length = len(rows[0]) if rows else 0
    at = Counter((item, place) for row in rows for place, item in enumerate(row))
    follows = Counter(pair for row in rows for pair in pairwise(row))
    positions = {item: tuple(at[item, place] for place in range(length)) for item in items}
    return Balance(len(rows), items, positions, dict(follows), part)


def certificates(study: Study, people: Sequence[tuple[ParticipantRow, int]]) -> dict[str, Balance]:
    """Return the certificates of the orders of these people (row and seed), who belong to one group.

    The first certificate, named "", covers all their sessions together; where the study declares several sessions, one
    certificate for each follows, by its name.
    """
    by_session = {
        f"session {number}": [
            [_item(study, felt) for _, felt in main_order(study, who, seed, number)] for who, seed in people
        ]
        for number in range(1, study.sessions + 1)
    }
    part = has_parts(study)
    together = certificate([order for orders in by_session.values() for order in orders], part)
    each = {name: certificate(orders, part) for name, orders in by_session.items()} if study.sessions > 1 else {}
    return {"": together, **each}


def has_parts(study: Study) -> bool:
    """Return whether each participant meets a part of what the study compares."""
    return study.pairs is not None and study.pairs.rounds is not None


def _item(study: Study, felt: tuple[Stimulus, ...]) -> str:
    """Return what is counted: a stimulus or a pair, whichever of it comes first if participants differ in that."""
    names = [stimulus.id for stimulus in felt]
    return ", ".join(sorted(names) if study.pairs is not None and study.pairs.orders == "one" else names)


def _times(low: int, high: int) -> str:
    if low != high:
        return f"{low} to {high} times"
    return "once" if low == 1 else f"{low} times"


def balance_lines(group: str, certified: Mapping[str, Balance]) -> Iterator[str]:
    """Yield lines on the balance of a group's orders: of all sessions together, then of each if there are several."""
    together = f", all {len(certified) - 1} sessions" if len(certified) > 1 else ""
    for session, balance in certified.items():
        yield f"group {group}{f', {session}' if session else together}: {balance.text()}"


def balance_data(certified: Mapping[str, Balance]) -> dict[str, Any]:
    """Return a group's certificates as JSON data: of all sessions together, and of each if there are several."""
    of_sessions = {session: _balance_data(balance) for session, balance in certified.items() if session}
    return {**_balance_data(certified[""]), **({"sessions": of_sessions} if of_sessions else {})}


def _balance_data(balance: Balance) -> dict[str, Any]:
    return {
        "sequences": balance.sequences,
        "balanced": balance.balanced,
        "position_range": balance.position_range,
        "carry_over_range": balance.carry_over_range,
        **({"times_range": balance.times_range} if balance.part else {}),
        "positions": balance.positions,
        "carry_over": [[a, b, count] for (a, b), count in sorted(balance.carry_over.items())],
    }
