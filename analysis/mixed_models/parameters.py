"""The free numbers of the relative covariance factors, scaled so that each is about one where it matters.

Lambda of a term is a lower triangle (its `units`) times a lower triangle of free numbers (correlated), or the same with
diagonals (not). The signs of the diagonal are free: a column's sign changes no covariance, so that a variance of zero
is no border of the search but a point where the deviance is level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.analysis.mixed_models.grouping import Random
from palpate.analysis.mixed_models.linear import triangle_of
from palpate.analysis.mixed_models.problem import Problem
from palpate.analysis.statistics.doubles import Floats


@dataclass(frozen=True)
class Parameters:
    """How free numbers make factors: `natural` are the sizes at which effects begin to matter, one array per term."""

    random: tuple[Random, ...]
    natural: tuple[Floats, ...]
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
            made.append(unit @ factor)
            start += term.free
        return made

    def free_of(self, factors: Sequence[Floats]) -> Floats:
        """The free numbers that make these lower triangles."""
        parts = zip(self.random, self.units, factors, strict=True)
        return np.concatenate([np.linalg.solve(unit, factor)[_places(term)] for term, unit, factor in parts])

    def diagonal(self, sizes: Floats) -> list[Floats]:
        """Factors of uncorrelated effects of these sizes, in natural units, in the order of all effects."""
        ends = np.cumsum([term.size for term in self.random])[:-1]
        return [np.diag(unit * size) for unit, size in zip(self.natural, np.split(sizes, ends), strict=True)]

    def around(self, factors: Sequence[Floats]) -> Parameters:
        """In units in which the deviance bends alike in every direction near these factors.

        It answers to a change of Lambda relative to Lambda itself, or to the natural unit where that is larger: the new
        unit U has U U' = Lambda Lambda' + natural^2.
        """
        units = []
        for term, unit, factor in zip(self.random, self.natural, factors, strict=True):
            both = triangular(np.concatenate([factor, np.diag(unit)], axis=1))
            units.append(both if term.correlated else np.diag(np.diag(both)))
        return Parameters(self.random, self.natural, tuple(units))


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
    return Parameters(problem.random, tuple(units), tuple(map(np.diag, units)))


def triangular(root: Floats) -> Floats:
    """The lower triangle with the same product with its transpose and no negative number on its diagonal."""
    lower = triangle_of(root.T).T
    signs = np.where(np.diag(lower) < 0, -1.0, 1.0)
    flipped: Floats = lower * signs
    return flipped
