"""Maximum likelihood of many psychometric functions at once: a grid of starts, then damped scoring within bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter
from scipy.special import xlogy

from palpate.analysis.choices.shapes import Coordinates, Mapped, Shape
from palpate.analysis.statistics.doubles import Floats

STEPS = 200
STARTS = 4
TINY = 1e-200
FAR = 1e6  # every shape is flat there
DONE, NEAR, ARRIVED = 1e-22, 1e-10, 1e-8  # of the log likelihood
ROUNDING = 1e-12  # of the log likelihood: differences below it are of rounding
STUCK, CLOSE = 1e10, 0.01
FINITE = 1e200
SHIFT = 1e-4  # of a standard error, for differences of the slope


@dataclass(frozen=True)
class Problem:
    """The data and model of many fits: `t` (levels), `trials` (levels), `hits` (fits, levels), shape and coordinates.

    The parameters are (first, second, guess, lapse); `low` and `high` (4) bound them, `free` (4) says which are
    estimated. `equal_rates`: the guess rate equals the lapse rate, and its own parameter is ignored.
    """

    t: Floats
    trials: Floats
    hits: Floats
    shape: Shape
    coordinates: Coordinates
    low: Floats
    high: Floats
    free: NDArray[np.bool_]
    equal_rates: bool = False


class Fitted(NamedTuple):
    """Parameters (fits, 4), log likelihoods (fits), expected information (fits, 4, 4), and which fits converged."""

    parameters: Floats
    log_likelihood: Floats
    information: Floats
    arrived: NDArray[np.bool_]


def shares(problem: Problem, place: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the probabilities of hit and miss, and the derivatives (fits, levels, 4) of the first."""
    z, spread, slopes = _standardised(problem, place)
    guess, lapse = _rates(problem, place)
    share, rest, steepness = problem.shape.curve(z)
    range_ = 1 - guess - lapse
    tilt = range_ * steepness
    down, narrow = -tilt / spread, -tilt * z
    derivatives = np.empty((*z.shape, 4))
    derivatives[..., 0] = down * slopes[:, None, 0, 0] + narrow * slopes[:, None, 1, 0]
    derivatives[..., 1] = down * slopes[:, None, 0, 1] + narrow * slopes[:, None, 1, 1]
    derivatives[..., 2], derivatives[..., 3] = rest, rest - share if problem.equal_rates else -share
    return np.maximum(guess + range_ * share, TINY), np.maximum(lapse + range_ * rest, TINY), derivatives


def _standardised(problem: Problem, place: Floats) -> Mapped:
    """Return z (fits, levels), the spreads (fits, 1), and the derivatives of the coordinates (fits, 2, 2)."""
    centre, log_spread, slopes = problem.coordinates.native(place[:, 0], place[:, 1])
    spread = np.exp(log_spread)[:, None]
    return np.clip((problem.t - centre[:, None]) / spread, -FAR, FAR), spread, slopes


def _rates(problem: Problem, place: Floats) -> tuple[Floats, Floats]:
    """Return the guess and lapse rates (fits, 1)."""
    lapse = place[:, 3:4]
    return lapse if problem.equal_rates else place[:, 2:3], lapse


def log_shares(problem: Problem, place: Floats) -> tuple[Floats, Floats]:
    """Return the logarithms of the probabilities of hit and miss, (places, levels)."""
    z, _, _ = _standardised(problem, place)
    guess, lapse = _rates(problem, place)
    range_ = 1 - guess - lapse
    hit = np.maximum(guess + range_ * problem.shape.share(z), TINY)
    miss = np.maximum(lapse + range_ * problem.shape.rest(z), TINY)
    return xlogy(1.0, hit), xlogy(1.0, miss)


def likelihoods(problem: Problem, place: Floats) -> Floats:
    """Return the log likelihood of each fit, without the binomial constant."""
    hit, miss = log_shares(problem, place)
    result: Floats = (problem.hits * hit + (problem.trials - problem.hits) * miss).sum(axis=1)
    return result


def maximise(problem: Problem, start: Floats, done: float = DONE) -> Fitted:
    """Maximise the likelihood of each fit from its start.

    The method is scoring (expected information) with Marquardt's damping, near the maximum Newton's method (observed
    information, by differences of the gradient); a parameter stays at a bound while the gradient points outwards. At
    the maximum rounding hides whether a step is better: there, a step is accepted that loses no more than `ROUNDING`
    against the highest likelihood so far. A fit ends when the predicted gain of its next step is below `done` of the
    log likelihood, and is never below a likelihood that it had reached by more than `ROUNDING`.
    """
    place = np.clip(start, problem.low, problem.high)
    value = likelihoods(problem, place)
    highest = value.copy()
    damping, promised = np.full(len(place), 1e-3), np.full(len(place), np.inf)
    going = np.arange(len(place))
    for _ in range(STEPS):
        part = replace(problem, hits=problem.hits[going])
        step, gain = _step(part, place[going], damping[going], promised[going] < CLOSE)
        moved = np.clip(place[going] + step, problem.low, problem.high)
        new, scale = likelihoods(part, moved), np.maximum(1.0, np.abs(value[going]))
        better = (new >= value[going]) | ((gain <= NEAR * scale) & (new >= highest[going] - ROUNDING * scale))
        accepted = going[better]
        place[accepted], value[accepted] = moved[better], new[better]
        highest[accepted] = np.maximum(highest[accepted], new[better])
        lighter = np.where(damping[going] < 1e-9, 0.0, damping[going] * 0.1)
        damping[going] = np.where(better, lighter, np.maximum(damping[going], 1e-9) * 10)
        promised[going] = gain / scale
        going = going[(gain > done * scale) & (damping[going] < STUCK)]
        if not len(going):
            break
    if problem.equal_rates:
        place[:, 2] = place[:, 3]
    return Fitted(
        place, value, _information(problem, *shares(problem, place)), (promised <= ARRIVED) | (damping >= STUCK)
    )


def _slope(problem: Problem, hit: Floats, miss: Floats, tilt: Floats) -> Floats:
    """Return the gradient of each log likelihood, (fits, 4)."""
    pull = problem.hits / hit - (problem.trials - problem.hits) / miss
    result: Floats = (pull[:, None, :] @ tilt)[:, 0, :]
    return result


def _information(problem: Problem, hit: Floats, miss: Floats, tilt: Floats) -> Floats:
    """Return the expected information of each fit, (fits, 4, 4)."""
    weighted = tilt * (problem.trials / (hit * miss))[..., None]
    result: Floats = np.swapaxes(weighted, 1, 2) @ tilt
    return result


def _step(problem: Problem, place: Floats, damping: Floats, close: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return the damped step of each fit and its predicted gain; fixed parameters do not move."""
    at = shares(problem, place)
    whole_slope, information = _slope(problem, *at), _information(problem, *at)
    outward = ((place <= problem.low) & (whole_slope < 0)) | ((place >= problem.high) & (whole_slope > 0))
    moving = problem.free & ~outward
    slope = np.where(moving, whole_slope, 0.0)
    if close.any():
        rows = np.flatnonzero(close)
        part = replace(problem, hits=problem.hits[rows])
        information[rows] = _observed(part, place[rows], whole_slope[rows], information[rows], moving[rows])
    system = np.where(moving[:, :, None] & moving[:, None, :], information, 0.0)
    size = np.maximum(np.einsum("bpp->bp", system), 1e-12)
    system = system + np.einsum("bp,pq->bpq", size * damping[:, None] + np.where(moving, 1e-14 * size, 1.0), np.eye(4))
    step: Floats = np.linalg.solve(system, slope[..., None])[..., 0]
    return step, (step * slope).sum(axis=1)


def _observed(problem: Problem, place: Floats, slope: Floats, expected: Floats, moving: NDArray[np.bool_]) -> Floats:
    """Return the observed information of free parameters if it is positive definite, else the expected one.

    `slope` is the gradient at `place`.
    """
    free = np.flatnonzero(problem.free)
    # All moved places in one go: (free parameters, fits, 4).
    shift = SHIFT / np.sqrt(np.maximum(np.einsum("bpp->pb", expected)[free], TINY))
    shift = np.minimum(shift, 1e-3 * (problem.high[free] - problem.low[free])[:, None])
    own = np.arange(len(free))
    moved = np.tile(place, (len(free), 1, 1))
    shift = np.where(moved[own, :, free] + shift > problem.high[free][:, None], -shift, shift)
    moved[own, :, free] += shift
    many = replace(problem, hits=np.tile(problem.hits, (len(free), 1)))
    observed = expected.copy()
    with np.errstate(over="ignore", invalid="ignore"):  # far from the top; not used there
        slopes = _slope(many, *shares(many, moved.reshape(-1, 4))).reshape(moved.shape)
        observed[:, :, free] = np.moveaxis((slope - slopes) / shift[..., None], 0, 2)
    finite = np.asarray((np.abs(observed) < FINITE).all(axis=(1, 2)))
    observed = np.where(finite[:, None, None], (observed + np.swapaxes(observed, 1, 2)) / 2, expected)
    both = moving[:, :, None] & moving[:, None, :]
    own = np.where(both, observed, np.eye(4) * np.maximum(np.einsum("bpp->bp", expected), 1e-12)[:, None, :])
    size = 1 / np.sqrt(np.maximum(np.einsum("bpp->bp", own), 1e-300))
    with np.errstate(over="ignore"):
        scaled = own * size[:, :, None] * size[:, None, :]
    possible = np.asarray(
        (np.abs(scaled) <= 2).all(axis=(1, 2))
    )  # a definite one has ones on its diagonal, less beside
    definite = np.linalg.eigvalsh(np.where(possible[:, None, None], scaled, 0.0))[:, 0] > 1e-6
    return np.where(definite[:, None, None], observed, expected)


def best_of_starts(problem: Problem) -> Fitted:
    """Maximise from the highest peaks of a grid of places and spreads, and return the best result of every fit."""
    span = float(problem.t[-1])
    centres = np.linspace(-0.25, 1.25, 13) * span
    spreads = np.log(np.array([0.02, 0.06, 0.15, 0.4, 1.0]) * span)
    rates = [
        np.unique([low, low + (high - low) / 2]) for low, high in zip(problem.low[2:], problem.high[2:], strict=True)
    ]
    mesh = np.meshgrid(centres, spreads, *rates, indexing="ij")
    grid = np.column_stack([axis.ravel() for axis in mesh])
    hit, miss = log_shares(problem, grid)
    misses = problem.trials - problem.hits
    values = np.stack([(k * hit + n * miss).sum(axis=1) for k, n in zip(problem.hits, misses, strict=True)])
    chosen = _highest_peaks(values.reshape(len(values), len(centres), len(spreads), -1))
    maxima = maximise(replace(problem, hits=np.repeat(problem.hits, STARTS, axis=0)), grid[chosen].reshape(-1, 4))
    best = np.argmax(maxima.log_likelihood.reshape(-1, STARTS), axis=1) + np.arange(len(chosen)) * STARTS
    return Fitted(*(part[best] for part in maxima))


def _highest_peaks(values: Floats) -> NDArray[np.intp]:
    """Return the indices (fits, `STARTS`) of the highest peaks of `values` (fits, centres, spreads, rates) in a fit.

    A peak is no lower than its neighbours in centre and spread, each with its best rates. Where there are fewer peaks,
    the highest other points follow.
    """
    best_rates, highest = values.argmax(axis=3), values.max(axis=3)
    around, fits = maximum_filter(highest, size=(1, 3, 3)), len(values)
    order = np.lexsort((-highest.reshape(fits, -1), (highest < around).reshape(fits, -1)), axis=1)[:, :STARTS]
    return np.asarray(order * values.shape[3] + np.take_along_axis(best_rates.reshape(fits, -1), order, axis=1))
