"""Cumulative link models as rows of linear bounds, and their maximum likelihood fit by Newton's method.

P(Y <= j) = F(theta_j - x'beta), so each answer is an interval (lower'g, upper'g) of a latent scale, linear in all
parameters g = (theta, beta). The log likelihood is concave (Pratt 1981), so what is stationary is the maximum.
Probabilities are logarithms, so that an interval far out in a tail keeps its digits.
Sources: McCullagh 1980; Agresti 2010; Christensen 2018, Cumulative link models for ordinal regression (R's ordinal).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import log_expit, log_ndtr, ndtri

from palpate.analysis.ordinal.ranks import Ints, Truths
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import NotConverged

MOST_STEPS = 200
HALVINGS = 40
SETTLED = 1e-20  # Newton decrement, per answer
PLATEAU = 1e-13  # gain of log likelihood, relative
SMALL_GAIN = 1e-10  # Newton decrement below which rounding may end the search
FLAT = 1e-12  # information in some direction, relative to the most, that is none
Link: TypeAlias = Literal["logit", "probit"]
LINKS = ("logit", "probit")
HALF_LOG_TAU = math.log(2 * math.pi) / 2
END = 1e100  # stands for infinity at the outer ends, where density and slope are 0


@dataclass(frozen=True)
class AnswerIntervals:
    """Answers as intervals: rows with `weights`, and bounds `upper` and `lower` (rows, parameters).

    Rows of one participant are consecutive; `starts` are the first row of each participant.
    """

    upper: Floats
    lower: Floats
    last: Truths  # no upper bound: the highest answer
    first: Truths  # no lower bound: the lowest answer
    weights: Floats
    starts: Ints

    @property
    def answers(self) -> float:
        """The number of answers that the rows represent."""
        return float(self.weights.sum())

    def bounds(self, g: Floats) -> tuple[Floats, Floats]:
        """Return the ends of each row's interval."""
        return np.where(self.last, END, self.upper @ g), np.where(self.first, -END, self.lower @ g)


@dataclass(frozen=True)
class Fit:
    """The parameters at the maximum, the negative second derivatives there, and how the search ended."""

    g: Floats
    information: Floats
    log_likelihood: float
    steps: int


def rows_of(answers: Ints, points: int, x: Floats, free: Floats, weights: Floats, starts: Ints) -> AnswerIntervals:
    """Return the bounds of answers 0 .. points - 1: thresholds, then slopes.

    Every column of `free` has a slope at each threshold.
    Columns of `x` have one slope for all thresholds (proportional odds), columns of `free` one at each.
    """
    block = np.concatenate((np.ones((len(answers), 1)), -free), axis=1)

    def bound(at: Ints) -> Floats:
        wide = np.zeros((len(answers), points - 1, block.shape[1]))
        inside = np.flatnonzero((at >= 0) & (at < points - 1))
        wide[inside, at[inside]] = block[inside]
        return np.concatenate((wide.reshape(len(answers), -1), -x), axis=1)

    return AnswerIntervals(bound(answers), bound(answers - 1), answers == points - 1, answers == 0, weights, starts)


def start_of(answers: Ints, points: int, weights: Floats, columns: int, free: int, link: Link) -> Floats:
    """Return thresholds that reproduce each answer's share, and slopes of zero."""
    share = np.cumsum(np.bincount(answers, weights=weights, minlength=points))[:-1] / weights.sum()
    wide = np.zeros((points - 1, 1 + free))
    wide[:, 0] = latent_quantile(share, link)
    return np.concatenate((wide.ravel(), np.zeros(columns)))


def log_likelihood(rows: AnswerIntervals, g: Floats, link: Link) -> float:
    """Return the log likelihood; minus infinity if thresholds are out of order."""
    high, low = rows.bounds(g)
    if not np.all(high > low):
        return -np.inf
    return float(np.dot(rows.weights, interval(high, low, link).log_p))


def derivatives(rows: AnswerIntervals, g: Floats, link: Link) -> tuple[float, Floats, Floats]:
    """Return log likelihood, gradient and negative second derivatives."""
    intervals = interval(*rows.bounds(g), link)
    score = intervals.f_high[:, None] * rows.upper - intervals.f_low[:, None] * rows.lower
    weighted = rows.weights[:, None]
    information = (
        score.T @ (weighted * score)
        - rows.upper.T @ (weighted * intervals.s_high[:, None] * rows.upper)
        + rows.lower.T @ (weighted * intervals.s_low[:, None] * rows.lower)
    )
    return float(np.dot(rows.weights, intervals.log_p)), rows.weights @ score, information


def fit_rows(rows: AnswerIntervals, start: Floats, link: Link) -> Fit:
    """Fit by Newton's method with halved steps from `start`, whose thresholds must be in order."""
    g = start
    for steps in range(MOST_STEPS):
        value, gradient, information = derivatives(rows, g, link)
        step = newton_step(information, gradient)
        gain = float(gradient @ step)
        if gain <= SETTLED * rows.answers:
            return Fit(g + step, information, value, steps)
        before, (g, reached) = g, _uphill(rows, g, step, value, link)
        if reached - value <= PLATEAU * abs(value) and gain < SMALL_GAIN:
            return Fit(g, derivatives(rows, g, link)[2], reached, steps)
        if g is before:
            break
    raise NotConverged("no maximum of the ordinal model's likelihood was found; leave predictors out")


def newton_step(information: Floats, gradient: Floats) -> Floats:
    """Return the Newton step, without directions that no answer determines."""
    values, vectors = np.linalg.eigh(information)
    informed = values > FLAT * values[-1]
    step: Floats = vectors[:, informed] @ ((vectors.T @ gradient)[informed] / values[informed])
    return step


def _uphill(rows: AnswerIntervals, g: Floats, step: Floats, value: float, link: Link) -> tuple[Floats, float]:
    """Return the longest of the steps 1, 1/2, 1/4, ... that does not decrease the likelihood; no step if all do."""
    for halving in range(HALVINGS):
        tried = g + step / 2**halving
        reached = log_likelihood(rows, tried, link)
        if reached >= value:
            return tried, reached
    return g, value


@dataclass(frozen=True)
class Interval:
    """log P(low < Z <= high) and, in units of P, the densities at its ends and the densities' slopes.

    With p = F(high) - F(low): `f_high` = F'(high) / p, `s_high` = F''(high) / p, the same for the low end.
    """

    log_p: Floats
    f_high: Floats
    f_low: Floats
    s_high: Floats
    s_low: Floats


def interval(high: Floats, low: Floats, link: Link) -> Interval:
    """Return the interval's log probability and derivatives; `high` > `low` everywhere, END or -END for an open end."""
    log_p = _log_p(high, low, link)
    f_high, f_low = (np.exp(_log_density(end, link) - log_p) for end in (high, low))
    return Interval(log_p, f_high, f_low, f_high * _relative_slope(high, link), f_low * _relative_slope(low, link))


def latent_quantile(share: Floats, link: Link) -> Floats:
    """Return the point of the latent scale below which this share lies."""
    quantile: Floats = np.log(share) - np.log1p(-share) if link == "logit" else ndtri(share)
    return quantile


def _log_p(high: Floats, low: Floats, link: Link) -> Floats:
    if link == "logit":
        log_p: Floats = log_expit(high) + log_expit(-low) + np.log(-np.expm1(low - high))
        return log_p
    flip = low > 0  # where both ends are above 0 the upper tail holds the digits
    top, bottom = log_ndtr(np.where(flip, -low, high)), log_ndtr(np.where(flip, -high, low))
    below: Floats = np.minimum(bottom - top, -math.ulp(0.0))
    return np.asarray(top + np.log(-np.expm1(below)), dtype=np.float64)


def _log_density(x: Floats, link: Link) -> Floats:
    log_density: Floats = log_expit(x) + log_expit(-x) if link == "logit" else -x * x / 2 - HALF_LOG_TAU
    return log_density


def _relative_slope(x: Floats, link: Link) -> Floats:
    """Return F''(x) / F'(x)."""
    slope: Floats = -np.tanh(x / 2) if link == "logit" else np.where(np.abs(x) < END, -x, 0.0)
    return slope
