"""Circular triads: a over b, b over c, c over a."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable, Mapping
from functools import lru_cache
from itertools import product

import numpy as np
import pandas as pd
from scipy.special import gammaincc

from palpate.analysis.choices.counted import gather_choices
from palpate.analysis.statistics.cells import check_columns, coded
from palpate.analysis.statistics.f_and_t import SMALLEST

POOLED = "all together"
MOST_EXACT = 9


def circular_triads(
    data: pd.DataFrame,
    winner: Hashable,
    loser: Hashable,
    participant: Hashable | None = None,
    tie: Hashable | None = None,
    count: Hashable | None = None,
) -> pd.DataFrame:
    """Return how many triads of items are intransitive, over all choices and for each participant.

    Of two items the one chosen more often leads; a pair without a leader makes no triad. Columns: `who` ("all together"
    or the participant), `triads` (with a leader in every pair), `circular`, `expected` (a quarter of them, if every
    pair were decided by a coin), `consistence` (Kendall's zeta: 1 without a circular triad; NaN unless every pair has a
    leader), `p` (the chance that coins give no more circular triads; NaN likewise), `note`. Source: Kendall & Babington
    Smith 1940.
    """
    items = len(gather_choices(data, winner, loser, tie, None, count).items)
    whole = _row(POOLED, data, winner, loser, tie, count, items)
    if participant is None:
        return pd.DataFrame([whole])
    check_columns(data, [participant])
    who = coded(data[participant], participant)
    own = [
        _row(name, data.iloc[np.flatnonzero(who.codes == i)], winner, loser, tie, count, items)
        for i, name in enumerate(who.labels)
    ]
    return pd.DataFrame([whole, *own])


def _row(
    who: Hashable,
    data: pd.DataFrame,
    winner: Hashable,
    loser: Hashable,
    tie: Hashable | None,
    count: Hashable | None,
    size: int,
) -> dict[str, object]:
    counted = gather_choices(data, winner, loser, tie, None, count)
    wins = counted.wins()
    leads = (wins > wins.T).astype(np.float64)
    either = leads + leads.T
    circular = round(float(np.trace(leads @ leads @ leads)) / 3)
    triads = round(float(np.trace(either @ either @ either)) / 6)
    most = (size**3 - size) / 24 if size % 2 else (size**3 - 4 * size) / 24  # circular triads among so many items
    every = len(wins) == size and int(leads.sum()) == size * (size - 1) // 2
    return {
        "who": who,
        "items": len(wins),
        "triads": triads,
        "circular": circular,
        "expected": triads / 4,
        "consistence": 1 - circular / most if every and size > 2 else math.nan,
        "p": chance_of_circular(size, circular) if every and size > 2 else math.nan,
        "note": "" if every and size > 2 else "some pair has no leader: consistence needs them all",
    }


def chance_of_circular(items: int, circular: int) -> float:
    """Return the chance of at most so many circular triads among `items`, each pair of which is decided by a coin.

    It is exact for up to `MOST_EXACT` items, else by Kendall's chi squared with n (n - 1) (n - 2) / (n - 4)^2 degrees
    of freedom. Source: Kendall & Babington Smith 1940.
    """
    if items <= MOST_EXACT:
        ways = ways_to_be_circular(items)
        return math.fsum(count for number, count in ways.items() if number <= circular) / float(sum(ways.values()))
    df = items * (items - 1) * (items - 2) / (items - 4) ** 2
    chi2 = 8 / (items - 4) * (math.comb(items, 3) / 4 - circular + 0.5) + df
    return max(float(gammaincc(df / 2, chi2 / 2)), SMALLEST)


@lru_cache(maxsize=MOST_EXACT)
def ways_to_be_circular(items: int) -> Mapping[int, int]:
    """Return by number of circular triads how many outcomes of all pairs of `items` have it.

    Items are added one by one; outcomes with the same numbers of wins, in any order, are counted together.
    """
    ways: Counter[tuple[int, ...]] = Counter({(): 1})
    for _ in range(items):
        longer: Counter[tuple[int, ...]] = Counter()
        for wins, count in ways.items():
            own = Counter(wins)
            # Of the items with equally many wins, some win against the new item.
            for winners in product(*(range(number + 1) for number in own.values())):
                new = [len(wins) - sum(winners)]
                for (old, number), some in zip(own.items(), winners, strict=True):
                    new += [old] * (number - some) + [old + 1] * some
                equal = math.prod(map(math.comb, own.values(), winners))
                longer[tuple(sorted(new))] += count * equal
        ways = longer
    circular: Counter[int] = Counter()
    for wins, count in ways.items():
        circular[math.comb(items, 3) - sum(math.comb(won, 2) for won in wins)] += count
    return circular
