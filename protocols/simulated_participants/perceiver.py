"""A simulated participant who perceives latent attributes of a stimulus and answers on the study's scale."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import cast

from palpate.protocols.events import Ask, Present, Reply, Rest
from palpate.protocols.forms import FORMS, Sliders
from palpate.protocols.keyed import Key, normal, uniform
from palpate.protocols.plan import Plan
from palpate.protocols.simulated_participants import Feels, ParticipantKind
from palpate.protocols.study import Attribute, Scale, Simulation, Stimulus

GAIN_FLOOR = 0.1
INTERCEPT = "intercept"


@dataclass(frozen=True)
class Perceiver:
    """A person with a gain and bias per attribute, noise per answer, and occasional lapses and revisions.

    answer = gain x (sum of weight x z-score of the stimulus column) + bias + noise, put on the scale. What a device
    measured of a stimulus replaces the values of its table: `feels`. Every draw is keyed by seed, participant, trial,
    attempt and attribute: nothing depends on earlier draws. Gain and bias are the same in all of a person's sessions;
    noise and lapses differ between sessions.
    """

    plan: Plan
    reading_s: float = 20.0
    feels: Feels | None = None

    @cached_property
    def simulation(self) -> Simulation:
        """Return the study's simulation, or one of people who answer by noise alone if it has none."""
        return self.plan.study.simulation or Simulation(latents={})

    @cached_property
    def z_scores(self) -> Mapping[str, Mapping[str, float]]:
        """Return z-scores over all stimuli of the study, by column and stimulus id; 0 where a column is constant."""
        return {column: z_scores(self.plan.study.stimuli, column) for column in self.columns}

    @cached_property
    def standings(self) -> Mapping[str, tuple[float, float]]:
        """Return the mean and SD over all stimuli of the study, by column."""
        return {column: standing(self.plan.study.stimuli, column) for column in self.columns}

    @property
    def columns(self) -> list[str]:
        """Return the columns of the stimulus table that affect any answer."""
        return sorted({c for weights in self.simulation.latents.values() for c in weights} - {INTERCEPT})

    def latent(self, item: str, stimulus: Stimulus) -> float:
        """Return the percept common to all people: scale units around the middle of the scale, or a logit for a
        word.
        """
        if self.feels is not None and (felt := self.feels(stimulus)):
            columns = {column: float(stimulus.columns[column]) for column in self.columns}
            return self.latent_of(item, {**columns, **felt})
        return weighed(self.simulation.latents.get(item, {}), lambda column: self.z_scores[column][stimulus.id])

    def latent_of(self, item: str, columns: Mapping[str, float]) -> float:
        """Return the percept common to all people of a stimulus outside the study, by the columns of its table.

        Each column is z-scored as the study's own stimuli are. Raises ValueError for a column that is missing.
        """
        weights = self.simulation.latents.get(item, {})
        if missing := [column for column in weights if column != INTERCEPT and column not in columns]:
            raise ValueError(f"{item} is felt by {', '.join(missing)}, which this stimulus does not have")
        return weighed(weights, lambda column: z_score(columns[column], self.standings[column]))

    def gain(self, attribute: Attribute) -> float:
        """Return the participant's own gain, at least 0.1."""
        spread = self.simulation.gain_sd * self._left_by_anchors(attribute)
        return max(GAIN_FLOOR, 1.0 + spread * normal(*self.trait("gain", attribute.name)))

    def bias(self, attribute: Attribute) -> float:
        """Return the participant's own bias in scale units."""
        spread = self.simulation.bias_sd * self._left_by_anchors(attribute)
        return spread * normal(*self.trait("bias", attribute.name))

    def _left_by_anchors(self, attribute: Attribute) -> float:
        """Return the share of a person's own gain and bias that remains after the study's references."""
        anchors = self.plan.study.anchors
        known = {anchor.attribute for anchor in anchors.stimuli} if anchors is not None else set()
        return 1.0 - self.simulation.anchored if attribute.name in known else 1.0

    def answer(self, ask: Ask) -> tuple[Reply, float]:
        """Return the reply to any form and the seconds it took; the reply may go back to the trial before."""
        if ask.may_go_back and self.has_second_thoughts(ask):
            return Reply({"go": "back", "seconds": 1.0}), 1.0
        return self._fill_in(ask)

    def leave_sliders(self, request: Present) -> Mapping[str, float]:
        """Return where the sliders are left that are moved while the door is felt: at the next setting.

        Raises ValueError for a request without such sliders.
        """
        if (form := request.live_form) is None:
            raise ValueError(f"{request.trial.stimulus.id}: no sliders are moved while it is felt")
        answers: Mapping[str, float] = self._fill_in(Ask(form, request.trial, request.wish))[0].value["answers"]
        return answers

    def _fill_in(self, ask: Ask) -> tuple[Reply, float]:
        return cast(tuple[Reply, float], FORMS[ask.form.name].simulate(self, ask, ask.form))

    def rate(self, ask: Ask, form: Sliders) -> tuple[Reply, float]:
        """Return the reply to a rating form and the seconds it took."""
        if ask.trial is None:
            raise ValueError("a rating form needs a trial")
        answers, at_s, clock = {}, {}, 0.0
        for attribute in form.attributes:
            clock = round(clock + self.seconds(ask, attribute.name), 3)
            latent = self.latent(attribute.name, ask.trial.stimulus)
            answers[attribute.name] = self.rating(latent, attribute, form.scale, place(ask))
            at_s[attribute.name] = clock
        return Reply({"answers": answers, "at_s": at_s, "seconds": clock}), clock

    def lapses(self, ask: Ask, attribute: Attribute) -> bool:
        """Return whether this answer is a lapse."""
        return self._lapses(attribute, place(ask))

    def rest_s(self, rest: Rest) -> float:
        """Return how long the participant rests, in seconds."""
        who = self.plan.who.participant
        return round(60.0 + 60.0 * uniform("rest", self.plan.seed, who, *self.plan.occasion, rest.done), 3)

    def has_second_thoughts(self, ask: Ask) -> bool:
        """Return whether the participant goes back to the trial before, at the first attempt at a trial."""
        first = ask.trial is not None and ask.trial.attempt == 1
        return first and uniform(*self.moment("revise", ask, "")) < self.simulation.revise_rate

    def seconds(self, ask: Ask, item: str) -> float:
        """Return how long the answer to one item takes."""
        return self.simulation.answer_s * math.exp(0.4 * normal(*self.moment("time", ask, item)))

    def trait(self, what: str, item: str) -> tuple[Key, ...]:
        """Return the key of a property that the participant has in every session."""
        return (what, self.plan.study.study, self.plan.seed, self.plan.who.participant, item)

    def moment(self, what: str, ask: Ask, item: str) -> tuple[Key, ...]:
        """Return the key of a draw for one item of one form."""
        return self.keyed(what, place(ask), item)

    def keyed(self, what: str, at: tuple[Key, ...], item: str) -> tuple[Key, ...]:
        """Return the key of a draw for one item at one moment of one session."""
        plan = self.plan
        return (what, plan.study.study, plan.seed, plan.who.participant, *plan.occasion, *at, item)

    def rating(self, latent: float, attribute: Attribute, scale: Scale, at: tuple[Key, ...]) -> float:
        """Return the answer for a common percept `latent`; `at` is the key of its noise or lapse."""
        if self._lapses(attribute, at):
            anywhere = uniform(*self.keyed("anywhere", at, attribute.name))
            return scale.nearest(scale.low + anywhere * (scale.high - scale.low))
        felt = self.gain(attribute) * latent + self.bias(attribute)
        noise = self.simulation.noise_sd * normal(*self.keyed("noise", at, attribute.name))
        return scale.nearest((scale.low + scale.high) / 2 + felt + noise)

    def _lapses(self, attribute: Attribute, at: tuple[Key, ...]) -> bool:
        return uniform(*self.keyed("lapse", at, attribute.name)) < self.simulation.lapse_rate


KIND = ParticipantKind(lambda plan, feels: Perceiver(plan, feels=feels))


def place(ask: Ask) -> tuple[Key, ...]:
    """Return a key that distinguishes this form from all others of a session."""
    return (ask.form.name, 0) if ask.trial is None else (ask.trial.number, ask.trial.attempt)


def weighed(weights: Mapping[str, float], z_of: Callable[[str], float]) -> float:
    """Return the sum of weight x z-score over the columns, with the intercept."""
    return math.fsum([w * (1.0 if column == INTERCEPT else z_of(column)) for column, w in weights.items()])


def z_scores(stimuli: tuple[Stimulus, ...], column: str) -> dict[str, float]:
    """Return the z-scores of a numeric column by stimulus id (population SD); 0 where the column is constant."""
    stands = standing(stimuli, column)
    return {stimulus.id: z_score(float(stimulus.columns[column]), stands) for stimulus in stimuli}


def standing(stimuli: tuple[Stimulus, ...], column: str) -> tuple[float, float]:
    """Return the mean and the population SD of a numeric column over all stimuli."""
    values = {stimulus.id: float(stimulus.columns[column]) for stimulus in stimuli}
    mean = math.fsum(values.values()) / len(values)
    return mean, math.sqrt(math.fsum((value - mean) ** 2 for value in values.values()) / len(values))


def z_score(value: float, stands: tuple[float, float]) -> float:
    """Return how many SDs the value lies above the mean; 0 where nothing varies."""
    mean, sd = stands
    return (value - mean) / sd if sd > 0 else 0.0
