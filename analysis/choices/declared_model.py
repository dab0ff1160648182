"""The posterior of a track under the model that its study declares for QUEST+: a grid of parameters, each as likely.

Shares of hits, probabilities and estimates are computed by the functions of the procedure itself
(`palpate.studies.procedures.model_grid`), so the numbers of an analysis are those that the procedure went by.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp, xlogy

from palpate.analysis.choices.evidence import RATIO, SURE
from palpate.analysis.choices.shapes import JndKind, jnd_ends
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import NoEstimate
from palpate.studies.procedures.model_grid import (
    Table,
    cell_edges,
    estimate_of,
    level_at,
    marginal_of,
    own_share,
    tabulate,
    uniform,
    updated,
)

if TYPE_CHECKING:
    from palpate.protocols.procedures import Model
    from palpate.studies.procedures.adviser import Estimate

ALIKE = 5e-4
"""A plan's `threshold` this close to F at the model's own threshold is that one: .632 is 1 - 1/e."""
NEGLIGIBLE = 1e-7
MOST_LAPSES, LAPSES = 0.25, 9
"""The highest lapse rate that is considered beside those of the model, and the number of such rates."""
SCALES = {"linear": "a linear scale", "log10": "a scale of log10", "db": "a dB scale"}
SHAPES = {"weibull": "Weibull", "logistic": "logistic", "gaussian": "Gaussian"}


@dataclass(frozen=True)
class DeclaredModel:
    """The model that a study declares for a track: `levels` is its grid, `falling` says that low levels are easier.

    `chance` is the share of hits of somebody who perceives nothing, where the design decides it; of yes/no it does not.
    """

    model: Model
    levels: tuple[float, ...]
    falling: bool = False
    chance: float | None = None

    @property
    def share(self) -> float:
        """F at the model's own threshold."""
        return own_share(self.model.shape)

    def describe(self) -> str:
        """Return the model and its prior as text."""
        from palpate.protocols.procedures import values_of

        axes = []
        for name in ("threshold", "slope", "guess", "lapse"):
            values = values_of(getattr(self.model, name))
            few = ", ".join(f"{value:g}" for value in values)
            axes.append(f"{name} {few if len(values) < 8 else f'{values[0]:g} to {values[-1]:g} in {len(values)}'}")
        return (
            f"{SHAPES[self.model.shape]} function on {SCALES[self.model.scale]}, each combination as likely before the "
            f"answers: {'; '.join(axes)}"
        )


@dataclass(frozen=True)
class ModelPosterior:
    """The probability of each combination of parameters after the answers (`weights`, in the order of `table`).

    `ratio` is the log of the likelihood, averaged over the prior, relative to that of a flat function. `share` is the
    share of hits, `flat` that of the flat function if it is known, as in a forced choice.
    """

    declared: DeclaredModel
    table: Table
    weights: Floats
    ratio: float
    share: float
    flat: float | None

    def estimate(self, at: float | None = None, confidence: float = SURE) -> Estimate:
        """Return what is known of the level where F is `at` (None: of the model's own threshold).

        Where the answers do not place the model's threshold within the levels, or a flat function explains them (a
        likelihood ratio below 20), it is an inequality. The model's own threshold has the numbers of the procedure.
        """
        from dataclasses import replace

        values, weights = marginal_of(self.table, self.weights)
        known = estimate_of(values, weights, self.declared.levels, confidence)
        side, shifted = known.outside, self._is_shifted(at)
        if self.ratio < math.log(RATIO):
            side = self._side_of_guessers()
        if side is None:
            return known if not shifted else self._shifted(at or 0.0, confidence)
        if side == "unknown":
            return replace(known, threshold=None, sd=None, interval=None, outside=side, bound=None)
        if side == known.outside and not shifted:
            return known
        ends, total = self.cumulated(at)
        bound = float(np.interp(SURE if side == "below" else 1 - SURE, total, ends))
        return replace(known, threshold=None, sd=None, interval=None, outside=side, bound=bound)

    def _is_shifted(self, at: float | None) -> bool:
        return at is not None and abs(at - self.declared.share) >= ALIKE

    def _side_of_guessers(self) -> str:
        hardest, easiest = ("below", "above") if self.declared.falling else ("above", "below")
        if self.flat is not None or self.share == 0:
            return hardest
        return easiest if self.share == 1 else "unknown"

    def _shifted(self, at: float, confidence: float) -> Estimate:
        from palpate.studies.procedures.adviser import Estimate

        plane = self._plane()
        levels = self._levels_at(at, self.table.axes["threshold"])
        mean = float((plane * levels).sum())
        sd = math.sqrt(max(0.0, float((plane * (levels - mean) ** 2).sum())))
        ends, total = self.cumulated(at)
        tail = (1 - confidence) / 2
        low, high = np.interp([tail, 1 - tail], total, ends).tolist()
        return Estimate(mean, sd, (low, high))

    def _plane(self) -> Floats:
        """Return the probabilities of (threshold, slope)."""
        plane: Floats = self.weights.reshape(self.table.shape).sum(axis=(2, 3, 4))
        return plane

    def _levels_at(self, at: float | None, thresholds: Floats) -> Floats:
        """Return the levels (threshold, slope) where F is `at`; None: the thresholds themselves."""
        slopes = self.table.axes["slope"]
        if at is None or not self._is_shifted(at):
            return np.repeat(thresholds[:, None], len(slopes), axis=1)
        model = self.declared.model
        return level_at(model.shape, model.scale, at, thresholds[:, None], slopes[None, :], self.declared.falling)

    def cumulated(self, at: float | None = None, prior: bool = False) -> tuple[Floats, Floats]:
        """Return levels and the probability that F is `at` below each; between them it rises evenly."""
        plane = np.full(self.table.shape[:2], 1.0) if prior else self._plane()
        edges = self._levels_at(at, cell_edges(self.table.axes["threshold"]))
        knots = np.unique(edges)
        total = np.zeros(len(knots))
        for n in range(plane.shape[1]):
            own = np.concatenate([[0.0], np.cumsum(plane[:, n])])
            total += np.interp(knots, edges[:, n], own)
        return knots, total / total[-1]

    def density(self, at: float | None = None) -> tuple[Floats, Floats, Floats]:
        """Return levels, the density of the posterior at them, and that of the prior, per unit of the level."""
        slopes = self._plane().sum(axis=0)
        edges = self._levels_at(at, cell_edges(self.table.axes["threshold"]))[:, int(np.argmax(slopes))]
        found = [np.diff(np.interp(edges, *self.cumulated(at, prior))) / np.diff(edges) for prior in (False, True)]
        return (edges[1:] + edges[:-1]) / 2, found[0], found[1]

    def jnd(self, kind: JndKind, confidence: float = SURE) -> tuple[float, float, float]:
        """Return the mean of the JND and the ends of its central interval."""
        model, thresholds, slopes = self.declared.model, self.table.axes["threshold"], self.table.axes["slope"]
        factor, *shares = jnd_ends(kind)
        upper, lower = (
            level_at(model.shape, model.scale, share, thresholds[:, None], slopes[None, :]) for share in shares
        )
        sizes = factor * (upper - lower)
        return self._summary(sizes.ravel(), self._plane().ravel(), confidence)

    @staticmethod
    def _summary(values: Floats, weights: Floats, confidence: float) -> tuple[float, float, float]:
        distinct, places = np.unique(np.round(values, 12), return_inverse=True)
        mass = np.bincount(places.ravel(), weights=weights)
        middle = np.cumsum(mass) - mass / 2
        tail = (1 - confidence) / 2
        low, high = np.interp([tail, 1 - tail], middle, distinct).tolist()
        return float(weights @ values), low, high

    def mean(self, parameter: str) -> float:
        """Return the posterior mean of a parameter."""
        values, weights = marginal_of(self.table, self.weights, parameter)
        return float(values @ weights)

    def curve(self, levels: Floats, confidence: float = SURE) -> tuple[Floats, Floats, Floats]:
        """Return the posterior mean of the share of hits at `levels`, and the ends of its pointwise interval."""
        share = tabulate(self.declared.model, tuple(levels.tolist()), self.declared.falling).share
        kept = np.flatnonzero(self.weights > NEGLIGIBLE * self.weights.max())
        weights = self.weights[kept] / self.weights[kept].sum()
        points = [self._summary(row[kept], weights, confidence) for row in share]
        means, low, high = (np.array(part) for part in zip(*points, strict=True))
        return means, low, high


def model_posterior(declared: DeclaredModel, levels: Floats, hits: Floats) -> ModelPosterior:
    """Return the posterior of answers (0 or 1) at levels, in the order of the trials.

    Raises NoEstimate where the model cannot give such answers.
    """
    distinct, rows = np.unique(levels, return_inverse=True)
    table = tabulate(declared.model, tuple(distinct.tolist()), declared.falling)
    trials, found = (np.bincount(rows, weights=of).astype(np.float64) for of in (np.ones_like(hits), hits))
    log_mass = _log_likelihoods(table, found, trials)
    highest = float(log_mass.max())
    if not math.isfinite(highest):
        raise NoEstimate("the declared model gives these answers a probability of 0: let `lapse` or `guess` be above 0")
    answers = zip(rows.tolist(), (hits == 1).tolist(), strict=True)
    weights = updated(table, uniform(table), answers)
    share = float(hits.mean())
    guess, lapse = table.axes["guess"], table.axes["lapse"]
    flat = declared.chance
    level = min(max(share, float(guess.min())), 1 - float(lapse.min())) if flat is None else flat
    against = float((xlogy(found, level) + xlogy(trials - found, 1 - level)).sum())
    whole = float(logsumexp(log_mass)) - math.log(len(log_mass))
    return ModelPosterior(declared, table, weights, whole - against, share, flat)


def model_lapse_excess(declared: DeclaredModel, levels: Floats, hits: Floats) -> float:
    """Return the likelihood of lapse rates above the model's, up to 0.25, relative to that of those that it has.

    Both are averages over the prior. 0 where the model has rates as high.
    """
    from palpate.protocols.procedures import values_of

    low = max(values_of(declared.model.lapse))
    high = min(MOST_LAPSES, 1 - max(values_of(declared.model.guess)) - 0.01)
    if low >= high:
        return 0.0
    more = tuple(low + (high - low) * (n + 0.5) / LAPSES for n in range(LAPSES))
    distinct, rows = np.unique(levels, return_inverse=True)
    trials, found = (np.bincount(rows, weights=of).astype(np.float64) for of in (np.ones_like(hits), hits))
    averages = []
    for model in (declared.model, declared.model.model_copy(update={"lapse": more})):
        log_mass = _log_likelihoods(tabulate(model, tuple(distinct.tolist()), declared.falling), found, trials)
        averages.append(float(logsumexp(log_mass)) - math.log(len(log_mass)))
    return math.exp(min(averages[1] - averages[0], 700.0))


def _log_likelihoods(table: Table, hits: Floats, trials: Floats) -> Floats:
    """Return the log likelihood of counted answers for each combination of parameters."""
    result: Floats = np.zeros(table.share.shape[1])
    for share, n, k in zip(table.share, trials.tolist(), hits.tolist(), strict=True):
        result = result + xlogy(k, share) + xlogy(n - k, 1 - share)
    return result
