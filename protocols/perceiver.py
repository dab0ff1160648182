"""A simulated participant: perceives latent attributes of a stimulus and answers on the study's scale."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from protocols.forms import Sliders
from protocols.keyed import Key, normal, uniform
from protocols.plan import Plan
from protocols.requests import Ask, Reply, Rest
from protocols.study import Attribute, Simulation, Stimulus

GAIN_FLOOR = 0.1


@dataclass(frozen=True)
class Perceiver:
    """One person: own gain and bias per attribute, noise per answer, now and then a lapse or a second thought.

    answer = gain x (sum of weight x z-score of the stimulus column) + bias + noise, put on the scale.
    Every draw is keyed by seed, participant, trial, attempt and attribute: nothing depends on what came before.
    """

    plan: Plan
    reading_s: float = 20.0

    @cached_property
    def simulation(self) -> Simulation:
        """The study's simulation, or people who answer by noise alone where it has none."""
        return self.plan.study.simulation or Simulation(latents={})

    @cached_property
    def z_scores(self) -> Mapping[str, Mapping[str, float]]:
        """column -> stimulus id -> z-score over all stimuli of the study (0 where a column is constant)."""
        columns = sorted({c for weights in self.simulation.latents.values() for c in weights} - {"intercept"})
        return {column: z_scores(self.plan.study.stimuli, column) for column in columns}

    def latent(self, item: str, stimulus: Stimulus) -> float:
        """What everybody would feel: scale units around the middle of the scale, or logits of ticking a word."""
        weights = self.simulation.latents.get(item, {})
        parts = [w * (1.0 if c == "intercept" else self.z_scores[c][stimulus.id]) for c, w in weights.items()]
        return math.fsum(parts)

    def gain(self, attribute: Attribute) -> float:
        """The participant's own gain, at least 0.1."""
        return max(GAIN_FLOOR, 1.0 + self.simulation.gain_sd * normal(*self.trait("gain", attribute.name)))

    def bias(self, attribute: Attribute) -> float:
        """The participant's own bias in scale units."""
        return self.simulation.bias_sd * normal(*self.trait("bias", attribute.name))

    def rate(self, ask: Ask, form: Sliders) -> tuple[Reply, float]:
        """The reply to a rating form and the seconds it took."""
        if ask.trial is None:
            raise ValueError("a rating form needs a trial")
        answers, at_s, clock = {}, {}, 0.0
        for attribute in form.attributes:
            clock = round(clock + self.seconds(ask, attribute.name), 3)
            answers[attribute.name] = self._rating(ask, form, attribute, ask.trial.stimulus)
            at_s[attribute.name] = clock
        return Reply({"answers": answers, "at_s": at_s, "seconds": clock}), clock

    def lapses(self, ask: Ask, attribute: Attribute) -> bool:
        """Whether this answer is a lapse."""
        return uniform(*self.moment("lapse", ask, attribute.name)) < self.simulation.lapse_rate

    def rest_s(self, rest: Rest) -> float:
        """How long the participant rests."""
        return round(60.0 + 60.0 * uniform("rest", self.plan.seed, self.plan.who.participant, rest.done), 3)

    def has_second_thoughts(self, ask: Ask) -> bool:
        """Whether the participant, meeting a trial first, goes back to the one before."""
        first = ask.trial is not None and ask.trial.attempt == 1
        return first and uniform(*self.moment("revise", ask, "")) < self.simulation.revise_rate

    def seconds(self, ask: Ask, item: str) -> float:
        """How long the answer to one item takes."""
        return self.simulation.answer_s * math.exp(0.4 * normal(*self.moment("time", ask, item)))

    def trait(self, what: str, item: str) -> tuple[Key, ...]:
        """The key of what is the participant's own throughout the session."""
        return (what, self.plan.study.study, self.plan.seed, self.plan.who.participant, item)

    def moment(self, what: str, ask: Ask, item: str) -> tuple[Key, ...]:
        """The key of what is drawn for one item of one form."""
        at = (ask.form.name, 0) if ask.trial is None else (ask.trial.number, ask.trial.attempt)
        return (what, self.plan.study.study, self.plan.seed, self.plan.who.participant, *at, item)

    def _rating(self, ask: Ask, form: Sliders, attribute: Attribute, stimulus: Stimulus) -> float:
        scale = form.scale
        if self.lapses(ask, attribute):
            anywhere = uniform(*self.moment("anywhere", ask, attribute.name))
            return scale.nearest(scale.low + anywhere * (scale.high - scale.low))
        felt = self.gain(attribute) * self.latent(attribute.name, stimulus) + self.bias(attribute)
        noise = self.simulation.noise_sd * normal(*self.moment("noise", ask, attribute.name))
        return scale.nearest((scale.low + scale.high) / 2 + felt + noise)


def z_scores(stimuli: tuple[Stimulus, ...], column: str) -> dict[str, float]:
    """z-score of a numeric column by stimulus id (population SD); 0 where the column is constant."""
    values = {stimulus.id: float(stimulus.columns[column]) for stimulus in stimuli}
    mean = math.fsum(values.values()) / len(values)
    sd = math.sqrt(math.fsum((value - mean) ** 2 for value in values.values()) / len(values))
    return {name: (value - mean) / sd if sd > 0 else 0.0 for name, value in values.items()}
