"""Simulated people who never met the training data: what they say of a profile that nobody has rated yet."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from palpate.modeling.doors.data import ModelDataError
from palpate.modeling.doors.methods import as_rows
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


def door_ratings() -> Study:
    """The shipped rating study, whose simulated people these are (thesis 5.3.4.2)."""
    return read_study(SHIPPED / "door_ratings" / "study.yaml").study


@dataclass(frozen=True)
class Perceivers:
    """`people` simulated raters of a study, each with own gain and bias, and noise for every answer.

    What they feel is z-scored against the study's own stimulus table, so a profile stands where it would stand among
    the stimuli of the study. The draws are keyed by person and by the profile's forces: neither the order of the rows
    nor what else is rated changes an answer.
    """

    people: int = PEOPLE
    seed: int = 1
    study: Study = field(default_factory=door_ratings)

    def __post_init__(self) -> None:
        if self.people < 1:
            raise ModelDataError(f"{self.people} people cannot judge a profile; at least one is needed.")
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
        """Mean ratings (n, attributes) of all people on the study's scale, of profiles (n, 621) in newtons."""
        return np.array([self._rated(profile) for profile in as_rows(force_N, POINTS, "force profiles")])

    def felt(self, force_N: Array) -> Array:
        """What a person without gain, bias, noise and steps would answer: (n, attributes) on the study's scale."""
        scale = self.scale
        latent = np.array([self._latents(profile) for profile in as_rows(force_N, POINTS, "force profiles")])
        return np.clip((scale.low + scale.high) / 2 + latent, scale.low, scale.high)

    @property
    def scale(self) -> Scale:
        """The study's rating scale."""
        if self.study.scale is None:
            raise ModelDataError(f"{self.study.study} has no rating scale.")
        return self.study.scale

    def _rated(self, profile: Array) -> Array:
        at: tuple[Key, ...] = ("profile", hashlib.sha256(profile.tobytes()).hexdigest())
        felt = list(zip(self.study.attributes, self._latents(profile), strict=True))
        answers = [[person.rating(each, a, self.scale, at) for a, each in felt] for person in self.persons]
        mean: Array = np.mean(answers, axis=0)
        return mean

    def _latents(self, profile: Array) -> list[float]:
        columns = describe(as_profile(profile))
        return [self.persons[0].latent_of(attribute, columns) for attribute in self.attributes]
