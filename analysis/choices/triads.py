"""Circular triads: a over b, b over c, c over a."""

from __future__ import annotations

import math
from collections.abc import Hashable

import numpy as np
import pandas as pd

from palpate.analysis.choices.counted import gather_choices
from palpate.analysis.statistics.cells import check_columns, coded

POOLED = "all together"


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
    leader), `note`. Source: Kendall & Babington Smith 1940.
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
        "note": "" if every and size > 2 else "some pair has no leader: consistence needs them all",
    }
