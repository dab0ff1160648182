"""The similarity of two configurations of the same objects, regardless of position, orientation and size."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, permutations
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.random import Generator

from palpate.analysis.spaces.matrices import Matrix, centred, frame_of, matrix_of, varies
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_draws, p_of_draws, stream
from palpate.analysis.statistics.refusals import BadValue, IncompleteCells, TooFew, listed, refuse_idle

BATCH = 500
NEAR = 1e-12


@dataclass(frozen=True)
class Procrustes:
    """The result: `fitted` is the second configuration on the first, with points stretch x other @ turn + shift.

    `r` and `m2` = 1 - r squared compare the two at unit size, symmetrically; `squares` is the sum of squared distances
    between target and fitted points, `residuals` each object's distance. `p` is of the permutation test (NaN if none
    was requested), `exact` whether it used every permutation.
    """

    fitted: pd.DataFrame
    turn: Floats
    stretch: float
    shift: tuple[float, ...]
    r: float
    m2: float
    squares: float
    residuals: pd.Series
    reflection: bool
    p: float
    draws: int
    exact: bool


def procrustes(
    target: pd.DataFrame,
    other: pd.DataFrame,
    scale: bool = True,
    reflection: bool = True,
    draws: int | None = None,
    seed: int = 0,
) -> Procrustes:
    """Fit `other` to `target` (objects x dimensions, matched by label; the one with fewer gets empty dimensions).

    With `draws`, a permutation test of r: the objects of one configuration are shuffled, in all ways if there are at
    most `draws`. Raises IncompleteCells for objects in one configuration only, TooFew for fewer than three, BadValue
    for a configuration that is a single point. Sources: Gower 1975; test: Jackson 1995 (PROTEST).
    """
    if draws is None:
        refuse_idle("seed", seed, 0, "without `draws`: nothing is shuffled")
    first, second = _matched(matrix_of(target), matrix_of(other))
    fit = align(first.values, second.values, scale, reflection)
    one, two = normed(centred(first.values)), normed(centred(second.values))
    r = min(1.0, float(correlations(one, two, reflection)))
    p, done, exact = math.nan, 0, False
    if draws is not None:
        check_draws(draws)
        # p, how many permutations it rests on, and whether these are all there are.
        rng = stream(seed, "procrustes")
        objects = len(one)
        every = objects <= 12 and math.factorial(objects) <= draws
        total = math.factorial(objects) if every else draws
        reached = 0
        for orders in _orders(objects, total, rng, every):
            reached += int((correlations(one, two[orders], reflection) >= r * (1 - NEAR)).sum())
        p, done, exact = (reached / total if every else p_of_draws(reached, total)), total, every
    stretch = float(fit.scale)
    shift = first.values.mean(axis=0) - stretch * (second.values.mean(axis=0) @ fit.turn)
    apart = first.values - fit.points
    return Procrustes(
        frame_of(fit.points, first.rows, first.columns),
        fit.turn,
        stretch,
        tuple(shift.tolist()),
        r,
        1 - r * r,
        float((apart * apart).sum()),
        pd.Series(np.sqrt((apart * apart).sum(axis=1)), index=pd.Index(list(first.rows))),
        bool(np.linalg.det(fit.turn) < 0),
        p,
        done,
        exact,
    )


def _matched(first: Matrix, second: Matrix) -> tuple[Matrix, Matrix]:
    lonely = set(first.rows) ^ set(second.rows)
    if lonely:
        names = listed(sorted(map(repr, lonely)), len(lonely))
        raise IncompleteCells(f"only one of the configurations holds {names}; compare the objects of both")
    if len(first.rows) < 3:
        raise TooFew(f"{len(first.rows)} objects; comparing configurations needs three or more")
    for which, matrix in (("first", first), ("second", second)):
        if not varies(matrix.values).any():
            raise BadValue(f"all points of the {which} configuration are in one place; it cannot be compared")
    width = max(first.values.shape[1], second.values.shape[1])
    named = first if first.values.shape[1] == width else second
    return _widened(first, width, named), _widened(second, width, named)


def _widened(matrix: Matrix, width: int, named: Matrix) -> Matrix:
    missing = width - matrix.values.shape[1]
    return Matrix(np.pad(matrix.values, ((0, 0), (0, missing))), matrix.rows, named.columns)


def _orders(objects: int, total: int, rng: Generator, every: bool) -> Iterator[Floats]:
    if every:
        ways = permutations(range(objects))
        while block := list(islice(ways, BATCH)):
            yield np.array(block)
        return
    for done in range(0, total, BATCH):
        size = min(BATCH, total - done)
        yield rng.permuted(np.broadcast_to(np.arange(objects), (size, objects)), axis=1)


class Aligned(NamedTuple):
    """Fits: `points` (..., objects, dimensions), `turn` (..., dimensions, dimensions), `scale` (...)."""

    points: Floats
    turn: Floats
    scale: Floats
    trace: Floats


def align(target: Floats, others: Floats, scale: bool = True, reflection: bool = True) -> Aligned:
    """Fit each configuration to the target by least squares (both about their centroids, moved to the target's).

    `trace` is the sum of the (signed) singular values of their cross products: the correlation r for configurations of
    unit size. Sources: Schoenemann 1966; Gower 1975; without reflection Umeyama 1991.
    """
    centre = target.mean(axis=0)
    goal = target - centre
    about = others - others.mean(axis=-2, keepdims=True)
    cross = np.swapaxes(about, -1, -2) @ goal
    left, sizes, right = np.linalg.svd(cross)
    if not reflection:
        flip = np.sign(np.linalg.det(left) * np.linalg.det(right))
        sizes = np.concatenate((sizes[..., :-1], sizes[..., -1:] * flip[..., None]), axis=-1)
        left = np.concatenate((left[..., :, :-1], left[..., :, -1:] * flip[..., None, None]), axis=-1)
    turn = left @ right
    trace = sizes.sum(axis=-1)
    size = (about * about).sum(axis=(-1, -2))
    stretch = np.divide(trace, size, out=np.ones_like(trace), where=size > 0) if scale else np.ones_like(trace)
    return Aligned(stretch[..., None, None] * (about @ turn) + centre, turn, stretch, trace)


def correlations(target: Floats, others: Floats, reflection: bool = True) -> Floats:
    """Return the Procrustes correlation of each configuration with the target, all centred and of unit size."""
    cross = np.swapaxes(others, -1, -2) @ target
    if reflection:
        result: Floats = np.linalg.svd(cross, compute_uv=False).sum(axis=-1)
        return result
    sizes = np.linalg.svd(cross, compute_uv=False)
    flip = np.sign(np.linalg.det(cross))
    signed: Floats = sizes[..., :-1].sum(axis=-1) + sizes[..., -1] * np.where(flip < 0, -1.0, 1.0)
    return signed


def normed(points: Floats) -> Floats:
    """Return a configuration about its centroid, with a sum of squares of 1."""
    about = points - points.mean(axis=-2, keepdims=True)
    size = np.sqrt((about * about).sum(axis=(-1, -2), keepdims=True))
    result: Floats = about / size
    return result
