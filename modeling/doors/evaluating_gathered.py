"""The folds of one method put together: every stimulus once, with what people said and what was predicted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.evaluating_jobs import Context, Done, data_of
from palpate.modeling.doors.registry import Direction
from palpate.modeling.doors.scaling import TOP
from palpate.signals.arrays import Array, Indices


@dataclass(frozen=True)
class Gathered:
    """One method on one split, rows in the data's order.

    Forward: `actual` and `predicted` (n, attributes) on 0..100, `sd` the SD between raters on the same. Inverse: both
    are (n, 621) in percent of the range of all forces, `made_N` the made profiles in newtons. `fold` (n,) says in which
    fold a row was tested.
    """

    direction: Direction
    method: str
    split: str
    data: DoorData
    fold: Indices
    actual: Array
    predicted: Array
    sd: Array
    done: tuple[Done, ...]

    def number(self, name: str) -> float | None:
        """The number that the first fold which has it measured, None where none did."""
        return next((each.numbers[name] for each in self.done if name in each.numbers), None)

    def total(self, name: str) -> float:
        """The sum over the folds."""
        return float(sum(each.numbers.get(name, 0.0) for each in self.done))

    def array(self, name: str) -> Array | None:
        """An array with a row for each tested stimulus, in the data's order; None where the folds have none."""
        if not all(name in each.arrays for each in self.done):
            return None
        together = np.concatenate([each.arrays[name] for each in self.done])
        return np.asarray(together[np.argsort(_tested(self.done), kind="stable")])


def gathered(context: Context, done: Iterable[Done]) -> Gathered:
    """The folds of one method on one split together. They are all of one method: see `by_method`."""
    folds = tuple(done)
    job = folds[0].job
    tested = _tested(folds)
    order = np.argsort(tested, kind="stable")
    data = data_of(context, job.split).rows(tested[order])
    predicted = np.concatenate([each.predicted for each in folds])[order]
    fold = np.concatenate([np.full(len(each.test), each.job.fold, dtype=np.int64) for each in folds])[order]
    scaling = context.scaling
    if job.direction == "forward":
        actual = scaling.rating_up(data.rating)
    else:
        actual, predicted = scaling.force_up(data.force_N), scaling.force_up(predicted)
    sd = data.sd * TOP / (scaling.rating[1] - scaling.rating[0])
    return Gathered(job.direction, job.method, job.split, data, fold, actual, predicted, sd, folds)


def by_method(context: Context, done: Iterable[Done]) -> dict[tuple[Direction, str, str], Gathered]:
    """All results by direction, method and split, in the order in which they were asked for."""
    found: dict[tuple[Direction, str, str], list[Done]] = {}
    for each in done:
        found.setdefault((each.job.direction, each.job.method, each.job.split), []).append(each)
    return {which: gathered(context, folds) for which, folds in found.items()}


def _tested(folds: tuple[Done, ...]) -> Indices:
    return np.concatenate([each.test for each in folds])
