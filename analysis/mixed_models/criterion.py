"""The profiled deviance at given relative covariance factors: Bates, Mächler, Bolker & Walker 2015, section 3.

A term's relative covariance factor Lambda has the covariance of a level's effects as sigma^2 Lambda Lambda'. Blocks
are whitened by the triangle L with L L' = I + R Lambda Lambda' R', the rest is one penalised triangle. No matrix is
ever squared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.analysis.mixed_models.linear import triangle_of
from palpate.analysis.mixed_models.problem import Problem
from palpate.analysis.mixed_models.reducing import Batch, Reduced, outside, outside_width
from palpate.analysis.statistics.doubles import Floats

NOTHING = 2.0**-1000  # stands for a residual of zero, which has no logarithm


@dataclass(frozen=True)
class Solved:
    """The penalised least-squares problem at one point.

    `log_det` is log|L|^2 of the random effects, `triangle` the triangle of the columns outside, fixed and y, `rss` the
    penalised residual sum of squares.
    """

    log_det: float
    triangle: Floats
    width: int
    rss: float

    @property
    def fixed_triangle(self) -> Floats:
        """R_X, with X' V^-1 X = R_X' R_X / sigma^2."""
        return self.triangle[self.width : -1, self.width : -1]

    @property
    def coefficients(self) -> Floats:
        """The internal fixed effects."""
        return np.asarray(np.linalg.solve(self.fixed_triangle, self.triangle[self.width : -1, -1]))

    @property
    def log_det_fixed(self) -> float:
        """log|R_X|^2."""
        return 2 * float(np.log(np.abs(np.diag(self.fixed_triangle))).sum())

    def covariance(self) -> Floats:
        """(X' V^-1 X)^-1 / sigma^2."""
        inverse = np.linalg.inv(self.fixed_triangle)
        product: Floats = inverse @ inverse.T
        return product


def solved(problem: Problem, parts: Reduced, factors: Sequence[Floats]) -> Solved:
    """Solve at these relative covariance factors, one per random term."""
    inside = block_factor(problem, factors)
    log_det, rows = 0.0, [parts.corner]
    for batch in parts.compressed:
        lower = whitening(batch, inside)
        log_det += 2 * float(batch.shared @ np.log(np.abs(np.diagonal(lower, axis1=1, axis2=2))).sum(axis=1))
        rows.append(whitened(lower[batch.which], batch.seen).reshape(-1, batch.seen.shape[2]))
    width = outside_width(problem)
    whole = np.concatenate(rows)
    triangle = triangle_of(_penalised(problem, whole, factors) if width else whole)
    log_det += 2 * float(np.log(np.abs(np.diag(triangle)[:width])).sum())
    return Solved(log_det, triangle, width, max(float(triangle[-1, -1] ** 2), NOTHING))


def block_factor(problem: Problem, factors: Sequence[Floats]) -> Floats:
    """The relative covariance factor of all random effects of a block, (width, width)."""
    whole = np.zeros((problem.layout.width,) * 2)
    for block in problem.layout.inside:
        factor = factors[block.term]
        for start in range(block.start, block.start + block.count * len(factor), len(factor)):
            whole[start : start + len(factor), start : start + len(factor)] = factor
    return whole


def whitening(batch: Batch, inside: Floats) -> Floats:
    """The triangles L of a batch's different R, (unique, r, r)."""
    scaled = batch.through @ inside
    unique, rank, width = scaled.shape
    if rank == 1:
        lower: Floats = np.sqrt(1 + (scaled * scaled).sum(axis=2, keepdims=True))
        return lower
    stacked = np.zeros((unique, width + rank, rank))
    stacked[:, :width] = scaled.transpose(0, 2, 1)
    stacked[:, width:] = np.eye(rank)
    return triangle_of(stacked).transpose(0, 2, 1)


def whitened(lower: Floats, seen: Floats) -> Floats:
    """L^-1 times what is seen, by forward substitution."""
    result = np.empty_like(seen)
    for i in range(seen.shape[1]):
        known = np.einsum("bj,bjc->bc", lower[:, i, :i], result[:, :i])
        result[:, i] = (seen[:, i] - known) / lower[:, i, i, None]
    return result


def _penalised(problem: Problem, whole: Floats, factors: Sequence[Floats]) -> Floats:
    """The rows with the columns outside times their factors, above the rows of their penalty."""
    width = outside_width(problem)
    scaled = np.zeros((len(whole) + width, whole.shape[1]))
    scaled[: len(whole), width:] = whole[:, width:]
    scaled[len(whole) :, :width] = np.eye(width)
    for i, (term, start) in zip(problem.layout.outside, outside(problem), strict=True):
        stop = start + len(term.levels) * term.size
        levels = whole[:, start:stop].reshape(-1, term.size) @ factors[i]
        scaled[: len(whole), start:stop] = levels.reshape(len(whole), -1)
    return scaled


def deviance(problem: Problem, found: Solved, reml: bool) -> float:
    """Minus twice the log likelihood (restricted, if asked) at its best sigma, in internal coordinates."""
    degrees = degrees_of_freedom(problem, reml)
    extra = found.log_det_fixed if reml else 0.0
    return found.log_det + extra + degrees * (1 + math.log(2 * math.pi * found.rss / degrees))


def degrees_of_freedom(problem: Problem, reml: bool) -> int:
    """n, or n - p of the restricted likelihood."""
    return len(problem.y) - (problem.columns if reml else 0)
