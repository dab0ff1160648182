"""The data that door models are trained on: profiles, mean ratings, their scaling, and stimuli of equal profiles."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Self, TypeVar

import numpy as np

from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.arrays import Array, Indices

Label = TypeVar("Label", bound=Hashable)
_NAMES = ("ids", "doors", "variants", "source", "groups")
_ARRAYS = ("force_N", "rating", "sd", "raters")
TOP = 100.0
SAME_N = 0.1
"""Profiles that differ by no more than this anywhere count as equal.

It lies far above the rounding of a file (0.0001 N) and far below what people can distinguish: some 7 % of a force
(Pang, Tan and Durlach 1991), and the smallest difference between two profiles of the door study that are not meant to
be equal is 1.9 N.
"""


@dataclass(frozen=True)
class DoorData:
    """One row for each stimulus.

    `force_N` is (n, 621), in newtons over 0..62 degrees; `rating` (n, attributes) the mean over raters on the study's
    scale, from `scale[0]` (the attribute's own word) to `scale[1]` (its antonym); `sd` the SD between raters, NaN where
    it is not known (one rater, or a table without it); `raters` (n,) how many there were, the fewest where attributes
    differ, 0 where it is not known. `source` names what a stimulus was made from: stimuli of one source never lie on
    both sides of a split. `groups` (n,) names the people who rated it (one group of raters rates some of the stimuli).
    """

    attributes: tuple[str, ...]
    antonyms: tuple[str, ...]
    scale: tuple[float, float]
    ids: tuple[str, ...]
    doors: tuple[str, ...]
    variants: tuple[str, ...]
    source: tuple[str, ...]
    groups: tuple[str, ...]
    force_N: Array
    rating: Array
    sd: Array
    raters: Indices
    simulated: bool
    made_from: tuple[str, ...] = ()
    """The inputs of the data: files and their SHA-256, one line each."""

    def __len__(self) -> int:
        return len(self.ids)

    def rows(self, which: Indices) -> Self:
        """Return the same data with these rows only, in this order."""
        picked: dict[str, Any] = {name: tuple(getattr(self, name)[i] for i in which) for name in _NAMES}
        picked |= {name: getattr(self, name)[which] for name in _ARRAYS}
        return replace(self, **picked)

    @property
    def digest(self) -> str:
        """The SHA-256 over everything that a model can learn from."""
        state = hashlib.sha256("\x1f".join((*self.attributes, *self.ids, *self.source)).encode())
        for array in (self.force_N, self.rating, np.asarray(self.scale, dtype=np.float64)):
            state.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
        return state.hexdigest()


@dataclass(frozen=True)
class Scaling:
    """The values that become 0 and 100: forces in newtons, ratings on the study's scale, one range for all stimuli."""

    force_N: tuple[float, float]
    rating: tuple[float, float]

    def force_up(self, force_N: Array) -> Array:
        """Return newtons as 0..100; forces beyond the range lie beyond 0..100."""
        return _up(force_N, self.force_N)

    def force_down(self, scaled: Array) -> Array:
        """Return values on 0..100 as newtons."""
        return _down(scaled, self.force_N)

    def rating_up(self, rating: Array) -> Array:
        """Return ratings on the study's scale as 0..100."""
        return _up(rating, self.rating)

    def rating_down(self, scaled: Array) -> Array:
        """Return values on 0..100 as ratings on the study's scale."""
        return _down(scaled, self.rating)


def scaling_of(data: DoorData) -> Scaling:
    """Return the scaling of a whole data set. Raises ModelDataError where all forces or all ratings are equal."""
    return Scaling(_range(data.force_N, "forces"), _range(data.rating, "ratings"))


def _range(values: Array, what: str) -> tuple[float, float]:
    low, high = float(np.min(values)), float(np.max(values))
    if not low < high:
        raise ModelDataError(f"all {what} are {low:g}: there is nothing to learn from; at least two differ in a study.")
    return low, high


def _up(values: Array, ends: tuple[float, float]) -> Array:
    return (np.asarray(values, dtype=np.float64) - ends[0]) / (ends[1] - ends[0]) * TOP


def _down(values: Array, ends: tuple[float, float]) -> Array:
    return np.asarray(values, dtype=np.float64) / TOP * (ends[1] - ends[0]) + ends[0]


def near_groups(force_N: Array, same_N: float = SAME_N) -> Indices:
    """Return for each profile (n, 621) the first row of its group (n,).

    Profiles whose greatest difference is at most `same_N` newtons are in one group, and all that such pairs link.
    """
    links = _Links(len(force_N))
    # two profiles that are near everywhere have means that are near, so only neighbours in the mean are compared
    with np.errstate(over="ignore", invalid="ignore"):
        mean = force_N.mean(axis=1)
        order = np.argsort(mean, kind="stable")
        for place, row in enumerate(order):
            above = mean[row] + same_N + 1e-9 * max(1.0, abs(mean[row]))  # with room for the rounding of two means
            last = int(np.searchsorted(mean[order], above, side="right"))
            others = order[place + 1 : last]
            near = np.abs(force_N[others] - force_N[row]).max(axis=1, initial=0.0) <= same_N
            links.join_all(int(row), others[near].tolist())
    return np.array([links.first(row) for row in range(len(force_N))], dtype=np.int64)


def source_groups(data: DoorData, same_N: float = SAME_N) -> Indices:
    """Return a number for each stimulus (n,), equal for stimuli of one source or of (nearly) one profile."""
    links = _Links(len(data))
    for groups in (near_groups(data.force_N, same_N).tolist(), data.source):
        for rows in rows_by_label(groups).values():
            links.join_all(rows[0], rows[1:])
    return np.array([links.first(row) for row in range(len(data))], dtype=np.int64)


def rows_by_label(labels: Iterable[Label]) -> dict[Label, list[int]]:
    """Return the rows of each label, in the order in which the labels first come."""
    rows: dict[Label, list[int]] = {}
    for row, label in enumerate(labels):
        rows.setdefault(label, []).append(row)
    return rows


class _Links:
    """Disjoint sets of rows (union-find); the least row names its set."""

    def __init__(self, rows: int) -> None:
        self.parent = list(range(rows))

    def first(self, row: int) -> int:
        """Return the least row of the set that this row is in."""
        while self.parent[row] != row:
            self.parent[row] = self.parent[self.parent[row]]
            row = self.parent[row]
        return row

    def join_all(self, row: int, others: Iterable[int]) -> None:
        """Merge the sets of all these rows."""
        for other in others:
            low, high = sorted((self.first(row), self.first(other)))
            self.parent[high] = low
