"""Counts of pairwise comparisons: wins, losses, ties, and which item came first."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.analysis.statistics.cells import Counts, check_columns, coded, numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadValue, TooFew, listed

TRUE, FALSE = ("true", "1", "1.0", "yes"), ("false", "0", "0.0", "no", "")


@dataclass(frozen=True)
class Counted:
    """One row per ordered pair that was compared: `counts` (pairs, 3) of wins of `one`, wins of `two`, ties.

    `ordered` says whether `one` was presented first; if not, `one` is before `two` in label order. `people` are those
    who compared, () where they are unknown, `by_person` (people, pairs, 3) their parts of the counts.
    """

    items: tuple[Hashable, ...]
    one: Counts
    two: Counts
    counts: Floats
    ordered: bool
    people: tuple[Hashable, ...]
    by_person: Floats

    def wins(self) -> Floats:
        """Return how often each item (row) was chosen over each other item (column)."""
        table = np.zeros((len(self.items), len(self.items)))
        np.add.at(table, (self.one, self.two), self.counts[:, 0])
        np.add.at(table, (self.two, self.one), self.counts[:, 1])
        return table

    def tied(self) -> Floats:
        """Return how often each two items were tied, as a symmetric matrix."""
        table = np.zeros((len(self.items), len(self.items)))
        np.add.at(table, (self.one, self.two), self.counts[:, 2])
        return table + table.T


def gather_choices(
    data: pd.DataFrame,
    winner: Hashable,
    loser: Hashable,
    tie: Hashable | None = None,
    first: Hashable | None = None,
    count: Hashable | None = None,
    participant: Hashable | None = None,
) -> Counted:
    """Return the comparisons of a table, one row per comparison, or per `count` of them.

    `tie` names a column that is true where neither won, `first` one that holds the item presented first, `participant`
    one that says who compared. Raises UnknownColumn, BadValue (an item against itself, a count that is not a whole
    number from 0, a first item that is not in the pair), TooFew (fewer than two items).
    """
    named = [winner, loser, *(name for name in (tie, first, count, participant) if name is not None)]
    check_columns(data, named)
    columns = [data[name] for name in (winner, loser, *([] if first is None else [first]))]
    both = coded(pd.concat(columns, ignore_index=True), f"{winner} and {loser}")
    size = len(data)
    won, lost = both.codes[:size], both.codes[size : 2 * size]
    rows = np.flatnonzero(won == lost).tolist()
    if rows:
        listing = listed((f"{both.labels[won[row]]!r} in row {row + 1}" for row in rows), len(rows))
        raise BadValue(f"an item is compared with itself: {listing}; correct or leave out these rows")
    lead = np.minimum(won, lost) if first is None else both.codes[2 * size :]
    if first is not None and (rows := np.flatnonzero((lead != won) & (lead != lost)).tolist()):
        listing = listed((f"row {row + 1}" for row in rows), len(rows))
        raise BadValue(f"column {first!r} names neither winner nor loser in {listing}")
    weights = np.ones(size) if count is None else _counts_of(data[count], count)
    outcome = np.where(lead == won, 0, 1)
    if tie is not None:
        outcome = np.where(_are_ties(data[tie], tie), 2, outcome)
    items = tuple(both.labels)
    two = won + lost - lead
    if len(items) < 2:
        raise TooFew(f"{len(items)} item; a comparison needs two or more")
    cells = np.zeros((len(items), len(items), 3))
    np.add.at(cells, (lead, two, outcome), weights)
    pairs = np.argwhere(cells.sum(axis=2) > 0)
    if not len(pairs):
        raise BadValue("no comparison has a count above 0")
    people: tuple[Hashable, ...] = ()
    by_person = np.zeros((0, len(pairs), 3))
    if participant is not None:
        who = coded(data[participant], participant)
        people, place = tuple(who.labels), np.zeros(cells.shape[:2], dtype=np.intp)
        place[pairs[:, 0], pairs[:, 1]] = np.arange(len(pairs))
        by_person = np.zeros((len(people), len(pairs), 3))
        np.add.at(by_person, (who.codes, place[lead, two], outcome), weights)
    return Counted(
        items, pairs[:, 0], pairs[:, 1], cells[pairs[:, 0], pairs[:, 1]], first is not None, people, by_person
    )


def _counts_of(column: pd.Series[Any], name: Hashable) -> Floats:
    """Return how many comparisons each row represents. Raises BadValue for values that are not whole numbers from 0."""
    counts = numbers_of(column, name)
    wrong = np.flatnonzero(~((counts >= 0) & (counts == np.floor(counts)))).tolist()
    if wrong:
        listing = listed((f"{counts[row]!r} in row {row + 1}" for row in wrong), len(wrong))
        raise BadValue(f"column {name!r} must count comparisons (0, 1, 2, ...); found {listing}")
    return counts


def _are_ties(column: pd.Series[Any], name: Hashable) -> NDArray[np.bool_]:
    """Return whether each row is a tie. Raises BadValue for a value that is neither true nor false."""
    texts = [str(value).strip().lower() for value in column.tolist()]
    wrong = [row for row, text in enumerate(texts) if text not in TRUE + FALSE]
    if wrong:
        listing = listed((f"{column.iloc[row]!r} in row {row + 1}" for row in wrong), len(wrong))
        raise BadValue(f"column {name!r} must say true or false; found {listing}")
    return np.array([text in TRUE for text in texts])
