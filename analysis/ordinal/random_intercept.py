"""Cumulative link models with a normal intercept for each participant: the maximum of the marginal likelihood.

P(Y <= j) = F(theta_j - x'beta - sigma z_i) with z_i standard normal, integrated by adaptive Gauss-Hermite quadrature:
each participant's integral is taken around the mode of its own integrand, in units of its own width (Liu & Pierce
1994; Pinheiro & Bates 1995). First and second derivatives are expectations over the same nodes (Louis 1982).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.hermite import hermgauss
from scipy.special import logsumexp

from palpate.analysis.ordinal.cumulative import AnswerIntervals, Fit, Interval, Link, interval
from palpate.analysis.ordinal.ranks import Ints
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import NotConverged

NODES = (25, 51, 101)  # of the quadrature; more where the next count changes the likelihood
CLOSE = 1e-8  # change of log likelihood, relative, that does not call for more nodes
FAR = 1e-5  # change that the last count must not see
MOST_STEPS = 200
HALVINGS = 30
SETTLED = 1e-18  # Newton decrement, per answer
STOPPED = 1e-6  # Newton decrement of a search that rounding ends
LARGEST_SD = 25.0  # on the latent scale: participants who each give one and the same answer
MODE_STEPS = 100
MODE_SETTLED = 1e-12
LONGEST_STEP = 2.0
BATCH = 1_000_000  # numbers held at once


def fit_intercepts(rows: AnswerIntervals, g: Floats, sigma: float, link: Link) -> tuple[Fit, float]:
    """Return the maximum over (g, sigma) from a start: the fit, and sigma >= 0.

    Raises NotConverged if none is found.
    """
    at = np.append(g, sigma)
    for count, more in zip(NODES, (*NODES[1:], 2 * NODES[-1]), strict=True):
        maximum = _maximum(Marginal(rows, link, count), at)
        at = maximum.g
        change = abs(marginal_likelihood(Marginal(rows, link, more), at) - maximum.log_likelihood)
        if change <= CLOSE * abs(maximum.log_likelihood) or (count == NODES[-1] and change <= FAR):
            return maximum, abs(float(at[-1]))
    raise NotConverged("the participants' intercepts cannot be integrated out: some answers hardly ever change")


def _maximum(model: Marginal, start: Floats) -> Fit:
    at = start
    value, gradient, information = marginal_derivatives(model, at)
    for steps in range(MOST_STEPS):
        # Newton's direction, with the size of every curvature: the likelihood need not be concave.
        values, vectors = np.linalg.eigh(information)
        least = max(float(np.abs(values).max()) * 1e-12, math.ulp(1.0))
        step: Floats = vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(values), least))
        gain = float(gradient @ step)
        if gain <= SETTLED * model.rows.answers:
            return Fit(at, information, value, steps)
        for halving in range(HALVINGS):
            tried = at + step / 2**halving
            if marginal_likelihood(model, tried) > value:
                break
        else:
            if gain > STOPPED:
                raise NotConverged("the ordinal model's likelihood ends where it is not flat; leave predictors out")
            return Fit(at, information, value, steps)
        at = tried
        if abs(float(at[-1])) > LARGEST_SD:
            raise NotConverged("the participants' standard deviation grows without end: nearly each gives one answer")
        value, gradient, information = marginal_derivatives(model, at)
    raise NotConverged(f"no maximum of the ordinal model's likelihood in {MOST_STEPS} steps; leave predictors out")


@dataclass(frozen=True)
class Marginal:
    """Answers, the link and the number of nodes of each participant's integral; parameters are (g, sigma)."""

    rows: AnswerIntervals
    link: Link
    nodes: int

    @property
    def lengths(self) -> Ints:
        """The number of rows of each participant."""
        lengths: Ints = np.diff(np.append(self.rows.starts, len(self.rows.weights)))
        return lengths

    def per_person(self, values: Floats) -> Floats:
        """Return the sum of each participant's rows."""
        sums: Floats = np.add.reduceat(values, self.rows.starts, axis=0)
        return sums

    def per_row(self, values: Floats) -> Floats:
        """Return participants' values repeated for each of their rows."""
        repeated: Floats = np.repeat(values, self.lengths, axis=0)
        return repeated


@dataclass(frozen=True)
class Bounds:
    """The ends of each row's interval without an intercept, and the intercepts' standard deviation."""

    high: Floats
    low: Floats
    sigma: float

    def at(self, model: Marginal, z: Floats) -> Interval:
        """Return the intervals for random effects `z`, (participants,) or (participants, nodes)."""
        by = model.per_row(self.sigma * z)
        high, low = (self.high, self.low) if z.ndim == 1 else (self.high[:, None], self.low[:, None])
        return interval(high - by, low - by, model.link)


@dataclass(frozen=True)
class Nodes:
    """Nodes and log weights of each participant's integral, (participants, nodes) each."""

    z: Floats
    log_weights: Floats


def marginal_likelihood(model: Marginal, at: Floats) -> float:
    """Return the log likelihood at (g, sigma); minus infinity if thresholds are out of order."""
    high, low = model.rows.bounds(at[:-1])
    if not np.all(high > low):
        return -math.inf
    bounds = Bounds(high, low, float(at[-1]))
    return float(logsumexp(_logs(model, bounds, _nodes(model, bounds)), axis=1).sum())


def marginal_derivatives(model: Marginal, at: Floats) -> tuple[float, Floats, Floats]:
    """Return log likelihood, gradient and negative second derivatives at (g, sigma)."""
    bounds = Bounds(*model.rows.bounds(at[:-1]), float(at[-1]))
    nodes = _nodes(model, bounds)
    logs = _logs(model, bounds, nodes)
    own = logsumexp(logs, axis=1)
    shares = np.exp(logs - own[:, None])
    mean, information = np.zeros((len(own), len(at))), np.zeros((len(at), len(at)))
    for some in _batches(model, len(at)):
        score, bend = _complete(model, bounds, nodes.z[:, some], shares[:, some])
        weighted = shares[:, some, None] * score
        mean += weighted.sum(axis=1)
        information += bend - np.tensordot(weighted, score, axes=((0, 1), (0, 1)))
    return float(own.sum()), mean.sum(axis=0), information + mean.T @ mean


def _batches(model: Marginal, width: int) -> Iterator[slice]:
    """Yield slices of nodes, a few at a time, so that memory stays bounded."""
    size = max(1, BATCH // (len(model.rows.weights) * width))
    for start in range(0, model.nodes, size):
        yield slice(start, min(start + size, model.nodes))


def _nodes(model: Marginal, bounds: Bounds) -> Nodes:
    """Return the nodes around each participant's mode, by Newton's method: the log integrand is concave."""
    z = np.zeros(len(model.rows.starts))
    bend = np.ones_like(z)
    for _ in range(MODE_STEPS):
        intervals = bounds.at(model, z)
        slope = intervals.f_high - intervals.f_low
        curve = intervals.s_high - intervals.s_low - slope * slope
        down = bounds.sigma * model.per_person(model.rows.weights * slope) + z
        bend = 1 - bounds.sigma**2 * model.per_person(model.rows.weights * curve)
        step = down / bend
        z = z - np.clip(step, -LONGEST_STEP, LONGEST_STEP)
        if float(np.abs(step).max()) < MODE_SETTLED:
            break
    x, weights = hermgauss(model.nodes)
    used = weights > 0  # of many nodes the outermost weigh nothing
    width = 1 / np.sqrt(bend)
    log_weights = np.where(used, np.log(np.where(used, weights, 1.0)) + x * x, -np.inf)
    places = z[:, None] + math.sqrt(2) * width[:, None] * np.where(used, x, 0.0)
    return Nodes(places, log_weights + np.log(width)[:, None] - math.log(math.pi) / 2)


def _logs(model: Marginal, bounds: Bounds, nodes: Nodes) -> Floats:
    """Return the log of each participant's integrand times weight, at its nodes."""
    weights = model.rows.weights[:, None]
    parts = [model.per_person(weights * bounds.at(model, nodes.z[:, some]).log_p) for some in _batches(model, 1)]
    logs: Floats = np.concatenate(parts, axis=1) - nodes.z**2 / 2 + nodes.log_weights
    return logs


def _complete(model: Marginal, bounds: Bounds, z: Floats, shares: Floats) -> tuple[Floats, Floats]:
    """Return each participant's score at the nodes, (participants, nodes, parameters), and all information there."""
    intervals, rows = bounds.at(model, z), model.rows
    upper, lower = (_widened(side, model.per_row(-z)) for side in (rows.upper, rows.lower))
    score = intervals.f_high[..., None] * upper - intervals.f_low[..., None] * lower
    weight = rows.weights[:, None] * model.per_row(shares)
    bend = (
        _product(weight, score) - _product(weight * intervals.s_high, upper) + _product(weight * intervals.s_low, lower)
    )
    return model.per_person(rows.weights[:, None, None] * score), bend


def _widened(side: Floats, moved: Floats) -> Floats:
    """Return the rows' columns at every node, plus the node's column of sigma."""
    shape = (*moved.shape, side.shape[1])
    return np.concatenate((np.broadcast_to(side[:, None, :], shape), moved[..., None]), axis=2)


def _product(weight: Floats, columns: Floats) -> Floats:
    """Return the sum of weight x column x column over rows and nodes."""
    flat = columns.reshape(-1, columns.shape[2])
    product: Floats = flat.T @ (weight.reshape(-1, 1) * flat)
    return product
