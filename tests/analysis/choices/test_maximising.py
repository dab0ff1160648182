"""Fits of psychometric functions end at the highest likelihood that they reached."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import expit

from palpate.analysis.choices import maximising
from palpate.analysis.choices.maximising import ROUNDING, Problem, best_of_starts, likelihoods, log_shares
from palpate.analysis.choices.specification import Levels, function_spec, problem_of, rates_of
from palpate.analysis.statistics.doubles import Floats

LEVELS = np.linspace(1.0, 9.0, 5)


def problem(hits: Floats, trials: int, function: str, alternatives: int = 3) -> Problem:
    """Return the fits to `hits` (fits, levels) of a forced choice."""
    spec = function_spec(function, rates_of("forced_choice", alternatives, None, None), 0.5, "x84_x50", False)
    return problem_of(Levels(LEVELS, hits[0], np.full(len(LEVELS), float(trials))), spec, hits)


@pytest.mark.parametrize("function", ["logistic", "gaussian", "weibull"])
def test_no_fit_ends_below_a_likelihood_that_it_reached(function: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In flat regions, where the gain of a step is predicted to be nil, steps lost up to 200 of log likelihood."""
    trials, rng = 8, np.random.default_rng(7)
    reached: list[float] = []

    def spy(fits: Problem, place: Floats) -> Floats:
        values = likelihoods(fits, place)
        reached.append(float(values.max(initial=-np.inf)))
        return values

    monkeypatch.setattr(maximising, "likelihoods", spy)
    share = 1 / 3 + 0.62 * expit((LEVELS - 4) / 0.5)
    for hits in rng.binomial(trials, share, (30, len(LEVELS))).astype(float):
        reached.clear()
        fit = best_of_starts(problem(hits[None], trials, function))
        assert fit.log_likelihood[0] >= max(reached) - ROUNDING * abs(max(reached))


def test_a_fit_is_the_highest_of_several_maxima() -> None:
    """A second maximum of the likelihood lies 0.36 below the first; the expected one is that of a fine grid."""
    hits = np.array([[11.0, 12, 18, 15, 20]])
    own = problem(hits, 20, "logistic", 2)
    mesh = np.meshgrid(
        np.linspace(-0.5, 1.5, 161) * own.t[-1], np.log(np.geomspace(0.005, 2, 60) * own.t[-1]), 0.5,
        np.linspace(0, 0.25, 26), indexing="ij",
    )  # fmt: skip
    hit, miss = log_shares(own, np.column_stack([axis.ravel() for axis in mesh]))
    grid = (hits @ hit.T + (20 - hits) @ miss.T).max()
    assert grid <= best_of_starts(own).log_likelihood[0] <= grid + 0.01
