"""Maximum likelihood of many psychometric functions at once: damped scoring within bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import xlogy

from analysis.choices.coordinates import Coordinates
from analysis.choices.shapes import Shape
from analysis.statistics.doubles import Floats

STEPS = 200
TINY = 1e-300
FAR = 1e6  # every shape is flat there
DONE = 1e-22


@dataclass(frozen=True)
class Problem:
    """`t` (levels), `trials` (levels), `hits` (fits, levels); the model's shape and coordinates.

    The parameters are (first, second, guess, lapse); `low` and `high` (4) bound them, `free` (4) says which move.
    """

    t: Floats
    trials: Floats
    hits: Floats
    shape: Shape
    coordinates: Coordinates
    low: Floats
    high: Floats
    free: NDArray[np.bool_]


class Fitted(NamedTuple):
    """Parameters (fits, 4), log likelihoods (fits), expected information (fits, 4, 4), and whether each arrived."""

    parameters: Floats
    log_likelihood: Floats
    information: Floats
    arrived: Floats


def shares(problem: Problem, place: Floats) -> tuple[Floats, Floats, Floats]:
    """The probability of a hit, of a miss, and the derivatives (fits, levels, 4) of the first, at given parameters."""
    centre, log_spread, slopes = problem.coordinates.native(place[:, 0], place[:, 1])
    guess, lapse = place[:, 2:3], place[:, 3:4]
    spread = np.exp(log_spread)[:, None]
    z = np.clip((problem.t - centre[:, None]) / spread, -FAR, FAR)
    share, rest = problem.shape.share(z), problem.shape.rest(z)
    range_ = 1 - guess - lapse
    tilt = range_ * problem.shape.steepness(z)
    down, narrow = -tilt / spread, -tilt * z
    derivatives = np.empty((*z.shape, 4))
    derivatives[..., 0] = down * slopes[:, None, 0, 0] + narrow * slopes[:, None, 1, 0]
    derivatives[..., 1] = down * slopes[:, None, 0, 1] + narrow * slopes[:, None, 1, 1]
    derivatives[..., 2], derivatives[..., 3] = rest, -share
    return np.maximum(guess + range_ * share, TINY), np.maximum(lapse + range_ * rest, TINY), derivatives


def likelihoods(problem: Problem, place: Floats) -> Floats:
    """The log likelihood of each fit (without the binomial constant)."""
    hit, miss, _ = shares(problem, place)
    return _likelihoods(problem, hit, miss)


def _likelihoods(problem: Problem, hit: Floats, miss: Floats) -> Floats:
    result: Floats = (xlogy(problem.hits, hit) + xlogy(problem.trials - problem.hits, miss)).sum(axis=1)
    return result


def maximised(problem: Problem, start: Floats) -> Fitted:
    """Each fit led uphill from its start.

    Scoring (expected information) with Marquardt's damping; a parameter at a bound rests while the slope pushes it out.
    """
    place = np.clip(start, problem.low, problem.high)
    hit, miss, tilt = shares(problem, place)
    value = _likelihoods(problem, hit, miss)
    damping = np.full(len(place), 1e-3)
    arrived = np.zeros(len(place), dtype=bool)
    for _ in range(STEPS):
        slope, information = _slope(problem, hit, miss, tilt)
        step, gain = _step(problem, place, slope, information, damping)
        moved = np.where(arrived[:, None], place, np.clip(place + step, problem.low, problem.high))
        new_hit, new_miss, new_tilt = shares(problem, moved)
        new = _likelihoods(problem, new_hit, new_miss)
        better = new >= value
        arrived |= (gain <= DONE * np.maximum(1.0, np.abs(value))) | (~better & (damping > 1e10))
        damping = np.where(better, np.where(damping < 1e-9, 0.0, damping * 0.1), np.maximum(damping, 1e-9) * 10)
        place = np.where(better[:, None], moved, place)
        value = np.where(better, new, value)
        hit, miss = np.where(better[:, None], new_hit, hit), np.where(better[:, None], new_miss, miss)
        tilt = np.where(better[:, None, None], new_tilt, tilt)
        if arrived.all():
            break
    return Fitted(place, value, _slope(problem, hit, miss, tilt)[1], arrived)


def _slope(problem: Problem, hit: Floats, miss: Floats, tilt: Floats) -> tuple[Floats, Floats]:
    pull = problem.hits / hit - (problem.trials - problem.hits) / miss
    weight = problem.trials / (hit * miss)
    slope = np.einsum("bl,blp->bp", pull, tilt)
    return slope, np.einsum("bl,blp,blq->bpq", np.minimum(weight, 1e300), tilt, tilt, optimize=True)


def _step(
    problem: Problem, place: Floats, slope: Floats, information: Floats, damping: Floats
) -> tuple[Floats, Floats]:
    """The damped step of each fit and what it promises to gain; parameters that rest do not move."""
    outward = ((place <= problem.low) & (slope < 0)) | ((place >= problem.high) & (slope > 0))
    moving = problem.free & ~outward
    slope = np.where(moving, slope, 0.0)
    system = np.where(moving[:, :, None] & moving[:, None, :], information, 0.0)
    size = np.maximum(np.einsum("bpp->bp", system), 1e-12)
    system = system + np.einsum("bp,pq->bpq", size * damping[:, None] + np.where(moving, 1e-14 * size, 1.0), np.eye(4))
    step: Floats = np.linalg.solve(system, slope[..., None])[..., 0]
    return step, (step * slope).sum(axis=1)
