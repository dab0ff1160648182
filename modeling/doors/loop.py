"""The loop: wished ratings make a profile, the profile is rated, and the ratings are held against the wish."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.modeling.doors.data import ModelDataError
from palpate.modeling.doors.methods import Fitted, as_rows
from palpate.modeling.doors.perceivers import Perceivers
from palpate.modeling.doors.scaling import Scaling
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS


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
