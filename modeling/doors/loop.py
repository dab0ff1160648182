"""The loop: wished ratings make a profile, the profile is rated, and the ratings are held against the wish."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modeling.doors.data import POINTS, Array, ModelDataError
from modeling.doors.methods import Fitted, as_rows
from modeling.doors.perceivers import Perceivers
from modeling.doors.scaling import Scaling

TARGET = 5.0
"""The mean absolute error that a wish which can be had should not exceed, in points of 100."""


@dataclass(frozen=True)
class Loop:
    """Wishes and what became of them, each (n, attributes) in points of 0..100.

    `predicted` is what the forward model says of the made profiles, `perceived` the mean of simulated people who never
    saw the training data, `felt` what these would answer without gain, bias, noise and steps. None is clipped to
    0..100, which is the range of the mean ratings of the whole data set; the people's own scale reaches farther.
    """

    wish: Array
    predicted: Array
    perceived: Array
    felt: Array

    @property
    def by_model(self) -> Array:
        """Mean absolute error of each attribute (attributes,) by the forward model."""
        return _mae(self.predicted, self.wish)

    @property
    def by_people(self) -> Array:
        """The same by the simulated people."""
        return _mae(self.perceived, self.wish)

    @property
    def without_noise(self) -> Array:
        """The same by what these people would answer without gain, bias, noise and steps."""
        return _mae(self.felt, self.wish)

    @property
    def raters(self) -> Array:
        """How far the people's mean lies from what they felt (attributes,): no profile could mend that."""
        return _mae(self.perceived, self.felt)

    @property
    def raters_share(self) -> float:
        """The share of the squared error by people that is gone without their gain, bias, noise and steps."""
        total = float(np.mean((self.perceived - self.wish) ** 2))
        return 1.0 - float(np.mean((self.felt - self.wish) ** 2)) / total if total > 0 else 0.0

    def rows(self, attributes: Sequence[str]) -> list[dict[str, str | float]]:
        """A table row for each attribute and one for their mean: `attribute` and the four errors."""
        columns = {"by_model": self.by_model, "by_people": self.by_people, "without_noise": self.without_noise}
        columns |= {"raters": self.raters}
        named = [*enumerate(attributes), (None, "mean")]
        return [
            {"attribute": name, **{k: float(v.mean() if at is None else v[at]) for k, v in columns.items()}}
            for at, name in named
        ]


def loop_error(wish: Array, made_N: Array, forward: Fitted, perceivers: Perceivers, scaling: Scaling) -> Loop:
    """Hold the ratings of made profiles (n, 621) in newtons against the wishes (n, attributes) on 0..100.

    A fair judge saw neither the wishes' profiles nor the made ones: `forward` is fitted to the training side alone, and
    the perceivers bear pseudonyms that the data does not have. Raises ModelDataError where the shapes do not fit.
    """
    wishes = as_rows(wish, len(perceivers.attributes), "wishes")
    made = as_rows(made_N, POINTS, "made profiles")
    if len(wishes) != len(made):
        raise ModelDataError(f"{len(wishes)} wishes and {len(made)} made profiles: one profile for each is expected.")
    rated = (scaling.rating_up(perceivers.rate(made)), scaling.rating_up(perceivers.felt(made)))
    return Loop(wishes, forward.predict(made), *rated)


def joined(loops: Sequence[Loop]) -> Loop:
    """The loops of several folds as one."""
    names = ("wish", "predicted", "perceived", "felt")
    return Loop(*(np.concatenate([getattr(loop, name) for loop in loops]) for name in names))


def _mae(answers: Array, wish: Array) -> Array:
    error: Array = np.abs(answers - wish).mean(axis=0)
    return error
