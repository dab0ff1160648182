"""QUEST+ (Watson 2017): the level with the least expected entropy of the parameters that are measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from palpate.protocols.procedures import Model, QuestPlus, values_of
from palpate.protocols.tracks import Past, Track
from palpate.studies.procedures.adviser import SURE, End, Estimate, ProcedureKind, Step

Floats: TypeAlias = np.ndarray[Any, np.dtype[np.float64]]
PARAMETERS = ("threshold", "slope", "guess", "lapse", "gradient")
TIES = 9
"""Decimals of the expected information, in nats: levels that differ by less are tied, and the lowest is taken."""


@dataclass(frozen=True)
class Table:
    """The model over its grid: `share[level, combination]` of hits, and the values of each parameter.

    `share_and_entropy` has a second half of rows: the entropy of an answer, in nats, where the combination is known.
    `shape` has the number of values of each parameter, in the order of PARAMETERS.
    """

    share: Floats
    share_and_entropy: Floats
    axes: dict[str, Floats]
    shape: tuple[int, ...]


@dataclass
class QuestPlusAdviser:
    """QUEST+ on the grid of a track, with a uniform prior over the model's values.

    The posterior of the last past is remembered, so that one more answer costs one multiplication.
    """

    track: Track
    _past: Past = ()
    _posterior: Floats | None = field(default=None, repr=False)

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
        if self._posterior is None or past[: len(self._past)] != self._past:
            count = self.table.share.shape[1]
            self._past, self._posterior = (), np.full(count, 1.0 / count)
        weights = self._posterior
        for index, hit in past[len(self._past) :]:
            share = self.table.share[index]
            weights = weights * (share if hit else 1.0 - share)
            weights /= weights.sum()
        self._past, self._posterior = past, weights
        return weights

    def information(self, weights: Floats) -> Floats:
        """Return the expected information of an answer at each level about the parameters of interest, in nats."""
        table, interest = self.table, set(self.rules.interest)
        nuisance = [n for n, name in enumerate(PARAMETERS) if name not in interest and table.shape[n] > 1]
        if not nuisance:
            expected, known_entropy = np.split(table.share_and_entropy @ weights, 2)
            plain: Floats = _entropy(expected) - known_entropy
            return plain
        kept = [n for n in range(len(PARAMETERS)) if n not in nuisance]
        order = (*kept, *nuisance)
        count = math.prod(table.shape[n] for n in kept)
        known = weights.reshape(table.shape).transpose(order).reshape(count, -1)
        share = table.share.reshape(-1, *table.shape).transpose(0, *(n + 1 for n in order)).reshape(-1, *known.shape)
        marginal = known.sum(axis=1)
        hit = np.einsum("lpm,pm->lp", share, known)
        ratio = np.divide(hit, marginal, out=np.zeros_like(hit), where=marginal > 0)
        measured: Floats = _entropy(hit.sum(axis=1)) - _entropy(ratio) @ marginal
        return measured

    def loss(self, past: Past, index: int) -> float:
        """Return how much less a level tells than the best one after these answers, in nats."""
        information = self.information(self.posterior(past))
        return float(information.max() - information[index])

    def marginal(self, past: Past, parameter: str = "threshold") -> tuple[Floats, Floats]:
        """Return the values of a parameter and their probabilities after these answers."""
        place = PARAMETERS.index(parameter)
        others = tuple(n for n in range(len(PARAMETERS)) if n != place)
        return self.table.axes[parameter], self.posterior(past).reshape(self.table.shape).sum(axis=others)

    def estimate(self, past: Past) -> Estimate:
        """Return mean, SD and central interval of the threshold, or a bound where it may lie beyond the levels."""
        values, weights = self.marginal(past)
        low, high = quantiles(values, weights, ((1 - SURE) / 2, (1 + SURE) / 2))
        firsts = [level[0] if isinstance(level, tuple) else level for level in self.track.levels]
        lowest, highest = max(min(firsts), float(values[0])), min(max(firsts), float(values[-1]))
        below, above = low < lowest + _half(values, lowest), high > highest - _half(values, highest)
        if below and above:
            return Estimate(outside="unknown")
        if below or above:
            bound = quantiles(values, weights, (SURE if below else 1 - SURE,))[0]
            return Estimate(outside="below" if below else "above", bound=bound)
        mean = float(weights @ values)
        return Estimate(mean, math.sqrt(max(0.0, float(weights @ (values - mean) ** 2))), (low, high))


def tabulate(model: Model, levels: tuple[Any, ...], falling: bool = False) -> Table:
    """Return the table of a model at these levels; `falling`: hits become fewer as the level rises."""
    axes = {name: np.array(values_of(getattr(model, name) if getattr(model, name) is not None else 0.0))
            for name in PARAMETERS}  # fmt: skip
    shape = tuple(len(axes[name]) for name in PARAMETERS)
    grids = np.meshgrid(*(axes[name] for name in PARAMETERS), indexing="ij")
    values = {name: grid.ravel() for name, grid in zip(PARAMETERS, grids, strict=True)}
    pairs = np.array([level if isinstance(level, tuple) else (level, 0.0) for level in levels], dtype=np.float64)
    threshold = values["threshold"] + values["gradient"] * pairs[:, 1:]
    felt = rise(model.shape, model.scale, pairs[:, :1], threshold, values["slope"], falling)
    share = values["guess"] + (1 - values["guess"] - values["lapse"]) * felt
    return Table(share, np.vstack([share, _entropy(share)]), axes, shape)


def rise(shape: str, scale: str, level: Floats, threshold: Floats, slope: Floats, falling: bool = False) -> Floats:
    """Return F at the levels, from 0 to 1 (`Model` in palpate.protocols.procedures has the equations)."""
    if shape == "weibull":
        with np.errstate(over="ignore", under="ignore"):
            if scale == "linear":
                return -np.expm1(-((level / threshold) ** slope))
            return -np.expm1(-(10.0 ** (slope * (level - threshold) / (20.0 if scale == "db" else 1.0))))
    from scipy.special import expit, ndtr

    z = slope * (threshold - level if falling else level - threshold)
    result: Floats = expit(z) if shape == "logistic" else ndtr(z)
    return result


def quantiles(values: Floats, weights: Floats, shares: tuple[float, ...]) -> tuple[float, ...]:
    """Return quantiles of a distribution over a grid, each point spread evenly over its cell."""
    middles = (values[1:] + values[:-1]) / 2
    edges = np.concatenate([[values[0] - (middles[0] - values[0])], middles, [values[-1] + (values[-1] - middles[-1])]])
    cumulated = np.concatenate([[0.0], np.cumsum(weights)])
    return tuple(float(np.interp(share, cumulated / cumulated[-1], edges)) for share in shares)


def _half(values: Floats, at: float) -> float:
    """Return half the width of the grid's cell at a value."""
    place = min(max(int(np.searchsorted(values, at)), 1), len(values) - 1)
    return float(values[place] - values[place - 1]) / 2


def _entropy(share: Floats) -> Floats:
    """Return the entropy of a yes/no answer with this probability, in nats."""
    rest = 1.0 - share
    with np.errstate(divide="ignore", invalid="ignore"):
        total = share * np.log(share) + rest * np.log(rest)
    result: Floats = -np.nan_to_num(total, nan=0.0)
    return result


def make(track: Track) -> QuestPlusAdviser:
    """Return the adviser of a track, with its table computed: the first choice is then as quick as the others."""
    adviser = QuestPlusAdviser(track)
    adviser.advise(())
    return adviser


KIND = ProcedureKind(make)
