"""From a grid of starts to the best fit, for many sets of answers at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.analysis.choices.maximising import Fitted, Problem, likelihoods, maximised
from palpate.analysis.statistics.doubles import Floats


def best_of_starts(problem: Problem, starts: int) -> Fitted:
    """The best of the most promising points of a grid, each led uphill, for every fit."""
    grid = _grid(problem)
    fits, points = len(problem.hits), len(grid)
    each = _repeated(problem, points)
    values = likelihoods(each, np.tile(grid, (fits, 1))).reshape(fits, points)
    chosen = np.argsort(-values, axis=1, kind="stable")[:, :starts]
    found = maximised(_repeated(problem, starts), grid[chosen].reshape(-1, 4))
    best = np.argmax(found.log_likelihood.reshape(fits, starts), axis=1) + np.arange(fits) * starts
    return Fitted(*(part[best] for part in found))


def _repeated(problem: Problem, times: int) -> Problem:
    return replace(problem, hits=np.repeat(problem.hits, times, axis=0))


def _grid(problem: Problem) -> Floats:
    span = float(problem.t[-1])
    centres = np.linspace(-0.25, 1.25, 13) * span
    spreads = np.log(np.array([0.02, 0.06, 0.15, 0.4, 1.0]) * span)
    rates = [
        np.unique([low, low + (high - low) / 2]) for low, high in zip(problem.low[2:], problem.high[2:], strict=True)
    ]
    mesh = np.meshgrid(centres, spreads, *rates, indexing="ij")
    return np.column_stack([axis.ravel() for axis in mesh])
