"""Which stimuli are one and the same door: identical and nearly identical force profiles."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.signals.arrays import Array, Indices

SAME_N = 0.1
"""Profiles that differ by no more than this anywhere are one. It lies far above the rounding of a file (0.0001 N) and
far below what a hand tells apart: some 7 % of a force (Pang, Tan and Durlach 1991), and the smallest difference between
two profiles of the door study that are not meant to be equal is 1.9 N."""


def near_groups(force_N: Array, same_N: float = SAME_N) -> Indices:
    """For each profile of (n, 621) the row of the first one that it is joined to, itself where it is alone.

    Joined are profiles whose greatest difference is at most `same_N`, and whatever such pairs link.
    """
    links = _Links(len(force_N))
    # two profiles that are near everywhere have means that are near, so only neighbours in the mean are compared
    with np.errstate(over="ignore", invalid="ignore"):
        mean = force_N.mean(axis=1)
        order = np.argsort(mean, kind="stable")
        for place, row in enumerate(order):
            last = int(np.searchsorted(mean[order], _above(mean[row], same_N), side="right"))
            others = order[place + 1 : last]
            near = np.abs(force_N[others] - force_N[row]).max(axis=1, initial=0.0) <= same_N
            links.join_all(int(row), others[near].tolist())
    return np.array([links.first(row) for row in range(len(force_N))], dtype=np.int64)


def source_groups(data: DoorData, same_N: float = SAME_N) -> Indices:
    """For each stimulus a number that it shares with all stimuli of its source and of (nearly) its profile."""
    links = _Links(len(data))
    for groups in (near_groups(data.force_N, same_N).tolist(), data.source):
        for rows in _rows_by(groups):
            links.join_all(rows[0], rows[1:])
    return np.array([links.first(row) for row in range(len(data))], dtype=np.int64)


def _above(mean: float, same_N: float) -> float:
    """The mean up to which a profile may be near, with room for the rounding of two means."""
    return mean + same_N + 1e-9 * max(1.0, abs(mean))


def _rows_by(labels: Sequence[Hashable]) -> list[list[int]]:
    rows: dict[Hashable, list[int]] = {}
    for row, label in enumerate(labels):
        rows.setdefault(label, []).append(row)
    return list(rows.values())


class _Links:
    """Rows that belong together, by the least row of each set."""

    def __init__(self, rows: int) -> None:
        self.parent = list(range(rows))

    def first(self, row: int) -> int:
        """The least row of the set that this one is in."""
        while self.parent[row] != row:
            self.parent[row] = self.parent[self.parent[row]]
            row = self.parent[row]
        return row

    def join_all(self, row: int, others: Iterable[int]) -> None:
        """Make one set of the row's and the others'."""
        for other in others:
            low, high = sorted((self.first(row), self.first(other)))
            self.parent[high] = low
