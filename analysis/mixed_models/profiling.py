"""Profile-likelihood intervals of standard deviations: Bates et al. 2015, section 5.1.

The deviance at a given standard deviation, smallest over everything else, rises from its minimum; the interval holds
the values at which it rises by less than the chi squared quantile. As in lme4, the likelihood is never the restricted
one, even for fits by REML. With sd_i = sigma times the norm of row i of Lambda, a given sd_i fixes sigma.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd
from scipy.optimize import brentq, minimize
from scipy.special import gammaincinv

from palpate.analysis.mixed_models.model import MixedModel
from palpate.analysis.mixed_models.optimising import Counted, Optimum, find_optimum, natural_parameters, rough_gradient
from palpate.analysis.mixed_models.problem import Problem, Reduced, degrees_of_freedom, deviance, solve
from palpate.analysis.statistics.doubles import Floats, rescaled
from palpate.analysis.statistics.one_thread import one_thread
from palpate.analysis.statistics.refusals import BadOption, NotConverged

FURTHEST = 40  # doublings and halvings of a standard deviation that are tried
SMALLEST_SHARE = 1e-3  # of the size at which an effect weighs as much as the residual; less is none
LOG_2PI = math.log(2 * math.pi)
COLUMNS = ["group", "effect", "sd", "ci_low", "ci_high"]
Ratio: TypeAlias = Callable[[list[Floats]], float]


@dataclass(frozen=True)
class _Profile:
    """The deviance at a given standard deviation, in internal units.

    `ratio` is that standard deviation over sigma as a function of the factors, `term` its random term (None: sigma).
    """

    problem: Problem
    parts: Reduced
    best: Optimum
    ratio: Ratio
    term: int | None

    @property
    def factors(self) -> list[Floats]:
        """The factors at the optimum."""
        return self.best.parameters.factors(self.best.free)

    @property
    def sigma(self) -> float:
        """The residual's standard deviation at the optimum."""
        return math.sqrt(solve(self.problem, self.parts, self.factors).rss / len(self.problem.y))

    def rise(self, sd: float) -> float:
        """Return the rise of the smallest deviance at this standard deviation above the overall minimum."""

        def value(free: Floats) -> float:
            factors = self.best.parameters.factors(free)
            at = solve(self.problem, self.parts, factors)
            # In logarithms, so that neither a ratio of nearly nothing nor its square leaves the range of doubles.
            log_sigma = math.log(sd) - math.log(max(self.ratio(factors), 1e-150))
            n = len(self.problem.y)
            return at.log_det + n * (LOG_2PI + 2 * log_sigma) + math.exp(min(600, math.log(at.rss) - 2 * log_sigma))

        # The factors at the optimum, its own term's (or all, for sigma) scaled to reach this value.
        factors, sigma = self.factors, self.sigma
        if self.term is None:
            first_guess = [factor * (sigma / sd) for factor in factors]
        else:
            size = self.ratio(factors) * sigma
            unit = np.diag(self.best.parameters.natural[self.term])
            factors[self.term] = (
                factors[self.term] * (sd / size) if size > 0 else unit * (sd / sigma / self.ratio_of(unit))
            )
            first_guess = factors
        start = self.best.parameters.free_of(first_guess)
        options = {"gtol": 1e-6}
        result = minimize(value, start, jac=lambda x: rough_gradient(value, x), method="BFGS", options=options)
        return float(result.fun) - self.best.deviance

    def ratio_of(self, factor: Floats) -> float:
        """Return the ratio that follows from this factor."""
        others = [factor if i == self.term else other for i, other in enumerate(self.factors)]
        return self.ratio(others)


def profile_intervals(model: MixedModel, confidence: float = 0.95) -> pd.DataFrame:
    """Return intervals of the standard deviations of all random effects and the residual, in the outcome's unit.

    One row each: group, effect, sd (the maximum-likelihood estimate), ci_low, ci_high. A lower end of 0 means that a
    variance of zero is within the interval. Slow: every end is a nested search. Raises BadOption or NotConverged.
    """
    if not 0 < confidence < 1:
        raise BadOption(f"confidence={confidence} is not a share; give a number between 0 and 1, such as 0.95")
    allowed = 2 * float(gammaincinv(0.5, confidence))
    fit = model.fit
    with one_thread():
        problem, parts = fit.problem, fit.parts
        if degrees_of_freedom(problem, False) < 3:
            raise NotConverged("too few values for a profile")
        counted = Counted(lambda factors: deviance(problem, solve(problem, parts, factors), False))
        best = find_optimum(counted, natural_parameters(problem))
        rows = []
        for group, effect, ratio, term in _ratios(fit.problem):
            profile = _Profile(fit.problem, fit.parts, best, ratio, term)
            # A standard deviation so small that the data cannot distinguish it from none.
            unit = 1.0 if term is None else profile.ratio_of(np.diag(best.parameters.natural[term]))
            smallest = SMALLEST_SHARE * profile.sigma * unit
            sd = profile.sigma * ratio(profile.factors)
            low, high = _low(profile, sd, smallest, allowed), _high(profile, max(sd, smallest), allowed)
            sd, low, high = (rescaled(x, fit.y_exponent) for x in (sd, low, high))
            rows.append((group, effect, sd, low, high))
    return pd.DataFrame(rows, columns=COLUMNS)


def _low(profile: _Profile, sd: float, smallest: float, allowed: float) -> float:
    """Return the lower end, 0 if even a tiny standard deviation is within the interval."""
    above = sd
    while above > smallest:
        below = above / 2
        if profile.rise(below) > allowed:
            return _crossing(profile, below, above, allowed)
        above = below
    return 0.0


def _high(profile: _Profile, sd: float, allowed: float) -> float:
    """Return the upper end. Raises NotConverged if there is none within reach."""
    below = sd
    for _ in range(FURTHEST):
        above = below * 2
        if profile.rise(above) > allowed:
            return _crossing(profile, below, above, allowed)
        below = above
    raise NotConverged("a standard deviation has no upper limit within reach; the data say nothing of it")


def _crossing(profile: _Profile, low: float, high: float, allowed: float) -> float:
    def beyond(log_sd: float) -> float:
        return profile.rise(math.exp(log_sd)) - allowed

    return math.exp(float(brentq(beyond, math.log(low), math.log(high), xtol=1e-7)))


def _ratios(problem: Problem) -> Iterator[tuple[str, str, Ratio, int | None]]:
    """Yield every standard deviation's group, effect, ratio to sigma as a function of the factors, and term."""
    for i, term in enumerate(problem.random):
        for row, effect in zip(term.back, term.effects, strict=True):
            yield term.name, effect, _ratio(i, row), i
    yield "Residual", "", lambda _: 1.0, None


def _ratio(term: int, row: Floats) -> Ratio:
    return lambda factors: float(np.linalg.norm(row @ factors[term]))
