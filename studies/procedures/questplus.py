"""QUEST+ (Watson 2017): the level with the least expected entropy of the parameters that are measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from palpate.protocols.procedures import QuestPlus
from palpate.protocols.tracks import Past, Track
from palpate.studies.procedures.adviser import End, Estimate, ProcedureKind, Step
from palpate.studies.procedures.model_grid import (
    PARAMETERS,
    Floats,
    Table,
    entropy,
    estimate_of,
    marginal_of,
    tabulate,
    uniform,
    updated,
)

TIES = 9
"""Decimals of the expected information, in nats: levels that differ by less are tied, and the lowest is taken."""


@dataclass
class QuestPlusAdviser:
    """QUEST+ on the grid of a track, with a uniform prior over the model's values.

    The posterior of the last past is remembered, so that one more answer costs one multiplication.
    """

    track: Track
    _latest: tuple[Past, Floats] | None = field(default=None, repr=False)

    @property
    def rules(self) -> QuestPlus:
        """Return the rules of the study. Raises TypeError for another kind of procedure."""
        if not isinstance(self.track.procedure, QuestPlus):
            raise TypeError(f"{self.track.name}: QUEST+ is expected")
        return self.track.procedure

    @cached_property
    def table(self) -> Table:
        """Return the shares of hits at all levels for all combinations of parameters."""
        return tabulate(self.rules.model, self.track.levels, self.rules.easier == "lower")

    def advise(self, past: Past) -> Step | End:
        """Return the level that tells most, or the end once the threshold is known well enough or trials are over."""
        stop = self.rules.stop
        if stop.threshold_sd is not None and len(past) >= max(1, stop.at_least or 1):
            estimate = self.estimate(past)
            if estimate.sd is not None and estimate.sd <= stop.threshold_sd:
                return End(
                    f"SD of the threshold {estimate.sd:.3g}, at most {stop.threshold_sd:g} after {len(past)} trials"
                )
        if len(past) >= stop.trials:
            return End(f"{len(past)} trials")
        information = np.round(self.information(self.posterior(past)), TIES)
        return Step(int(np.argmax(information)))

    def posterior(self, past: Past) -> Floats:
        """Return the probability of each combination of parameters after these answers."""
        known: Past = ()
        weights = uniform(self.table)
        if self._latest is not None and past[: len(self._latest[0])] == self._latest[0]:
            known, weights = self._latest
        weights = updated(self.table, weights, past[len(known) :])
        self._latest = past, weights
        return weights

    @cached_property
    def nuisance(self) -> list[int]:
        """Return the places in PARAMETERS of those that are averaged out."""
        interest = self.rules.interest
        return [n for n, name in enumerate(PARAMETERS) if name not in interest and self.table.shape[n] > 1]

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Return the places of the parameters of interest, then those of the nuisance parameters."""
        return (*(n for n in range(len(PARAMETERS)) if n not in self.nuisance), *self.nuisance)

    @cached_property
    def share_by_interest(self) -> Floats:
        """Return the shares of hits by level, combination of the parameters of interest, and nuisance combination."""
        table = self.table
        count = math.prod(table.shape[n] for n in self.nuisance)
        by_parameter = table.share.reshape(-1, *table.shape).transpose(0, *(n + 1 for n in self.order))
        return by_parameter.reshape(len(table.share), -1, count)

    def information(self, weights: Floats) -> Floats:
        """Return the expected information of an answer at each level about the parameters of interest, in nats."""
        table = self.table
        if not self.nuisance:
            expected, known_entropy = np.split(table.share_and_entropy @ weights, 2)
            plain: Floats = entropy(expected) - known_entropy
            return plain
        share = self.share_by_interest
        known = weights.reshape(table.shape).transpose(self.order).reshape(share.shape[1:])
        marginal = known.sum(axis=1)
        hit = np.einsum("lpm,pm->lp", share, known)
        ratio = np.divide(hit, marginal, out=np.zeros_like(hit), where=marginal > 0)
        measured: Floats = entropy(hit.sum(axis=1)) - entropy(ratio) @ marginal
        return measured

    def loss(self, past: Past, index: int) -> float:
        """Return how much less a level tells than the best one after these answers, in nats."""
        information = self.information(self.posterior(past))
        return float(information.max() - information[index])

    def marginal(self, past: Past, parameter: str = "threshold") -> tuple[Floats, Floats]:
        """Return the values of a parameter and their probabilities after these answers."""
        return marginal_of(self.table, self.posterior(past), parameter)

    def estimate(self, past: Past) -> Estimate:
        """Return mean, SD and central interval of the threshold, or a bound where it may lie beyond the levels."""
        return estimate_of(*self.marginal(past), self.track.levels)


def make(track: Track) -> QuestPlusAdviser:
    """Return the adviser of a track, with its table computed: the first choice is then as quick as the others."""
    adviser = QuestPlusAdviser(track)
    adviser.advise(())
    return adviser


KIND = ProcedureKind(make)
