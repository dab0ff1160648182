"""Tables of a fitted mixed model, with degrees of freedom by Satterthwaite's method.

As in lmerTest (Kuznetsova, Brockhoff & Christensen 2017, section 2): with V(psi) the covariance of the fixed effects,
psi the free numbers and log sigma, and A twice the inverse of the deviance's second derivatives, a contrast l has
2 (l'Vl)^2 / (g'Ag) degrees, g the derivatives of l'Vl.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.analysis.mixed_models.design import Design, Effect, Random
from palpate.analysis.mixed_models.optimising import FLAT, Optimum, jacobian
from palpate.analysis.mixed_models.problem import Problem, Reduced, Solved, degrees_of_freedom, solve
from palpate.analysis.statistics.doubles import Floats, rescaled
from palpate.analysis.statistics.f_and_t import f_tail, p_note, t_critical, t_two_sided

FIXED = ["effect", "estimate", "se", "df", "t", "p", "ci_low", "ci_high", "note"]
EFFECTS = ["Source", "F", "ddof1", "ddof2", "p_unc", "note"]
VARIANCES = ["group", "effect", "variance", "sd", "icc"]
CORRELATIONS = ["group", "effect_1", "effect_2", "covariance", "correlation", "note"]
NO_CORRELATION = "undefined: a variance is zero"


@dataclass(frozen=True)
class Uncertainty:
    """Internal fixed effects, their covariance and its derivatives by the variances (along the profiled deviance)."""

    coefficients: Floats
    covariance: Floats
    moves: Floats
    spread: Floats
    sigma_spread: float

    def degrees(self, contrast: Floats) -> float:
        """Return Satterthwaite's degrees of freedom of one contrast of the internal fixed effects."""
        variance = float(contrast @ self.covariance @ contrast)
        slopes = np.einsum("i,kij,j->k", contrast, self.moves, contrast) / variance
        return 2 / (float(slopes @ self.spread @ slopes) + 4 * self.sigma_spread)


@dataclass(frozen=True)
class FTest:
    """The test of one hypothesis on one or several contrasts."""

    f: float
    df1: int
    df2: float
    p: float


def uncertainty(problem: Problem, parts: Reduced, best: Optimum, at: Solved, reml: bool) -> Uncertainty:
    """Return the covariance of the fixed effects at the optimum, y in its internal unit."""
    degrees = degrees_of_freedom(problem, reml)
    sigma2 = at.rss / degrees

    def numbers(free: Floats) -> Floats:
        here = solve(problem, parts, best.parameters.factors(free))
        return np.concatenate([[here.rss / sigma2], here.covariance().ravel()])

    moved, covariance = jacobian(numbers, best.free), sigma2 * at.covariance()
    p = len(covariance)
    # The derivative by log sigma is 2 V; along the profile sigma follows: d log sigma = (d rss / sigma^2) / (2 df).
    along = moved[:, 0] / (2 * degrees)
    moves = sigma2 * moved[:, 1:].reshape(-1, p, p) + 2 * along[:, None, None] * covariance
    # The inverse over the directions that have a curvature; along the others nothing changes.
    values, vectors = np.linalg.eigh(best.curved)
    firm = values > FLAT * values.max()
    inverse: Floats = (vectors[:, firm] / values[firm]) @ vectors[:, firm].T
    return Uncertainty(at.coefficients, covariance, moves, 2 * inverse, 2 / (4 * degrees))


def f_test(estimates: Uncertainty, contrasts: Floats) -> FTest:
    """Return the F test that all contrasts (rows, internal coordinates) are zero, with df2 pooled as in lmerTest."""
    values, vectors = np.linalg.eigh(contrasts @ estimates.covariance @ contrasts.T)
    turned = vectors.T @ contrasts
    t2 = (turned @ estimates.coefficients) ** 2 / values
    df2 = pooled([estimates.degrees(contrast) for contrast in turned])
    f = float(t2.mean())
    return FTest(f, len(contrasts), df2, f_tail(f, len(contrasts), df2))


def pooled(degrees: Sequence[float]) -> float:
    """Return the denominator's degrees of freedom for a sum of squared t with these df (Fai & Cornelius 1996)."""
    if len(degrees) == 1 or max(degrees) - min(degrees) < 1e-8:
        return math.fsum(degrees) / len(degrees)
    if min(degrees) <= 2:
        return 2.0
    expected = math.fsum(df / (df - 2) for df in degrees)
    return 2 * expected / (expected - len(degrees))


def fixed_table(estimates: Uncertainty, design: Design, exponent: int, pivot: float, confidence: float) -> pd.DataFrame:
    """Return one row per reported coefficient, in the outcome's unit."""
    rows = []
    for i, (name, contrast) in enumerate(zip(design.names, design.back(), strict=True)):
        estimate = rescaled(float(contrast @ estimates.coefficients), exponent) + (pivot if i == 0 else 0.0)
        se = rescaled(math.sqrt(float(contrast @ estimates.covariance @ contrast)), exponent)
        df = estimates.degrees(contrast)
        p, half = t_two_sided(estimate / se, df), t_critical(df, confidence) * se
        rows.append((name, estimate, se, df, estimate / se, p, estimate - half, estimate + half, p_note([p])))
    return pd.DataFrame(rows, columns=FIXED)


def effects_table(estimates: Uncertainty, contrasts: Mapping[Effect, Floats]) -> pd.DataFrame:
    """Return one F test per effect, that all of its contrasts are zero."""
    rows = []
    for effect, rows_of_contrast in contrasts.items():
        test = f_test(estimates, rows_of_contrast)
        rows.append((":".join(effect), test.f, test.df1, test.df2, test.p, p_note([test.p])))
    return pd.DataFrame(rows, columns=EFFECTS)


def covariances(random: Sequence[Random], factors: Sequence[Floats], sigma2: float) -> list[Floats]:
    """Return the covariance of each term's reported effects, in the unit of sigma squared."""
    roots = [term.back @ factor for term, factor in zip(random, factors, strict=True)]
    return [sigma2 * (root @ root.T) for root in roots]


def variances_table(
    random: Sequence[Random], covariance: Sequence[Floats], means: Sequence[float], sigma2: float, exponent: int
) -> pd.DataFrame:
    """Return one row per random effect and the residual; `means` are the terms' mean variances over the values."""
    total, rows = math.fsum([*means, sigma2]), []
    for term, matrix, mean in zip(random, covariance, means, strict=True):
        for i, (effect, variance) in enumerate(zip(term.effects, np.diag(matrix).tolist(), strict=True)):
            rows.append((term.name, effect, *_sizes(variance, exponent), mean / total if i == 0 else math.nan))
    rows.append(("Residual", "", *_sizes(sigma2, exponent), math.nan))
    return pd.DataFrame(rows, columns=VARIANCES)


def _sizes(variance: float, exponent: int) -> tuple[float, float]:
    return rescaled(variance, 2 * exponent), rescaled(math.sqrt(variance), exponent)


def correlations_table(random: Sequence[Random], covariance: Sequence[Floats], exponent: int) -> pd.DataFrame:
    """Return one row per pair of correlated random effects of a grouping factor."""
    rows = []
    for term, matrix in zip(random, covariance, strict=True):
        sd = np.sqrt(np.diag(matrix))
        for i in range(term.size if term.correlated else 0):
            for j in range(i):
                product = float(sd[i] * sd[j])
                r = min(1.0, max(-1.0, float(matrix[i, j]) / product)) if product else math.nan
                shared = rescaled(float(matrix[i, j]), 2 * exponent)
                note = "" if product else NO_CORRELATION
                rows.append((term.name, term.effects[j], term.effects[i], shared, r, note))
    return pd.DataFrame(rows, columns=CORRELATIONS)
