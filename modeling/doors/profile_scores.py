"""Scores of made profiles: the loop back to ratings, plausibility, extreme wishes, one slider at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.doors.corners import HIGH, LOW, corners, extremes, singles, unplayable
from palpate.modeling.doors.data import DoorData, ModelDataError, Scaling
from palpate.modeling.doors.methods import Fitted, as_rows
from palpate.modeling.doors.perceivers import Perceivers
from palpate.modeling.doors.plausibility import judged_all
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS

PLAUSIBLE = ("greatest_N", "steepest_N_deg", "work_J_m", "distance_N", "beyond")
Arrays = dict[str, NDArray[Any]]


def perceivers_for(data: DoorData) -> Perceivers | None:
    """Simulated people who never saw the data; None where its ratings come from real people, or from another study."""
    if not data.simulated:
        return None
    people = Perceivers()
    same = people.attributes == data.attributes and (people.scale.low, people.scale.high) == tuple(data.scale)
    return people if same else None


def profile_scores(scaling: Scaling, test: DoorData, made_N: Array, known_N: Array, judge: Fitted) -> Arrays:
    """Of the profiles made for the test side's ratings: ratings by the judge and by fresh people, plausibility.

    `known_N` are the profiles of the training side, `judge` the forward model that was fitted to it.
    """
    wish = scaling.rating_up(test.rating)
    scores: Arrays = {"wish": wish, **_loop(scaling, test, wish, made_N, judge)}
    judgements = judged_all(made_N, known_N)
    for name in PLAUSIBLE:
        scores[name] = np.array([getattr(plausible, name) for plausible in judgements])
    scores["playable"] = np.array([float(judgement.playable) for judgement in judgements])
    return scores


def _loop(scaling: Scaling, test: DoorData, wish: Array, made_N: Array, judge: Fitted) -> Arrays:
    people = perceivers_for(test)
    if people is None:
        return {"loop_judge": judge.predict(made_N)}
    loop = loop_error(wish, made_N, judge, people, scaling)
    return {"loop_judge": loop.predicted, "loop_fresh": loop.perceived, "loop_felt": loop.felt}


def corner_scores(
    scaling: Scaling, test: DoorData, model: Fitted, known_N: Array, judge: Fitted
) -> tuple[Arrays, dict[str, float]]:
    """Return the scores at all corners of the sliders, and with each slider alone at 10 and 90 (thesis 5.7.1)."""
    wishes = corners(len(test.attributes))
    extreme = extremes(model, wishes, judge, known_N)
    nearest = np.array([corner.nearest for corner in extreme])
    numbers = {
        "corners": float(len(extreme)),
        "corners_unplayable": float(unplayable(extreme)),
        "corners_had": float(sum(corner.had for corner in extreme)),
        "corners_off": float(np.mean(np.abs(nearest - wishes))),
        "corners_greatest_N": max(corner.plausibility.greatest_N for corner in extreme),
        "corners_steepest_N_deg": max(corner.plausibility.steepest_N_deg for corner in extreme),
    }
    alone = model.predict(singles(len(test.attributes), LOW, HIGH))
    people = perceivers_for(test)
    felt = judge.predict(alone) if people is None else scaling.rating_up(people.rate(alone))
    return {"corner_nearest": nearest, "alone": felt}, numbers


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
