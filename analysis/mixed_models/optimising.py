"""The minimum of the deviance, found from several starts, and proved by gradient and second derivatives or refused.

The parameters of the relative covariance factors are scaled to about one where they matter. Lambda of a term is a lower
triangle (its `units`) times a lower triangle of free numbers (correlated), or the same with diagonals (not). The signs
of the diagonal are free: a column's sign changes no covariance, so a variance of zero is not a boundary of the search
but a stationary point. Derivatives are central differences, extrapolated once (Richardson): errors of the fourth order
in the step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.optimize import minimize

from palpate.analysis.mixed_models.design import Random, triangle_of
from palpate.analysis.mixed_models.problem import Problem
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import NotConverged

SIZES = (0.0, *(10.0**k for k in range(-2, 16)))
"""Initial sizes of an effect, in natural units: up to 1e15 times the residual."""
FLAT = 1e-10  # a curvature below this share of the largest counts as none
CONVERGED = 1e-9  # how far, in deviance, the optimum may still be by its own quadratic
NO_FURTHER = 1e-5
FINE = 1e-12  # from here on rounding decides when no step helps any more
SAME = 1e-9  # a variance is zero if setting it to zero costs no more deviance than this
NEAR_ZERO = 0.05
Vector: TypeAlias = Callable[[Floats], Floats]
Scalar: TypeAlias = Callable[[Floats], float]
STEP = 3e-3
WIDE_STEP = 1e-2


@dataclass(frozen=True)
class Optimum:
    """The minimum of the deviance, with the evidence for it.

    `distance` is the gain that the last quadratic still predicts, `curved` its second derivatives in the parameters,
    `evaluations` the number of evaluations of the deviance.
    """

    parameters: Parameters
    free: Floats
    deviance: float
    distance: float
    slope: float
    curved: Floats
    evaluations: int


class Counted:
    """A deviance of factors that counts its evaluations."""

    def __init__(self, function: Callable[[list[Floats]], float]) -> None:
        self.function = function
        self.evaluations = 0

    def at(self, factors: list[Floats]) -> float:
        """Return the deviance of these factors."""
        self.evaluations += 1
        return self.function(factors)

    def of(self, parameters: Parameters) -> Scalar:
        """Return the deviance as a function of these parameters."""

        def value(free: Floats) -> float:
            return self.at(parameters.factors(free))

        return value


def find_optimum(counted: Counted, parameters: Parameters) -> Optimum:
    """Return the minimum of the deviance, not a saddle, to the last digit, with zero variances set to zero.

    Raises NotConverged where no start leads to a proved minimum.
    """
    # The best of `SIZES` for each effect in turn, twice.
    sizes = np.ones(sum(term.size for term in parameters.random))
    for _ in range(2):
        for i in range(len(sizes)):
            tried = [np.where(np.arange(len(sizes)) == i, size, sizes) for size in SIZES]
            sizes = min(tried, key=lambda candidate: counted.at(parameters.diagonal(candidate)))
    starts = (np.maximum(sizes, 0.1), np.maximum(0.4 * sizes, 0.4))
    results = [_descended(counted, parameters, parameters.diagonal(start)) for start in starts]
    best = results[0] if results[0][0] <= results[1][0] + 1e-6 else results[1]
    near = parameters.around(best[1])
    snapped = _snapped(counted, near, _polished(counted, near, best[1]))
    parameters = near.around(snapped)
    value, free = counted.of(parameters), parameters.free_of(snapped)
    slope, curved = gradient(value, free), hessian(value, free)
    _, distance, lowest = _newton(slope, curved)
    values, steepest = np.linalg.eigvalsh(curved), float(np.abs(slope).max())
    if lowest is not None or distance > CONVERGED or steepest > 1e-3 * max(1.0, float(values.max())):
        raise NotConverged(
            f"the likelihood's maximum was not reached: a step still promises {distance:.2g} in deviance, the slope is "
            f"{steepest:.2g}, the smallest curvature {values.min():.2g}; take random slopes out or rescale the outcome"
        )
    return Optimum(parameters, free, value(free), distance, steepest, curved, counted.evaluations)


def _descended(counted: Counted, parameters: Parameters, factors: list[Floats]) -> tuple[float, list[Floats]]:
    """Descend by BFGS, repeatedly in the units of the latest point until there is no progress."""
    last = np.inf
    for _ in range(8):
        units = parameters.around(factors)
        value = counted.of(units)
        start, options = units.free_of(factors), {"gtol": 1e-5}
        result = minimize(value, start, jac=lambda x, f=value: rough_gradient(f, x), method="BFGS", options=options)
        factors = units.factors(np.asarray(result.x))
        if last - result.fun < NO_FURTHER:
            break
        last = float(result.fun)
    return float(result.fun), factors


def _polished(counted: Counted, parameters: Parameters, factors: list[Floats]) -> list[Floats]:
    """Take Newton steps until they predict no further gain; from a saddle descend again.

    Second derivatives and units are computed again only when the steps stop getting much shorter.
    """
    last, anew = np.inf, True
    for _ in range(30):
        if anew:
            parameters = parameters.around(factors)
            value, free = counted.of(parameters), parameters.free_of(factors)
            curved = hessian(value, free)
        step, distance, lowest = _newton(gradient(value, free), curved)
        if lowest is not None:
            tried = [free + size * lowest for size in (-1.0, -0.3, -0.1, -0.03, 0.03, 0.1, 0.3, 1.0)]
            factors = _descended(counted, parameters, parameters.factors(min(tried, key=value)))[1]
            last, anew = np.inf, True
            continue
        slow = distance > 0.1 * last
        # The longest of the halved steps that does not raise the deviance, none if all do.
        here, moved = value(free), None
        noise = 1e-13 * abs(here) + 1e-12
        for halving in range(12):
            further = free + step * 0.5**halving
            if value(further) <= here + noise:
                moved = further
                break
        if moved is None or (slow and distance < FINE):
            break
        free, last, anew = moved, distance, slow
        factors = parameters.factors(free)
    return factors


def _newton(slope: Floats, curved: Floats) -> tuple[Floats, float, Floats | None]:
    """Return the step to the quadratic's minimum, its predicted gain, and a direction of descent if it has none."""
    values, vectors = np.linalg.eigh(curved)
    largest = max(float(np.abs(values).max()), 1e-300)
    if values[0] < -1e-5 * largest:
        return np.zeros_like(slope), np.inf, vectors[:, 0]
    firm = values > FLAT * largest
    along = vectors[:, firm].T @ slope
    return -vectors[:, firm] @ (along / values[firm]), float(0.5 * (along**2 / values[firm]).sum()), None


def _snapped(counted: Counted, parameters: Parameters, factors: list[Floats]) -> list[Floats]:
    """Return the factors with every direction of no variance set to exactly zero, where that costs nothing."""
    terms = zip(parameters.random, factors, strict=True)
    factors = [triangular(f) if t.correlated else np.abs(f) for t, f in terms]
    for i, (term, unit) in enumerate(zip(parameters.random, parameters.natural, strict=True)):
        u, s, _ = np.linalg.svd(factors[i] / unit[:, None])
        for place in np.flatnonzero(s < NEAR_ZERO).tolist():
            remaining = np.where(np.arange(term.size) < place, s, 0.0)
            if term.correlated:
                rebuilt = unit[:, None] * triangular(u * remaining)
            else:  # without the effects of at most this size
                rebuilt = np.where(factors[i] / unit[:, None] <= s[place], 0.0, factors[i])
            tried = [rebuilt if j == i else factor for j, factor in enumerate(factors)]
            if counted.at(tried) <= counted.at(factors) + SAME:
                factors = tried
                break
    return factors


@dataclass(frozen=True)
class Parameters:
    """The mapping from parameters to factors: `natural` are the sizes at which effects begin to matter, by term."""

    random: tuple[Random, ...]
    natural: tuple[Floats, ...]
    units: tuple[Floats, ...]

    @property
    def free(self) -> int:
        """The number of parameters."""
        return sum(term.free for term in self.random)

    def factors(self, free: Floats) -> list[Floats]:
        """Return Lambda of each term."""
        factors, start = [], 0
        for term, unit in zip(self.random, self.units, strict=True):
            factor = np.zeros((term.size, term.size))
            factor[_places(term)] = free[start : start + term.free]
            factors.append(unit @ factor)
            start += term.free
        return factors

    def free_of(self, factors: Sequence[Floats]) -> Floats:
        """Return the parameters of these lower triangles."""
        parts = zip(self.random, self.units, factors, strict=True)
        return np.concatenate([np.linalg.solve(unit, factor)[_places(term)] for term, unit, factor in parts])

    def diagonal(self, sizes: Floats) -> list[Floats]:
        """Return factors of uncorrelated effects of these sizes, in natural units, in the order of all effects."""
        ends = np.cumsum([term.size for term in self.random])[:-1]
        return [np.diag(unit * size) for unit, size in zip(self.natural, np.split(sizes, ends), strict=True)]

    def around(self, factors: Sequence[Floats]) -> Parameters:
        """Return these parameters in units in which the deviance has equal curvature in all directions near the
        factors.

        The deviance depends on the change of Lambda relative to Lambda itself, or to the natural unit if that is
        larger: the new unit U has U U' = Lambda Lambda' + natural^2.
        """
        units = []
        for term, unit, factor in zip(self.random, self.natural, factors, strict=True):
            both = triangular(np.concatenate([factor, np.diag(unit)], axis=1))
            units.append(both if term.correlated else np.diag(np.diag(both)))
        return Parameters(self.random, self.natural, tuple(units))


def _places(term: Random) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]:
    return np.tril_indices(term.size) if term.correlated else (np.arange(term.size), np.arange(term.size))


def natural_parameters(problem: Problem) -> Parameters:
    """Return the units at which an effect's variance has as much weight in a level's estimate as the residual."""
    units = []
    for term in problem.random:
        squares = np.zeros(term.size)
        for start in range(0, len(problem.y), 65536):
            rows = slice(start, min(start + 65536, len(problem.y)))
            squares += (term.design.columns(rows, rows.stop - start) ** 2).sum(axis=0)
        units.append(np.sqrt(len(term.levels) / squares))
    return Parameters(problem.random, tuple(units), tuple(map(np.diag, units)))


def triangular(root: Floats) -> Floats:
    """Return the lower triangle with the same product with its transpose and a nonnegative diagonal."""
    lower = triangle_of(root.T).T
    signs = np.where(np.diag(lower) < 0, -1.0, 1.0)
    flipped: Floats = lower * signs
    return flipped


def jacobian(function: Vector, at: Floats, step: float = STEP) -> Floats:
    """Return the derivatives of a vector function, (parameters, values)."""
    rows = []
    for move in np.eye(len(at)) * step:
        near, far = (function(at + k * move) - function(at - k * move) for k in (1, 2))
        rows.append((8 * near - far) / (12 * step))
    return np.array(rows)


def gradient(function: Scalar, at: Floats, step: float = STEP) -> Floats:
    """Return the derivatives of a function."""
    derivatives: Floats = jacobian(lambda x: np.array([function(x)]), at, step)[:, 0]
    return derivatives


def rough_gradient(function: Scalar, at: Floats, step: float = 1e-4) -> Floats:
    """Return the derivatives of a function by simple central differences, for the way to the optimum."""
    moves = np.eye(len(at)) * step
    return np.array([(function(at + move) - function(at - move)) / (2 * step) for move in moves])


def hessian(function: Scalar, at: Floats, step: float = WIDE_STEP) -> Floats:
    """Return the second derivatives of a function, (parameters, parameters)."""
    k, middle, moves = len(at), function(at), np.eye(len(at)) * step
    result = np.empty((k, k))
    for i in range(k):
        near, far = (function(at + m * moves[i]) - 2 * middle + function(at - m * moves[i]) for m in (1, 2))
        result[i, i] = (16 * near - far) / (12 * step**2)
        for j in range(i):
            near, far = (_crossed(function, at, m * moves[i], m * moves[j]) for m in (1, 2))
            result[i, j] = result[j, i] = (16 * near - far) / (48 * step**2)
    return result


def _crossed(function: Scalar, at: Floats, a: Floats, b: Floats) -> float:
    return function(at + a + b) - function(at + a - b) - function(at - a + b) + function(at - a - b)
