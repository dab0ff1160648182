"""The free numbers of the relative covariance factors, scaled so that each is about one where it matters.

Lambda of a term is diag(unit) times a lower triangle of free numbers (correlated) or a diagonal (not). The signs of
the diagonal are free: a column's sign changes no covariance, so that a variance of zero is no border of the search but
a point where the deviance is level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.mixed_models.grouping import Random
from analysis.mixed_models.linear import triangle_of
from analysis.mixed_models.problem import Problem
from analysis.statistics.doubles import Floats


@dataclass(frozen=True)
class Parameters:
    """How free numbers make factors: `units` (one array per term) are the sizes of the effects."""

    random: tuple[Random, ...]
    units: tuple[Floats, ...]

    @property
    def free(self) -> int:
        """How many free numbers there are."""
        return sum(term.free for term in self.random)

    def factors(self, free: Floats) -> list[Floats]:
        """Lambda of each term."""
        made, start = [], 0
        for term, unit in zip(self.random, self.units, strict=True):
            factor = np.zeros((term.size, term.size))
            factor[_places(term)] = free[start : start + term.free]
            made.append(unit[:, None] * factor)
            start += term.free
        return made

    def free_of(self, factors: Sequence[Floats]) -> Floats:
        """The free numbers that make these lower triangles."""
        parts = zip(self.random, self.units, factors, strict=True)
        return np.concatenate([(factor / unit[:, None])[_places(term)] for term, unit, factor in parts])

    def diagonal(self, sizes: Floats) -> Floats:
        """The free numbers of uncorrelated effects of these sizes, in units, in the order of all effects."""
        made, start = [], 0
        for term in self.random:
            factor = np.diag(sizes[start : start + term.size])
            made.append(factor[_places(term)])
            start += term.size
        return np.concatenate(made)

    def rescaled(self, sizes: Floats) -> Parameters:
        """With units as many times larger as these sizes say, one for each effect."""
        ends = np.cumsum([term.size for term in self.random])[:-1]
        units = [u * s for u, s in zip(self.units, np.split(sizes, ends), strict=True)]
        return Parameters(self.random, tuple(units))


def _places(term: Random) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]:
    return np.tril_indices(term.size) if term.correlated else (np.arange(term.size), np.arange(term.size))


def natural(problem: Problem) -> Parameters:
    """Units at which an effect's variance weighs as much in a level's estimate as the residual does."""
    units = []
    for term in problem.random:
        squares = np.zeros(term.size)
        for start in range(0, len(problem.y), 65536):
            rows = slice(start, min(start + 65536, len(problem.y)))
            squares += (term.design.columns(rows, rows.stop - start) ** 2).sum(axis=0)
        units.append(np.sqrt(len(term.levels) / squares))
    return Parameters(problem.random, tuple(units))


def triangular(square: Floats) -> Floats:
    """The lower triangle with the same product with its transpose and no negative number on its diagonal."""
    lower = triangle_of(square.T).T
    signs = np.where(np.diag(lower) < 0, -1.0, 1.0)
    flipped: Floats = lower * signs
    return flipped
