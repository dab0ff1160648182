"""Cumulative link models with a normal intercept for each participant: the maximum of the marginal likelihood.

P(Y <= j) = F(theta_j - x'beta - sigma z_i) with z_i standard normal; `marginal` integrates z_i out.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.analysis.ordinal.cumulative import Fit, Rows
from palpate.analysis.ordinal.links import Link
from palpate.analysis.ordinal.marginal import Marginal, marginal_derivatives, marginal_likelihood
from palpate.analysis.ordinal.refusals import NotConverged
from palpate.analysis.statistics.doubles import Floats

NODES = (25, 51, 101)  # of the quadrature; more where the next count changes the likelihood
CLOSE = 1e-8  # change of log likelihood, relative, that does not call for more nodes
FAR = 1e-5  # change that the last count must not see
MOST_STEPS = 200
HALVINGS = 30
SETTLED = 1e-18  # Newton decrement, per answer
STOPPED = 1e-6  # Newton decrement of a search that rounding ends
LARGEST_SD = 25.0  # on the latent scale: participants who each give one and the same answer


def fit_intercepts(rows: Rows, g: Floats, sigma: float, link: Link) -> tuple[Fit, float]:
    """The maximum over (g, sigma) from a start; the fit's parameters are g followed by sigma, which is also given >= 0.

    Raises NotConverged where there is none within reach.
    """
    at = np.append(g, sigma)
    for count, more in zip(NODES, (*NODES[1:], 2 * NODES[-1]), strict=True):
        found = _maximum(Marginal(rows, link, count), at)
        at = found.g
        change = abs(marginal_likelihood(Marginal(rows, link, more), at) - found.log_likelihood)
        if change <= CLOSE * abs(found.log_likelihood) or (count == NODES[-1] and change <= FAR):
            return found, abs(float(at[-1]))
    raise NotConverged("the participants' intercepts cannot be integrated out: some answers hardly ever change")


def _maximum(model: Marginal, start: Floats) -> Fit:
    at = start
    value, gradient, information = marginal_derivatives(model, at)
    for steps in range(MOST_STEPS):
        step = _ascent(information, gradient)
        gain = float(gradient @ step)
        if gain <= SETTLED * model.rows.answers:
            return Fit(at, information, value, steps)
        tried, reached = _uphill(model, at, step, value)
        if reached <= value:
            if gain > STOPPED:
                raise NotConverged("the ordinal model's likelihood ends where it is not flat; leave predictors out")
            return Fit(at, information, value, steps)
        at = tried
        if abs(float(at[-1])) > LARGEST_SD:
            raise NotConverged("the participants' standard deviation grows without end: nearly each gives one answer")
        value, gradient, information = marginal_derivatives(model, at)
    raise NotConverged(f"no maximum of the ordinal model's likelihood in {MOST_STEPS} steps; leave predictors out")


def _ascent(information: Floats, gradient: Floats) -> Floats:
    """A direction upwards: Newton's, with every curvature taken as its size (the likelihood need not be concave)."""
    values, vectors = np.linalg.eigh(information)
    least = max(float(np.abs(values).max()) * 1e-12, math.ulp(1.0))
    step: Floats = vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(values), least))
    return step


def _uphill(model: Marginal, at: Floats, step: Floats, value: float) -> tuple[Floats, float]:
    for halving in range(HALVINGS):
        tried = at + step / 2**halving
        reached = marginal_likelihood(model, tried)
        if reached > value:
            return tried, reached
    return at, value
