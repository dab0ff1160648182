"""Binomial generalised linear mixed models: participants differ in intercept and slope, by adaptive quadrature.

P(hit) = F(x b + z u), u ~ N(0, S) for each participant, F the standard normal (probit) or logistic (logit) distribution
function. The integral over u is by Gauss-Hermite quadrature around each participant's mode (Pinheiro & Bates 1995); one
node is Laplace's approximation, as in lme4. The covariance S = L L' is free in the elements of L. Source of the model
for psychometric functions: Moscatelli, Mezzetti & Lacquaniti 2012.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import gammaln, log_expit, log_ndtr

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, NotConverged, NotIdentified, RankDeficient, TooFew, shown

Link: TypeAlias = Literal["probit", "logit"]
STEPS, CLOSE = 60, 1e-10
LEAST_PEOPLE = 3
SHIFT = 1e-4
NO_SPREAD = 1e-3
"""A standard deviation of participants below this share of the fixed effect's scale counts as none."""
STEEPEST = 1e-3
"""The largest gradient of the log likelihood at a maximum, per unit of a standard error."""
ROOT = math.sqrt(2 * math.pi)


@dataclass(frozen=True)
class Counts:
    """Counts: `hits` of `trials` in each row, the row's `group` (codes from 0), designs `fixed` and `random`."""

    hits: Floats
    trials: Floats
    group: NDArray[np.int64]
    fixed: Floats
    random: Floats


@dataclass(frozen=True)
class BinomialMixed:
    """The fit: fixed effects with their covariance, SDs and correlation of participants, and the log likelihood.

    `modes` (groups, random effects) are the conditional modes of the participants' deviations. `nodes` is the number of
    quadrature nodes by random effect.
    """

    fixed: Floats
    covariance: Floats
    sd: Floats
    correlation: float | None
    log_likelihood: float
    modes: Floats
    nodes: int
    link: Link
    groups: int


def fit_binomial_mixed(counts: Counts, link: Link = "probit", nodes: int = 7) -> BinomialMixed:
    """Fit the model by maximum likelihood.

    Standard errors are from the numerical Hessian over all parameters. Raises BadOption; TooFew for fewer than three
    participants; RankDeficient where fixed effects are collinear; NotIdentified where participants do not differ in a
    random effect (its SD is at 0), or each has fewer levels than random effects; NotConverged.
    """
    if link not in ("probit", "logit"):
        raise BadOption(f"link={shown(link)} is unknown: 'probit' or 'logit'")
    if isinstance(nodes, bool) or not isinstance(nodes, int) or not 1 <= nodes <= 51:
        raise BadOption(f"nodes={shown(nodes)}: a whole number from 1 to 51 is expected")
    effects, size = counts.random.shape[1], counts.fixed.shape[1]
    groups = int(counts.group.max()) + 1
    if groups < LEAST_PEOPLE:
        raise TooFew(f"{groups} participants; a model of how participants differ needs {LEAST_PEOPLE} or more")
    if np.linalg.matrix_rank(counts.fixed) < size:
        raise RankDeficient("the fixed effects are collinear: a condition or level is missing; leave a term out")
    for group in range(groups):
        own = counts.random[counts.group == group]
        if np.linalg.matrix_rank(own) < effects:
            raise NotIdentified(
                f"participant {group + 1} of {groups} has too few levels for {effects} random effects; leave one out"
            )
    start = np.concatenate([_plain(counts, link), _packed(0.5 * np.eye(effects))])
    modes = np.zeros((groups, effects))

    def value(place: Floats) -> float:
        return -_log_likelihood(place, counts, link, nodes, modes)

    best = minimize(value, start, method="BFGS", options={"gtol": 1e-5, "maxiter": 400})
    hessian = _hessian(value, best.x)
    signs, gap = np.linalg.eigvalsh(hessian), _gradient(value, best.x)
    factor = _lower(best.x[size:], effects)
    sd = np.sqrt((factor**2).sum(axis=1))
    for i, spread in enumerate(sd.tolist()):
        scale = max(1.0, float(np.abs(best.x[:size]).max()))
        if spread < NO_SPREAD * scale:
            raise NotIdentified(
                f"random effect {i + 1}: participants do not differ in it (SD {spread:.2g}); leave it out of `random`"
            )
    correlation = float((factor @ factor.T)[0, 1] / (sd[0] * sd[1])) if effects > 1 else None
    if correlation is not None and abs(correlation) > 0.9999:
        raise NotIdentified(
            f"the random effects are correlated {correlation:+.4f}: the data do not tell them apart; leave one out"
        )
    if signs[0] <= 0:
        raise NotConverged("the likelihood is not curved at its maximum: an effect has no finite estimate")
    covariance: Floats = np.asarray(np.linalg.inv(hessian), dtype=np.float64)
    if float(np.abs(gap * np.sqrt(np.diag(covariance))).max()) > STEEPEST:
        raise NotConverged("the search ended before the maximum of the likelihood; scale the levels, or test others")
    return BinomialMixed(
        np.asarray(best.x[:size], dtype=np.float64),
        covariance[:size, :size],
        np.asarray(sd, dtype=np.float64),
        correlation,
        -float(best.fun),
        modes.copy(),
        nodes,
        link,
        groups,
    )


def _plain(counts: Counts, link: Link) -> Floats:
    """Return the fixed effects without random ones, by scoring."""
    place = np.zeros(counts.fixed.shape[1])
    for _ in range(STEPS):
        slope, curve = _derivatives(counts.fixed @ place, counts.hits, counts.trials, link)[1:]
        system = counts.fixed.T @ (curve[:, None] * counts.fixed)
        step = np.linalg.solve(system + 1e-9 * np.eye(len(place)), counts.fixed.T @ slope)
        place = np.clip(place + step, -50, 50)
        if float(np.abs(step).max()) < CLOSE:
            break
    return place


def _derivatives(eta: Floats, hits: Floats, trials: Floats, link: Link) -> tuple[Floats, Floats, Floats]:
    """Return the log likelihood of each row, its slope in eta, and its negative second derivative (positive)."""
    misses = trials - hits
    if link == "logit":
        share = np.exp(log_expit(eta))
        value = hits * log_expit(eta) + misses * log_expit(-eta)
        return value, hits - trials * share, np.maximum(trials * share * (1 - share), 1e-12)
    up, down = log_ndtr(eta), log_ndtr(-eta)
    density = np.exp(-0.5 * eta * eta) / ROOT
    high, low = density / np.exp(np.maximum(up, -700)), density / np.exp(np.maximum(down, -700))
    high, low = np.where(eta < -30, -eta, high), np.where(eta > 30, eta, low)
    curve = hits * high * (eta + high) + misses * low * (low - eta)
    return hits * up + misses * down, hits * high - misses * low, np.maximum(curve, 1e-12)


def _log_likelihood(place: Floats, counts: Counts, link: Link, nodes: int, modes: Floats) -> float:
    """Return the log likelihood; `modes` holds the latest modes, from which the next search begins."""
    effects, size = counts.random.shape[1], counts.fixed.shape[1]
    factor = _lower(place[size:], effects)
    base = counts.fixed @ place[:size]
    z = counts.random @ factor  # u = L v with standard normal v
    spherical = np.zeros_like(modes)
    groups = len(modes)

    def joint(v: Floats) -> tuple[Floats, Floats, Floats]:
        value, slope, curve = _derivatives(
            base + np.einsum("re,re->r", z, v[counts.group]), counts.hits, counts.trials, link
        )
        total = np.bincount(counts.group, weights=value, minlength=groups) - 0.5 * (v * v).sum(axis=1)
        gradient = np.stack(
            [np.bincount(counts.group, weights=slope * z[:, e], minlength=groups) for e in range(effects)], axis=1
        )
        negative = np.zeros((groups, effects, effects))
        for a in range(effects):
            for b in range(effects):
                negative[:, a, b] = np.bincount(counts.group, weights=curve * z[:, a] * z[:, b], minlength=groups)
        return total, gradient - v, negative + np.eye(effects)

    total, gradient, negative = joint(spherical)
    for _ in range(STEPS):
        step = np.linalg.solve(negative, gradient[..., None])[..., 0]
        share = np.ones(groups)
        moved = joint(spherical + step)
        for _ in range(30):
            worse = moved[0] < total - 1e-12 * np.abs(total)
            if not worse.any():
                break
            share[worse] /= 2
            moved = joint(spherical + share[:, None] * step)
        spherical = spherical + share[:, None] * step
        total, gradient, negative = moved
        if float(np.abs(step).max()) < CLOSE:
            break
    modes[:] = spherical @ factor.T
    root = np.linalg.cholesky(negative)
    log_root = np.log(np.einsum("gee->ge", root)).sum(axis=1)
    points, weights = np.polynomial.hermite_e.hermegauss(nodes)
    mesh = np.stack([axis.ravel() for axis in np.meshgrid(*[points] * effects, indexing="ij")], axis=1)
    log_weights = np.log(np.stack(np.meshgrid(*[weights] * effects, indexing="ij"))).sum(axis=0).ravel()
    spread = np.linalg.inv(np.swapaxes(root, 1, 2))
    values = []
    for point, weight in zip(mesh, log_weights, strict=True):
        value = joint(spherical + spread @ point)[0]
        values.append(value + weight + 0.5 * float(point @ point))
    table = np.array(values)
    top = table.max(axis=0)
    marginal = top + np.log(np.exp(table - top).sum(axis=0)) - log_root - 0.5 * effects * math.log(2 * math.pi)
    misses = counts.trials - counts.hits
    constant = gammaln(counts.trials + 1) - gammaln(counts.hits + 1) - gammaln(misses + 1)
    return float(marginal.sum() + constant.sum())


def _lower(values: Floats, size: int) -> Floats:
    factor = np.zeros((size, size))
    factor[np.tril_indices(size)] = values
    return factor


def _packed(factor: Floats) -> Floats:
    result: Floats = factor[np.tril_indices(len(factor))]
    return result


def _gradient(value: Callable[[Floats], float], place: Floats) -> Floats:
    result = np.empty(len(place))
    for i in range(len(place)):
        shift = np.zeros(len(place))
        shift[i] = SHIFT * max(1.0, abs(place[i]))
        result[i] = (value(place + shift) - value(place - shift)) / (2 * shift[i])
    return result


def _hessian(value: Callable[[Floats], float], place: Floats) -> Floats:
    size = len(place)
    steps = 1e-3 * np.maximum(1.0, np.abs(place))
    result = np.empty((size, size))
    here = value(place)
    for i in range(size):
        for j in range(i + 1):
            a, b = np.zeros(size), np.zeros(size)
            a[i], b[j] = steps[i], steps[j]
            if i == j:
                result[i, i] = (value(place + a) - 2 * here + value(place - a)) / steps[i] ** 2
                continue
            corners = value(place + a + b) - value(place + a - b) - value(place - a + b) + value(place - a - b)
            result[i, j] = result[j, i] = corners / (4 * steps[i] * steps[j])
    return result
