"""Ratings of door profiles by person, and the means that models are trained on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from palpate.modeling.doors.data import DoorData, near_groups
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.wording import some
from palpate.signals.arrays import Array, Indices
from palpate.signals.doors.grid import POINTS

SHOWN = 5
"""The most names that a message lists."""


@dataclass(frozen=True)
class Individual:
    """The individual ratings: `value` is (people, stimuli, attributes) on the study's scale, NaN where not rated.

    The stimuli are the rows of the data beside it. `groups` names each person's group of raters ("" without groups).
    """

    people: tuple[str, ...]
    groups: tuple[str, ...]
    value: Array


@dataclass(frozen=True)
class Rated:
    """The data that models learn from, and the individual ratings behind its means."""

    data: DoorData
    individual: Individual


@dataclass(frozen=True)
class StimulusProfile:
    """A stimulus that people felt: its name, door and variant, and its 621 forces in newtons."""

    id: str
    door: str
    variant: str
    force_N: Array


@dataclass(frozen=True)
class Questions:
    """The questions of a study: attributes by their low words, their antonyms, the ends of the scale."""

    attributes: tuple[str, ...]
    antonyms: tuple[str, ...]
    scale: tuple[float, float]


def rated_of(
    shown: Sequence[StimulusProfile], questions: Questions, ratings: pd.DataFrame, *, simulated: bool,
    made_from: Sequence[str], rated_only: bool = False,
) -> Rated:  # fmt: skip
    """Return the ratings of these stimuli, and their means.

    `ratings` has the columns participant, group, stimulus, attribute and value.

    A person who rated a stimulus more than once counts once, with the mean of those ratings. With `rated_only`,
    stimuli without a rating on every attribute are left out. Raises DataRefused on a rating off the scale,
    ModelDataError on an attribute or a stimulus that nobody rated, and where fewer than two different profiles are
    left.
    """
    from palpate.modeling.lab_answers import demand_on_scale

    given = ratings[ratings["value"].notna()]
    demand_on_scale(given, *questions.scale)
    stimuli = [stimulus.id for stimulus in shown]
    individual = _individual_ratings(given, stimuli, questions.attributes)
    rated = _answered(individual).any(axis=(0, 1))
    if not rated.all():
        names = [name for name, here in zip(questions.attributes, rated, strict=True) if not here]
        raise ModelDataError(f"nobody rated {', '.join(names)}: ratings on every attribute are expected")
    is_rated = _answered(individual).any(axis=0).all(axis=-1)
    if not is_rated.all() and not rated_only:
        names = [name for name, here in zip(stimuli, is_rated, strict=True) if not here]
        raise ModelDataError(
            f"no ratings of {some(names, SHOWN)} on every attribute; collect them, or leave such stimuli out"
            " (rated_only)"
        )
    chosen = np.flatnonzero(is_rated)
    # the ratings of these stimuli only, without people who rated none of them
    value = individual.value[:, chosen]
    here = np.flatnonzero(~np.isnan(value).all(axis=(1, 2)))
    groups = tuple(individual.groups[i] for i in here)
    individual = Individual(tuple(individual.people[i] for i in here), groups, value[here])
    data = _mean_ratings([shown[i] for i in chosen], questions, individual, simulated, tuple(made_from))
    demand_learnable(data)
    return Rated(data, individual)


def _individual_ratings(ratings: pd.DataFrame, stimuli: Sequence[str], attributes: Sequence[str]) -> Individual:
    """Return the ratings of each person, the mean of those that a person gave to one stimulus more than once."""
    people = sorted(set(ratings["participant"]))
    group = dict(zip(ratings["participant"], ratings["group"].astype(str), strict=True))
    places = []
    for column, names in (("participant", people), ("stimulus", stimuli), ("attribute", attributes)):
        at = {name: i for i, name in enumerate(names)}
        places.append(np.array([at[name] for name in ratings[column]], dtype=np.int64))
    shape = (len(people), len(stimuli), len(attributes))
    total, count = np.zeros(shape), np.zeros(shape)
    np.add.at(total, tuple(places), ratings["value"].to_numpy(dtype=np.float64))
    np.add.at(count, tuple(places), 1.0)
    value = np.divide(total, count, out=np.full(shape, np.nan), where=count > 0)
    return Individual(tuple(people), tuple(group[who] for who in people), value)


def demand_learnable(data: DoorData) -> None:
    """Raise ModelDataError unless two profiles differ perceptibly, and there are at least two sources."""
    if len(set(near_groups(data.force_N).tolist())) < 2:
        what = f"{len(data)} stimuli, of one force profile" if len(data) > 1 else f"{len(data)} stimulus"
        raise ModelDataError(f"{what}: nothing can be learned from that; at least two different profiles are needed")
    if len(set(data.source)) < 2:
        raise ModelDataError(
            f"{len(data)} stimuli, all of the source {data.source[0]!r}: nothing can be tested on what a model has not"
            " seen; at least two sources are needed"
        )


def merged_sources(ids: Sequence[str], force_N: Array) -> tuple[str, ...]:
    """Return for each stimulus the first name, in sorted order, among those with (nearly) the same profile."""
    groups = near_groups(force_N)
    return tuple(min(name for name, other in zip(ids, groups, strict=True) if other == group) for group in groups)


def _mean_ratings(
    shown: Sequence[StimulusProfile],
    questions: Questions,
    individual: Individual,
    simulated: bool,
    made_from: tuple[str, ...],
) -> DoorData:
    ids = tuple(stimulus.id for stimulus in shown)
    force = np.array([stimulus.force_N for stimulus in shown], dtype=np.float64).reshape(len(ids), POINTS)
    is_rated = _answered(individual)
    count: Indices = is_rated.sum(axis=0)
    mean = np.nansum(individual.value, axis=0) / count
    # the SD between raters (n - 1), NaN where one person rated: an SD that nobody knows is not 0
    squares = np.nansum((individual.value - mean) ** 2, axis=0)
    variance: Array = np.divide(squares, count - 1, out=np.full(mean.shape, np.nan), where=count > 1)
    return DoorData(
        attributes=questions.attributes,
        antonyms=questions.antonyms,
        scale=questions.scale,
        ids=ids,
        doors=tuple(stimulus.door for stimulus in shown),
        variants=tuple(stimulus.variant for stimulus in shown),
        source=merged_sources(ids, force),
        groups=tuple(
            "+".join(sorted({group for group, here in zip(individual.groups, by_person, strict=True) if here}))
            for by_person in is_rated.any(axis=2).T
        ),
        force_N=force,
        rating=mean,
        sd=np.sqrt(variance),
        raters=count.min(axis=1).astype(np.int64),
        simulated=simulated,
        made_from=made_from,
    )


def _answered(individual: Individual) -> Any:
    """Return a mask (people, stimuli, attributes) of the ratings that are there."""
    return ~np.isnan(individual.value)
