"""Scores of made profiles: the loop back to ratings, plausibility, extreme wishes, one slider at a time.

The loop is closed by simulated people who never saw the training data, and by the forward model."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.doors.data import DoorData, Scaling
from palpate.modeling.doors.methods import Fitted
from palpate.modeling.doors.plausibility import HIGH, LOW, assess_profiles, corners, extremes, singles, unplayable
from palpate.modeling.evaluate.rows import ModelDataError, as_rows
from palpate.protocols.keyed import Key
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.study import Scale, Study
from palpate.protocols.trial import ParticipantRow
from palpate.signals.arrays import Array
from palpate.signals.doors.features import as_profile, describe
from palpate.signals.doors.grid import POINTS
from palpate.studies.catalogue import SHIPPED, read_study

PEOPLE = 40
LETTER = "J"
"""Pseudonyms J001, J002, ...: a simulated study has P001, P002, ..., and every trait is drawn by pseudonym."""
PLAUSIBLE = ("greatest_N", "steepest_N_deg", "work_J_m", "distance_N", "beyond")
Arrays = dict[str, NDArray[Any]]


def door_ratings() -> Study:
    """Return the shipped rating study, whose simulated people rate here (thesis 5.3.4.2)."""
    return read_study(SHIPPED / "door_ratings" / "study.yaml").study


@dataclass(frozen=True)
class Perceivers:
    """`people` simulated raters of a study, each with their own gain and bias, and noise for every answer.

    Features are z-scored against the study's own stimulus table, so a profile is rated as it would be among the stimuli
    of the study. The draws are keyed by person and by the profile's forces: neither the order of the rows nor the other
    profiles change an answer.
    """

    people: int = PEOPLE
    seed: int = 1
    study: Study = field(default_factory=door_ratings)

    def __post_init__(self) -> None:
        if self.people < 1:
            raise ModelDataError(f"{self.people} people cannot rate a profile; at least one is needed.")
        if self.study.simulation is None:
            raise ModelDataError(f"{self.study.study} does not say how simulated people perceive (simulation:).")

    @property
    def attributes(self) -> tuple[str, ...]:
        """The attributes by their low word, in the study's order."""
        return tuple(attribute.name for attribute in self.study.attributes)

    @cached_property
    def persons(self) -> tuple[Perceiver, ...]:
        """The people, in turn from the study's groups."""
        groups: list[str | None] = [*sorted(self.study.groups)] or [None]
        plans = [compile_plan(self.study, ParticipantRow(f"{LETTER}000", group), self.seed) for group in groups]
        rows = [(f"{LETTER}{n + 1:03d}", n % len(plans)) for n in range(self.people)]
        return tuple(Perceiver(replace(plans[g], who=ParticipantRow(name, groups[g]))) for name, g in rows)

    def rate(self, force_N: Array) -> Array:
        """Return mean ratings (n, attributes) of all people on the study's scale, of profiles (n, 621) in newtons."""
        means: list[Array] = []
        for profile in as_rows(force_N, POINTS, "force profiles"):
            at: tuple[Key, ...] = ("profile", hashlib.sha256(profile.tobytes()).hexdigest())
            latents = list(zip(self.study.attributes, self._latents(profile), strict=True))
            answers = [[person.rating(latent, a, self.scale, at) for a, latent in latents] for person in self.persons]
            means.append(np.mean(answers, axis=0))
        return np.array(means)

    def felt(self, force_N: Array) -> Array:
        """Return the ratings (n, attributes) of a person without gain, bias, noise and steps, on the study's scale."""
        scale = self.scale
        latent = np.array([self._latents(profile) for profile in as_rows(force_N, POINTS, "force profiles")])
        return np.clip((scale.low + scale.high) / 2 + latent, scale.low, scale.high)

    @property
    def scale(self) -> Scale:
        """The study's rating scale."""
        if self.study.scale is None:
            raise ModelDataError(f"{self.study.study} has no rating scale.")
        return self.study.scale

    def _latents(self, profile: Array) -> list[float]:
        columns = describe(as_profile(profile))
        return [self.persons[0].latent_of(attribute, columns) for attribute in self.attributes]


def perceivers_for(data: DoorData) -> Perceivers | None:
    """Return simulated people who never saw the data; None for ratings of real people, or of another study."""
    if not data.simulated:
        return None
    people = Perceivers()
    same = people.attributes == data.attributes and (people.scale.low, people.scale.high) == tuple(data.scale)
    return people if same else None


def profile_scores(scaling: Scaling, test: DoorData, made_N: Array, known_N: Array, judge: Fitted) -> Arrays:
    """Score the profiles made for the test side's ratings: ratings by the judge and by fresh people, plausibility.

    `known_N` are the profiles of the training side, `judge` the forward model that was fitted to it.
    """
    wish = scaling.rating_up(test.rating)
    scores: Arrays = {"wish": wish}
    if (people := perceivers_for(test)) is None:
        scores["loop_judge"] = judge.predict(made_N)
    else:
        loop = loop_error(wish, made_N, judge, people, scaling)
        scores |= {"loop_judge": loop.predicted, "loop_fresh": loop.perceived, "loop_felt": loop.felt}
    assessed = assess_profiles(made_N, known_N)
    for name in PLAUSIBLE:
        scores[name] = np.array([getattr(plausible, name) for plausible in assessed])
    scores["playable"] = np.array([float(plausible.playable) for plausible in assessed])
    return scores


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
        "corners_had": float(sum(corner.is_attained for corner in extreme)),
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
    """Wishes and the ratings of their profiles, each (n, attributes) in points of 0..100.

    `predicted` are the ratings by the forward model, `perceived` the means of simulated people who never saw the
    training data, `felt` those of the same people without gain, bias, noise and steps. None is clipped to 0..100, which
    is the range of the mean ratings of the whole data set; the people's own scale reaches farther.
    """

    wish: Array
    predicted: Array
    perceived: Array
    felt: Array


def loop_error(wish: Array, made_N: Array, forward: Fitted, perceivers: Perceivers, scaling: Scaling) -> Loop:
    """Rate made profiles (n, 621) in newtons, to be compared with their wishes (n, attributes) on 0..100.

    A fair judge saw neither the wishes' profiles nor the made ones: `forward` is fitted to the training side alone, and
    the perceivers have pseudonyms that the data does not have. Raises ModelDataError where the shapes do not fit.
    """
    wishes = as_rows(wish, len(perceivers.attributes), "wishes")
    made = as_rows(made_N, POINTS, "made profiles")
    if len(wishes) != len(made):
        raise ModelDataError(f"{len(wishes)} wishes and {len(made)} made profiles: one profile for each is expected.")
    rated = (scaling.rating_up(perceivers.rate(made)), scaling.rating_up(perceivers.felt(made)))
    return Loop(wishes, forward.predict(made), *rated)
