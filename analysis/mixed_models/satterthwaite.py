"""Degrees of freedom by Satterthwaite's method, as lmerTest: Kuznetsova, Brockhoff & Christensen 2017, section 2.

With V(psi) the covariance of the fixed effects, psi the free numbers and log sigma, and A twice the inverse of the
deviance's second derivatives, a contrast l has 2 (l'Vl)^2 / (g'Ag) degrees, g the derivatives of l'Vl.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.analysis.mixed_models.criterion import Solved, degrees_of_freedom, solved
from palpate.analysis.mixed_models.derivatives import jacobian
from palpate.analysis.mixed_models.optimising import FLAT, Optimum
from palpate.analysis.mixed_models.problem import Problem
from palpate.analysis.mixed_models.reducing import Reduced
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.pvalues import f_tail


@dataclass(frozen=True)
class Uncertainty:
    """Internal fixed effects, their covariance and how it moves with the variances (along the profiled deviance)."""

    coefficients: Floats
    covariance: Floats
    moves: Floats
    spread: Floats
    sigma_spread: float

    def degrees(self, contrast: Floats) -> float:
        """Satterthwaite's degrees of freedom of one contrast of the internal fixed effects."""
        variance = float(contrast @ self.covariance @ contrast)
        slopes = np.einsum("i,kij,j->k", contrast, self.moves, contrast) / variance
        return 2 / (float(slopes @ self.spread @ slopes) + 4 * self.sigma_spread)


@dataclass(frozen=True)
class FTest:
    """One hypothesis on one or several contrasts."""

    f: float
    df1: int
    df2: float
    p: float


def uncertainty(problem: Problem, parts: Reduced, best: Optimum, at: Solved, reml: bool) -> Uncertainty:
    """The covariance of the fixed effects at the optimum, y in its internal unit."""
    degrees = degrees_of_freedom(problem, reml)
    sigma2 = at.rss / degrees

    def numbers(free: Floats) -> Floats:
        here = solved(problem, parts, best.parameters.factors(free))
        return np.concatenate([[here.rss / sigma2], here.covariance().ravel()])

    moved, covariance = jacobian(numbers, best.free), sigma2 * at.covariance()
    p = len(covariance)
    # The derivative by log sigma is 2 V; along the profile sigma follows: d log sigma = (d rss / sigma^2) / (2 df).
    along = moved[:, 0] / (2 * degrees)
    moves = sigma2 * moved[:, 1:].reshape(-1, p, p) + 2 * along[:, None, None] * covariance
    return Uncertainty(at.coefficients, covariance, moves, 2 * _inverse(best.curved), 2 / (4 * degrees))


def _inverse(curved: Floats) -> Floats:
    """The inverse over the directions that have a curvature; along the others nothing changes."""
    values, vectors = np.linalg.eigh(curved)
    firm = values > FLAT * values.max()
    inverse: Floats = (vectors[:, firm] / values[firm]) @ vectors[:, firm].T
    return inverse


def f_test(found: Uncertainty, contrasts: Floats) -> FTest:
    """The F test that all contrasts (rows, internal coordinates) are zero; df2 as lmerTest pools it."""
    values, vectors = np.linalg.eigh(contrasts @ found.covariance @ contrasts.T)
    turned = vectors.T @ contrasts
    t2 = (turned @ found.coefficients) ** 2 / values
    df2 = pooled([found.degrees(each) for each in turned])
    f = float(t2.mean())
    return FTest(f, len(contrasts), df2, f_tail(f, len(contrasts), df2))


def pooled(degrees: Sequence[float]) -> float:
    """The denominator's degrees of freedom of a sum of squared t with these (Fai & Cornelius 1996)."""
    if len(degrees) == 1 or max(degrees) - min(degrees) < 1e-8:
        return math.fsum(degrees) / len(degrees)
    if min(degrees) <= 2:
        return 2.0
    expected = math.fsum(each / (each - 2) for each in degrees)
    return 2 * expected / (expected - len(degrees))
