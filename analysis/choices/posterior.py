"""The Bayesian posterior of a psychometric function on a grid, with overdispersed answers, as in psignifit 4.

The priors are those of psignifit 4 (Schütt et al. 2016, 2.2).
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd
from scipy.special import gammaln, xlogy

from palpate.analysis.choices.maximising import Problem
from palpate.analysis.choices.shapes import JndKind
from palpate.analysis.choices.specification import (
    Bounds,
    Function,
    FunctionSpec,
    Levels,
    Rate,
    Task,
    function_spec,
    gather_levels,
    problem_of,
    quantities,
    rates_of,
    unit_of,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_share

COARSE = (21, 21, 6, 6, 6)
FINE, FINE_WITH_GUESS = (41, 41, 1, 9, 9), (33, 33, 7, 7, 7)
Axis: TypeAlias = tuple[Floats, Floats]  # points and their weights
NEGLIGIBLE = 1e-4  # of the highest marginal: where the fine grid begins and ends
UP_TO_HALF = (0.0, 0.5)
"""The range of an unconstrained rate; the prior makes high values unlikely."""
BETA = 10.0


@dataclass(frozen=True)
class Posterior:
    """Posterior means and equal-tailed intervals; `eta` is the overdispersion (0: binomial, 1: all or nothing).

    `threshold` (F = `at`) and `jnd` are in the level's units, averaged in these units. `width` is x.95 - x.05 of F, of
    the log level for "weibull". `assumed` says in words what the task assumes of the two rates.
    """

    function: str
    at: float
    threshold: float
    threshold_interval: Bounds
    jnd: float
    jnd_kind: str
    jnd_interval: Bounds
    width: float
    guess: float
    lapse: float
    eta: float
    confidence: float
    assumed: str


def posterior(
    data: pd.DataFrame,
    level: Hashable,
    correct: Hashable,
    n: Hashable | None = None,
    *,
    task: Task,
    alternatives: int | None = None,
    function: Function = "logistic",
    guess: Rate | None = None,
    lapse: Rate | None = None,
    threshold: float = 0.5,
    jnd: JndKind = "half_interquartile",
    falling: bool = False,
    overdispersed: bool = True,
    confidence: float = 0.95,
) -> Posterior:
    """Return the posterior under the priors of psignifit 4, with beta-binomial answers (or binomial ones).

    Answers that step from one side to the other, or are all equal, have a posterior too: it then mostly shows the
    prior, which follows from the tested levels. Data and rates as for `fit_psychometric`. Source: Schütt, Harmeling,
    Macke & Wichmann 2016, appendix A.
    """
    check_share(confidence, "confidence")
    answers = gather_levels(data, level, correct, n)
    spec = function_spec(function, rates_of(task, alternatives, guess, lapse, UP_TO_HALF), threshold, jnd, falling)
    return posterior_of(answers, spec, overdispersed, confidence)


def posterior_of(
    answers: Levels, spec: FunctionSpec, overdispersed: bool = True, confidence: float = 0.95
) -> Posterior:
    """Return the posterior of counted levels, on a coarse grid over the priors, then a fine one where the mass is."""
    problem = problem_of(answers, spec)
    of = tested(problem.t)
    coarse = _coarse_axes(spec, of, overdispersed)
    axes = _fine_axes(coarse, _mass(coarse, problem, spec, of))
    mass = _mass(axes, problem, spec, of)
    plane = mass.sum(axis=(2, 3, 4))
    place, width = (axis.ravel() for axis in np.meshgrid(axes[0][0], axes[1][0], indexing="ij"))
    spread = width / (spec.shape.place(0.95) - spec.shape.place(0.05))
    native = np.column_stack([place - spec.shape.place(0.5) * spread, np.log(spread)])
    at, size = quantities(spec, answers, native)
    weights = plane.ravel()
    means = [float((mass.sum(axis=tuple(j for j in range(5) if j != i)) * axes[i][0]).sum()) for i in range(1, 5)]
    means[1] = means[2] if spec.equal_rates else means[1]
    return Posterior(
        spec.shape.name,
        spec.threshold,
        float(weights @ at),
        _tails(at, weights, confidence),
        float(weights @ size),
        spec.jnd,
        _tails(size, weights, confidence),
        means[0] * unit_of(answers, spec),
        means[1],
        means[2],
        means[3],
        confidence,
        spec.assumed,
    )


def _coarse_axes(spec: FunctionSpec, of: Tested, overdispersed: bool) -> list[Axis]:
    """Return equal steps of threshold, width, guess, lapse and eta over the support of the priors."""
    bounds = [(of.low - of.range / 2, of.high + of.range / 2), (of.step, 3 * of.range)]
    bounds += [(0.0, 0.0) if spec.equal_rates else spec.guess, spec.lapse]
    bounds.append((0.0, 1.0 - 1e-6) if overdispersed else (0.0, 0.0))
    return [_even(low, high, count) for (low, high), count in zip(bounds, COARSE, strict=True)]


def _fine_axes(coarse: list[Axis], mass: Floats) -> list[Axis]:
    """Return finer axes over the range where the marginal of `mass` is not negligible, plus one coarse step."""
    fine = FINE if len(coarse[2][0]) == 1 else FINE_WITH_GUESS
    axes = []
    for i, (points, _) in enumerate(coarse):
        marginal = mass.sum(axis=tuple(j for j in range(mass.ndim) if j != i))
        inside = np.flatnonzero(marginal > NEGLIGIBLE * marginal.max())
        first, last = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, len(points) - 1)
        axes.append((_even if i < 2 else _gauss)(float(points[first]), float(points[last]), fine[i]))
    return axes


def _even(low: float, high: float, count: int) -> Axis:
    """Return equal steps with the weights of the trapezoid rule."""
    if high <= low:
        return np.array([low]), np.ones(1)
    weights = np.ones(count)
    weights[[0, -1]] = 0.5
    return np.linspace(low, high, count), weights


def _gauss(low: float, high: float, count: int) -> Axis:
    """Return Gauss-Legendre nodes and weights; a few are enough for the rates, whose density is smooth."""
    if high <= low:
        return np.array([low]), np.ones(1)
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return low + (high - low) * (nodes + 1) / 2, weights


def _mass(axes: list[Axis], problem: Problem, spec: FunctionSpec, of: Tested) -> Floats:
    """Return the posterior mass of each point of the grid (threshold, width, guess, lapse, eta), summing to 1."""
    place, width, guess, lapse, eta = np.meshgrid(*(points for points, _ in axes), indexing="ij", sparse=True)
    spread = width / (spec.shape.place(0.95) - spec.shape.place(0.05))
    centre = place - spec.shape.place(0.5) * spread
    weight = np.log(np.maximum(threshold_prior(place, of) * width_prior(width, of), 1e-300))
    weight = weight + sum(np.log(rate_prior(rate)) for rate in (guess, lapse, eta) if rate.size > 1)
    guess = lapse if spec.equal_rates else guess
    for t, trials, hits in zip(problem.t, problem.trials, problem.hits[0], strict=True):
        z = (t - centre) / spread
        hit = guess + (1 - guess - lapse) * spec.shape.share(z)
        miss = lapse + (1 - guess - lapse) * spec.shape.rest(z)
        weight = weight + _log_share(hit, miss, float(hits), float(trials), eta)
    mass = np.exp(weight - weight.max())
    for i, (_, weights) in enumerate(axes):
        mass = mass * weights.reshape([-1 if i == j else 1 for j in range(5)])
    result: Floats = mass / mass.sum()
    return result


def _log_share(hit: Floats, miss: Floats, hits: float, trials: float, eta: Floats) -> Floats:
    """Return the log probability of the answers without the binomial coefficient; eta^2 is a share of variance."""
    hit, miss = np.maximum(hit, 1e-12), np.maximum(miss, 1e-12)
    plain: Floats = xlogy(hits, hit) + xlogy(trials - hits, miss)
    if eta.size == 1 and float(eta.ravel()[0]) == 0:
        return plain
    spread = np.maximum(eta, 1e-5) ** 2
    scale = 1 / spread - 1
    a, b = hit * scale, miss * scale
    grown = gammaln(hits + a) - gammaln(a) + gammaln(trials - hits + b) - gammaln(b)
    return np.where(eta < 1e-4, plain, grown - (gammaln(trials + scale) - gammaln(scale)))


def _tails(values: Floats, weights: Floats, confidence: float) -> Bounds:
    """Return equal-tailed quantiles of weighted values; each value's weight is centred on it."""
    order = np.argsort(values, kind="stable")
    size = float(np.abs(values).max()) or 1.0
    distinct, places = np.unique(np.round(values[order] / size, 12), return_inverse=True)
    mass = np.bincount(places, weights=weights[order])
    middle = np.cumsum(mass) - mass / 2
    low, high = np.interp([(1 - confidence) / 2, (1 + confidence) / 2], middle, distinct)
    return float(low) * size, float(high) * size


@dataclass(frozen=True)
class Tested:
    """The basis of the priors: the lowest and highest level tested, and the smallest step between two."""

    low: float
    high: float
    step: float

    @property
    def range(self) -> float:
        """The distance from the lowest to the highest level."""
        return self.high - self.low


def tested(levels: Floats) -> Tested:
    """Return the levels' range and smallest step."""
    return Tested(float(levels.min()), float(levels.max()), float(np.diff(np.sort(levels)).min()))


def threshold_prior(place: Floats, of: Tested) -> Floats:
    """Return a prior that is flat over the tested levels, and falls as a cosine to 0 half a range beyond them."""
    beyond = np.maximum(of.low - place, place - of.high) / (of.range / 2)
    return np.where(beyond <= 0, 1.0, np.where(beyond < 1, (1 + np.cos(np.pi * np.minimum(beyond, 1))) / 2, 0.0))


def width_prior(width: Floats, of: Tested) -> Floats:
    """Return a prior that is flat from two steps to the range (x.95 - x.05), 0 below a step and above 3 ranges."""
    rise = np.clip((width - of.step) / of.step, 0, 1)
    fall = np.clip((width - of.range) / (2 * of.range), 0, 1)
    result: Floats = (1 - np.cos(np.pi * rise)) / 2 * (1 + np.cos(np.pi * fall)) / 2
    return result


def rate_prior(rate: Floats) -> Floats:
    """Return Beta(1, 10), the prior of the guess rate (if estimated), the lapse rate and the overdispersion eta."""
    result: Floats = BETA * (1 - rate) ** (BETA - 1)
    return result
