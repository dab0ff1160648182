"""The smallest deviance: found from several starts, then proved by gradient and second derivatives, or refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from analysis.mixed_models.derivatives import Scalar, gradient, hessian, rough_gradient
from analysis.mixed_models.grouping import Random
from analysis.mixed_models.parameters import Parameters, triangular
from analysis.mixed_models.refusals import NotConverged
from analysis.statistics.doubles import Floats

SIZES = (0.0, *(10.0**k for k in range(-2, 16)))
"""Sizes of an effect, in natural units, that are tried first: up to 1e15 times the residual."""
FLAT = 1e-10  # a curvature below this share of the largest counts as none
CONVERGED = 1e-9  # how far, in deviance, the optimum may still be by its own quadratic
FINE = 1e-12  # from here on rounding decides when no step helps any more
SAME = 1e-9  # a variance is zero if setting it to zero costs no more deviance than this
NEAR_ZERO = 0.05


@dataclass(frozen=True)
class Optimum:
    """Where the deviance is smallest, with the evidence that it is.

    `distance` is the deviance that the last quadratic still promises, `curved` its second derivatives in the free
    numbers, `evaluations` how often the deviance was computed.
    """

    parameters: Parameters
    free: Floats
    deviance: float
    distance: float
    slope: float
    curved: Floats
    evaluations: int


class Counted:
    """A deviance of factors that counts how often it is asked."""

    def __init__(self, function: Callable[[list[Floats]], float]) -> None:
        self.function = function
        self.evaluations = 0

    def of(self, parameters: Parameters) -> Scalar:
        """The deviance as a function of these parameters' free numbers."""

        def value(free: Floats) -> float:
            self.evaluations += 1
            return self.function(parameters.factors(free))

        return value


def optimum(counted: Counted, parameters: Parameters) -> Optimum:
    """The smallest deviance. Raises NotConverged where no start leads to a point that is proved to be one."""
    sizes = _scanned(counted, parameters)
    scanned = parameters.rescaled(np.maximum(sizes, 1.0))
    best: tuple[float, list[Floats]] | None = None
    for start in _starts(scanned, np.where(sizes > 1.0, 1.0, np.maximum(sizes, 0.1))):
        value, free, units = _descended(counted, scanned, start)
        if best is None or value < best[0] - 1e-6:
            best = value, units.factors(free)
    if best is None:
        raise NotConverged("no start was tried")
    # The deviance bends on the scale of an effect's own part of Lambda (its diagonal), or of the natural unit where
    # that is larger: steps are set by it.
    own = [np.diag(np.abs(np.diag(factor))) for factor in best[1]]
    fitting = parameters.rescaled(np.maximum(_effect_sizes(parameters, own), 1.0))
    return _proved(counted, fitting, fitting.free_of(best[1]))


def _starts(parameters: Parameters, sizes: Floats) -> Iterator[Floats]:
    yield parameters.diagonal(sizes)
    yield parameters.diagonal(np.full_like(sizes, 0.4))


def _scanned(counted: Counted, parameters: Parameters) -> Floats:
    """The best of `SIZES` for each effect in turn, twice."""
    value = counted.of(parameters)
    sizes = np.ones(sum(term.size for term in parameters.random))
    for _ in range(2):
        for i in range(len(sizes)):
            tried = [np.where(np.arange(len(sizes)) == i, size, sizes) for size in SIZES]
            sizes = min(tried, key=lambda each: value(parameters.diagonal(each)))
    return sizes


def _descended(counted: Counted, parameters: Parameters, start: Floats) -> tuple[float, Floats, Parameters]:
    """Down to the bottom by BFGS, starting anew in better units where they turn out to be far off."""
    for _ in range(4):
        value = counted.of(parameters)
        found = minimize(
            value, start, jac=lambda x, f=value: rough_gradient(f, x), method="BFGS", options={"gtol": 1e-5}
        )
        sizes = _effect_sizes(parameters, parameters.factors(found.x))
        if sizes.max() < 30:
            break
        factors = parameters.factors(found.x)
        parameters = parameters.rescaled(np.maximum(sizes, 1.0))
        start = parameters.free_of(factors)
    return float(found.fun), np.asarray(found.x), parameters


def _effect_sizes(parameters: Parameters, factors: Sequence[Floats]) -> Floats:
    """How large each effect is, in units."""
    parts = zip(factors, parameters.units, strict=True)
    return np.concatenate([np.sqrt(((factor / unit[:, None]) ** 2).sum(axis=1)) for factor, unit in parts])


def _proved(counted: Counted, parameters: Parameters, free: Floats) -> Optimum:
    """Away from saddles and down to the last digit; then variances of nothing are set to zero, and all is checked."""
    free = _polished(counted, parameters, free)
    snapped = _snapped(counted, parameters, free)
    value = counted.of(parameters)
    slope, curved = gradient(value, snapped), hessian(value, snapped)
    _, distance, lowest = _newton(slope, curved)
    values, steepest = np.linalg.eigvalsh(curved), float(np.abs(slope).max())
    if lowest is not None or distance > CONVERGED or steepest > 1e-3 * max(1.0, float(values.max())):
        raise NotConverged(
            f"the likelihood's maximum was not reached: a step still promises {distance:.2g} in deviance, the slope is "
            f"{steepest:.2g}, the smallest curvature {values.min():.2g}; take random slopes out or rescale the outcome"
        )
    return Optimum(parameters, snapped, value(snapped), distance, steepest, curved, counted.evaluations)


def _polished(counted: Counted, parameters: Parameters, free: Floats) -> Floats:
    """Newton's steps until they promise nothing more; from a saddle down again.

    Second derivatives are taken anew only where the steps stop getting much shorter.
    """
    value, last = counted.of(parameters), np.inf
    curved = hessian(value, free)
    for _ in range(30):
        step, distance, lowest = _newton(gradient(value, free), curved)
        if lowest is not None:
            free = _descended(counted, parameters, _off_the_saddle(value, free, lowest))[1]
            curved, last = hessian(value, free), np.inf
            continue
        slow = distance > 0.1 * last
        moved = _line_search(value, free, step)
        if moved is None or (slow and distance < FINE):
            break
        free, last = moved, distance
        if slow:
            curved = hessian(value, free)
    return free


def _newton(slope: Floats, curved: Floats) -> tuple[Floats, float, Floats | None]:
    """The step to the quadratic's bottom, the deviance it promises, and a direction of descent where it has none."""
    values, vectors = np.linalg.eigh(curved)
    largest = max(float(np.abs(values).max()), 1e-300)
    if values[0] < -1e-5 * largest:
        return np.zeros_like(slope), np.inf, vectors[:, 0]
    firm = values > FLAT * largest
    along = vectors[:, firm].T @ slope
    return -vectors[:, firm] @ (along / values[firm]), float(0.5 * (along**2 / values[firm]).sum()), None


def _line_search(value: Scalar, free: Floats, step: Floats) -> Floats | None:
    """The longest of the halved steps that does not raise the deviance, None if all do."""
    here = value(free)
    noise = 1e-13 * abs(here) + 1e-12
    for halving in range(12):
        moved = free + step * 0.5**halving
        if value(moved) <= here + noise:
            return moved
    return None


def _off_the_saddle(value: Scalar, free: Floats, along: Floats) -> Floats:
    tried = [free + size * along for size in (-1.0, -0.3, -0.1, -0.03, 0.03, 0.1, 0.3, 1.0)]
    return min(tried, key=value)


def _snapped(counted: Counted, parameters: Parameters, free: Floats) -> Floats:
    """The free numbers with every direction of no variance set to exactly none, where that costs nothing."""
    value = counted.of(parameters)
    factors = [triangular(f) if t.correlated else np.abs(f) for t, f in _terms(parameters, free)]
    free = parameters.free_of(factors)
    for i, (term, unit) in enumerate(zip(parameters.random, parameters.units, strict=True)):
        u, s, _ = np.linalg.svd(factors[i] / unit[:, None])
        for place in np.flatnonzero(s < NEAR_ZERO).tolist():
            reduced = np.where(np.arange(term.size) < place, s, 0.0)
            tried = [*factors]
            tried[i] = _rebuilt(factors[i], unit, u, reduced, term.correlated, float(s[place]))
            here = parameters.free_of(tried)
            if value(here) <= value(free) + SAME:
                factors, free = tried, here
                break
    return free


def _rebuilt(factor: Floats, unit: Floats, u: Floats, s: Floats, correlated: bool, largest: float) -> Floats:
    if correlated:
        rebuilt: Floats = unit[:, None] * triangular(u * s)
        return rebuilt
    return np.where(factor / unit[:, None] <= largest, 0.0, factor)


def _terms(parameters: Parameters, free: Floats) -> Iterator[tuple[Random, Floats]]:
    yield from zip(parameters.random, parameters.factors(free), strict=True)
