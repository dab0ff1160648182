"""The evidence of answers for a threshold: against a flat function, within or outside of the levels, and its posterior.

The likelihood of a rising function is averaged over a prior like that of QUEST+: flat in the threshold over the tested
levels and one and a half of their ranges on both sides, flat in the slope for widths (x.95 - x.05) from a twelfth of
the range to two ranges, flat in the rates that are free. Its ratio to the likelihood of a flat function is a test that
also holds where levels were chosen by the answers, because its mean is 1 without a threshold, whatever chose the
levels: a ratio of 20 occurs with a probability of at most 1 in 20. Where all levels lie on one side of a standard, so
do the thresholds of the prior. Sources: Ville 1939; Robbins 1970; Wasserman, Ramdas & Balakrishnan 2020; of the prior
Watson 2017.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, xlogy

from palpate.analysis.choices.maximising import Problem
from palpate.analysis.choices.specification import (
    FunctionSpec,
    Levels,
    log_likelihood,
    problem_of,
    quantities,
    standard_place,
    to_level,
    to_place,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import NoEstimate

RATIO = 20.0
"""The ratio of likelihoods from which on there is a threshold: at most one guesser in 20 reaches it."""
CERTAIN = 1000.0
"""The ratio from which on a message may say between which levels the threshold lies."""
SURE = 0.95
"""How sure an inequality is."""
COARSE, FINE = (81, 15), (81, 25)
RATES = 9
BEYOND, NARROWEST, WIDEST = 1.5, 1 / 12, 2.0  # ranges of levels
NEGLIGIBLE = 1e-5
BESIDE = 12
"""Points of a density on either side of those where it is not negligible."""
MOST_LAPSES = 0.5
EXCESS = 3.0
"""The likelihood ratio of more lapses than the model allows from which on they are reported (Kass & Raftery 1995)."""


@dataclass(frozen=True)
class Evidence:
    """What answers say about a threshold, in the level's units.

    `ratio`: the log of the likelihood of a rising function, averaged over the prior, relative to a flat one. `below`,
    `above`: the posterior probabilities of a threshold outside of the tested levels. `limits`: the one-sided limits
    (lower, upper) that the threshold exceeds, or is below, with a probability of .95. Then posterior means, the
    standard deviation of the threshold, and equal-tailed intervals.
    """

    ratio: float
    below: float
    above: float
    limits: tuple[float, float]
    threshold: float
    sd: float
    threshold_interval: tuple[float, float]
    jnd: float
    jnd_interval: tuple[float, float]
    guess: float
    lapse: float


@dataclass(frozen=True)
class _Grid:
    """Points of threshold and width (the fit's axis), guess and lapse, with the log of their weights."""

    place: Floats
    width: Floats
    guess: Floats
    lapse: Floats
    weight: Floats


@dataclass(frozen=True)
class LevelsPosterior:
    """The posterior of counted levels: evidence, density, curve and lapses are read from the same two grids.

    `log_mass` is the log of likelihood times prior on the coarse grid, `average` the log of the average likelihood.
    """

    answers: Levels
    spec: FunctionSpec
    coarse: _Grid
    log_mass: Floats
    average: float

    @property
    def ratio(self) -> float:
        """The log of the average likelihood relative to that of a flat function."""
        return self.average - _flat(self.answers, self.spec)

    @cached_property
    def fine(self) -> tuple[_Grid, Floats]:
        """A grid where the posterior is not negligible, and its mass."""
        ends = []
        for axis, points in ((0, self.coarse.place), (1, np.log(self.coarse.width))):
            marginal = np.exp(self.log_mass - self.log_mass.max()).sum(axis=tuple(j for j in range(4) if j != axis))
            inside = np.flatnonzero(marginal > NEGLIGIBLE * marginal.max())
            first, last = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, len(points) - 1)
            ends.append((float(points[first]), float(points[last])))
        fine = _grid(self.spec, ends[0], ends[1], FINE)
        log_mass = _log_mass(fine, problem_of(self.answers, self.spec), self.spec)
        mass = np.exp(log_mass - log_mass.max())
        mass /= mass.sum()
        return fine, mass

    def evidence(self, confidence: float = SURE) -> Evidence:
        """Return the evidence for a threshold."""
        answers, spec, (fine, mass) = self.answers, self.spec, self.fine
        place, width = (axis.ravel() for axis in np.meshgrid(fine.place, fine.width, indexing="ij"))
        spread = width / (spec.shape.place(0.95) - spec.shape.place(0.05))
        at, size = quantities(
            spec, answers, np.column_stack([place - spec.shape.place(spec.threshold) * spread, np.log(spread)])
        )
        weights = mass.sum(axis=(2, 3)).ravel()
        low, high = float(answers.levels[0]), float(answers.levels[-1])
        mean = float(weights @ at)
        rate = (mass.sum(axis=(0, 1, 3)) @ fine.guess, mass.sum(axis=(0, 1, 2)) @ fine.lapse)
        tails = ((1 - confidence) / 2, 1 - (1 - confidence) / 2)
        sizes = _quantiles(size, weights, tails)
        limits = _quantiles(at, weights, (1 - SURE, SURE, *tails))
        return Evidence(
            self.ratio,
            float(weights[at < low].sum()),
            float(weights[at > high].sum()),
            (limits[0], limits[1]),
            mean,
            float(np.sqrt(weights @ (at - mean) ** 2)),
            (limits[2], limits[3]),
            float(weights @ size),
            (sizes[0], sizes[1]),
            float(rate[1] if spec.equal_rates else rate[0]),
            float(rate[1]),
        )

    def density(self) -> tuple[Floats, Floats, Floats]:
        """Return levels, the density of the posterior threshold at them, and that of the prior, per unit of level."""
        answers, spec, (grid, mass) = self.answers, self.spec, self.fine
        (low, high), _ = _reach(problem_of(answers, spec), standard_place(spec, answers))
        ends = (np.linspace(low, grid.place[0], BESIDE + 1)[:-1], np.linspace(grid.place[-1], high, BESIDE + 1)[1:])
        below, above = (end if end[-1] > end[0] else end[:0] for end in ends)
        place = np.concatenate([below, grid.place, above])
        at = to_level(place, spec, answers)
        change = np.abs(np.gradient(at, np.arange(len(at)))) / np.gradient(place, np.arange(len(at)))
        within = mass.sum(axis=(1, 2, 3)) / (grid.place[1] - grid.place[0])
        density = np.concatenate([np.zeros(len(below)), within, np.zeros(len(above))]) / change
        order = np.argsort(at, kind="stable")
        return at[order], density[order], (1 / ((high - low) * change))[order]

    def curve(self, levels: Floats, confidence: float = SURE) -> tuple[Floats, Floats, Floats]:
        """Return the posterior mean of the share of hits at `levels`, and the ends of its pointwise interval."""
        answers, spec, grid = self.answers, self.spec, self.coarse
        mass = np.exp(self.log_mass - self.log_mass.max()).ravel()
        kept = np.flatnonzero(mass > NEGLIGIBLE * mass.max())
        weights = mass[kept] / mass[kept].sum()
        at, wide, low, high = np.unravel_index(kept, self.log_mass.shape)
        spread = grid.width[wide] / (spec.shape.place(0.95) - spec.shape.place(0.05))
        centre = grid.place[at] - spec.shape.place(spec.threshold) * spread
        lapse = grid.lapse[high]
        guess = lapse if spec.equal_rates else grid.guess[low]
        places = to_place(levels, spec, answers)
        shares = [guess + (1 - guess - lapse) * spec.shape.share((place - centre) / spread) for place in places]
        tail = (1 - confidence) / 2
        ends = np.array([_quantiles(share, weights, (tail, 1 - tail)) for share in shares])
        return np.array([float(weights @ share) for share in shares]), ends[:, 0], ends[:, 1]

    def lapse_excess(self) -> float:
        """Return the likelihood of a lapse rate above the model's, up to 0.5, relative to one within its bounds.

        Both are averages over the prior. From `EXCESS` on there are more lapses than the model allows. 0 where it
        allows as many, or where the rates are equal on both sides and bounded by a half each.
        """
        spec = self.spec
        most = min(MOST_LAPSES, 1 - spec.guess[1] - 0.01)
        if spec.lapse[1] >= most:
            return 0.0
        more = levels_posterior(self.answers, replace(spec, lapse=(spec.lapse[1], most)))
        return math.exp(min(more.average - self.average, 700.0))


def levels_posterior(answers: Levels, spec: FunctionSpec) -> LevelsPosterior:
    """Return the posterior of counted levels under the prior that follows from these levels."""
    problem = problem_of(answers, spec)
    coarse = _grid(spec, *_reach(problem, standard_place(spec, answers)), COARSE)
    log_mass = _log_mass(coarse, problem, spec)
    return LevelsPosterior(
        answers, spec, coarse, log_mass, float(logsumexp(log_mass)) - float(logsumexp(coarse.weight))
    )


def evidence_of(answers: Levels, spec: FunctionSpec, confidence: float = SURE) -> Evidence:
    """Return the evidence of counted levels for a threshold."""
    return levels_posterior(answers, spec).evidence(confidence)


def refuse_guessing(answers: Levels, spec: FunctionSpec) -> float:
    """Return the log ratio against a flat function. Raises NoEstimate where it is below that of 1 in 20."""
    ratio = levels_posterior(answers, spec).ratio
    if ratio < math.log(RATIO):
        raise NoEstimate(no_threshold(answers, spec, ratio))
    return ratio


def no_threshold(answers: Levels, spec: FunctionSpec, ratio: float) -> str:
    """Return the message on answers that a flat function explains as well as a rising one."""
    share = float(answers.hits.sum() / answers.trials.sum())
    flat = f"guessing (a share of {spec.guess[0]:.3g})" if spec.chance else f"a constant share of {share:.3g}"
    return (
        f"there is no threshold: the answers are no better explained by a function of the level than by {flat}; "
        f"the likelihood ratio is {_ratio_text(ratio)}, {RATIO:g} is demanded"
    )


def outside_of(evidence: Evidence, answers: Levels, spec: FunctionSpec) -> tuple[str, float | None]:
    """Return on which side of the levels the threshold is, and the bound that it is beyond with 95 % (or None).

    The side is "" if the median of the posterior is within the levels, "unknown" where a flat function of no known
    height explains the answers.
    """
    low, high = float(answers.levels[0]), float(answers.levels[-1])
    share = float(answers.hits.sum() / answers.trials.sum())
    side = "below" if evidence.below > 0.5 else "above" if evidence.above > 0.5 else ""
    if evidence.ratio < math.log(RATIO):
        hardest = "below" if spec.falling else "above"
        easiest = "above" if spec.falling else "below"
        side = hardest if spec.chance or share == 0 else easiest if share == 1 else "unknown"
    if side == "below":
        return side, low if evidence.below >= SURE else evidence.limits[1]
    if side == "above":
        return side, high if evidence.above >= SURE else evidence.limits[0]
    return side, None


def _ratio_text(ratio: float) -> str:
    return f"{math.exp(ratio):.2g}" if ratio > -20 else "below 1e-8"


def _flat(answers: Levels, spec: FunctionSpec) -> float:
    """Return the log likelihood of the flat function: the known guess rate, else the likeliest share."""
    share = float(answers.hits.sum() / answers.trials.sum())
    level = spec.guess[0] if spec.chance else min(max(share, spec.guess[0]), 1 - spec.lapse[0])
    return log_likelihood(answers.hits, answers.trials, np.full_like(answers.trials, level))


def _grid(spec: FunctionSpec, places: tuple[float, float], widths: tuple[float, float], size: tuple[int, int]) -> _Grid:
    place = np.linspace(*places, size[0])
    width = np.exp(np.linspace(*widths, size[1]))
    guess, of_guess = _rates((0.0, 0.0) if spec.equal_rates else spec.guess)
    lapse, of_lapse = _rates(spec.lapse)
    rates = np.log(of_guess)[:, None] + np.log(of_lapse)[None, :]
    weight = np.broadcast_to(rates - np.log(width)[:, None, None], (*size, *rates.shape))
    return _Grid(place, width, guess, lapse, weight)


def _reach(problem: Problem, standard: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ends of the prior: of the threshold, and of the width's logarithm."""
    span = float(problem.t[-1])
    return (max(-BEYOND * span, standard), (1 + BEYOND) * span), (math.log(NARROWEST * span), math.log(WIDEST * span))


def _rates(bounds: tuple[float, float]) -> tuple[Floats, Floats]:
    """Return Gauss-Legendre nodes and weights of a rate."""
    low, high = bounds
    if high <= low:
        return np.array([low]), np.ones(1)
    nodes, weights = np.polynomial.legendre.leggauss(RATES)
    return low + (high - low) * (nodes + 1) / 2, weights


def _log_mass(grid: _Grid, problem: Problem, spec: FunctionSpec) -> Floats:
    """Return the log of likelihood times prior, (thresholds, widths, guess, lapse)."""
    spread = grid.width / (spec.shape.place(0.95) - spec.shape.place(0.05))
    centre = grid.place[:, None] - spec.shape.place(spec.threshold) * spread[None, :]
    lapse = grid.lapse[None, None, None, :]
    guess = lapse if spec.equal_rates else grid.guess[None, None, :, None]
    result = grid.weight.copy()
    for t, trials, hits in zip(problem.t, problem.trials, problem.hits[0], strict=True):
        z = ((t - centre) / spread)[:, :, None, None]
        hit = guess + (1 - guess - lapse) * spec.shape.share(z)
        miss = lapse + (1 - guess - lapse) * spec.shape.rest(z)
        result = result + xlogy(hits, np.maximum(hit, 1e-300)) + xlogy(trials - hits, np.maximum(miss, 1e-300))
    return result


def _quantiles(values: Floats, weights: Floats, shares: tuple[float, ...]) -> tuple[float, ...]:
    """Return quantiles of weighted values."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    middle = total - weights[order] / 2
    result: tuple[float, ...] = tuple(np.interp(shares, middle / total[-1], values[order]).tolist())
    return result
