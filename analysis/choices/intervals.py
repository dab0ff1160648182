"""Intervals for a threshold and a JND, by profile likelihood and by resampling the answers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.special import ndtri

from palpate.analysis.choices.maximising import DONE, Fitted, Problem, best_of_starts, maximise, shares
from palpate.analysis.choices.psychometric import Psychometric, deviance_residuals
from palpate.analysis.choices.shapes import by_jnd, by_threshold
from palpate.analysis.choices.specification import FunctionSpec, Levels, problem_of, quantities, to_level, to_size
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_draws, check_share, p_of_draws, stream
from palpate.analysis.statistics.refusals import refuse_idle

Which: TypeAlias = Literal["threshold", "jnd"]
OPEN = "the data do not bound the {which} from {side}"
SCAN, REFINED = 24, 12
REACH = 40.0  # standard errors
CORRECTING_DRAWS = 200
AT_ONCE = 4_000  # fits
ROUGH = 1e-7  # of the log likelihood: enough to scan by, and for a mean over draws


class Interval(NamedTuple):
    """An interval: its ends (NaN if open) and notes on them."""

    low: float
    high: float
    note: str = ""


@dataclass(frozen=True)
class Resampled:
    """Percentile intervals, and the deviance's Monte Carlo p, from answers simulated by the fitted function.

    `lost` is the share of simulated data sets whose fit ran to the edge of the search (a step, a flat line); these
    count as extremes.
    """

    threshold: Interval
    jnd: Interval
    p_deviance: float
    draws: int
    lost: float


def profile_interval(
    fit: Psychometric, which: Which, confidence: float = 0.95, draws: int = CORRECTING_DRAWS, seed: int = 0
) -> Interval:
    """Return the points at which twice the fall of the profile log likelihood reaches the chi squared quantile (1 df).

    The quantile is widened by Bartlett's factor: the mean of twice that fall at the estimate over `draws` sets of
    answers simulated by the fitted function, if the mean is above 1 (chi squared's); `draws=0` leaves it unchanged. An
    end that is not reached within 40 standard errors, or only outside the search (ten ranges of levels away; a spread
    below a ten-thousandth or above a thousand of them), is NaN and marked as open. Sources: Venzon & Moolgavkar 1988;
    Bartlett 1937, by simulation as Rocke 1989; docs/decisions/0012.
    """
    return profile_intervals(fit, confidence, draws, seed, (which,))[0]


def profile_intervals(
    fit: Psychometric,
    confidence: float = 0.95,
    draws: int = CORRECTING_DRAWS,
    seed: int = 0,
    parameters: Sequence[Which] = ("threshold", "jnd"),
) -> tuple[Interval, ...]:
    """Return the profile intervals of several parameters; the answers simulated for all of them are fitted once."""
    check_share(confidence, "confidence")
    if draws:
        check_draws(draws)
    else:
        refuse_idle("seed", seed, 0, "with draws=0, nothing is simulated")
    spec, answers = fit.spec, fit.levels
    problem = problem_of(answers, spec)
    simulated = simulate(problem, fit.maximum, draws, (seed,)) if draws else None
    intervals = []
    for which in parameters:
        ends = profile_ends(problem, fit.maximum, spec, answers, which, confidence, simulated)
        low, high = (float(end) for end in ends[0])
        sides = [side for side, place in zip(("below", "above"), (low, high), strict=True) if math.isnan(place)]
        intervals.append(Interval(low, high, "; ".join(OPEN.format(which=which, side=side) for side in sides)))
    return tuple(intervals)


class Simulated(NamedTuple):
    """Answers simulated by fits, hits (fits, draws, levels), and the highest log likelihood of each (fits, draws)."""

    hits: Floats
    best: Floats


def simulate(problem: Problem, most: Fitted, draws: int, seeds: Sequence[int]) -> Simulated:
    """Return `draws` sets of answers of each fit, and their highest likelihoods; each fit has its own seed."""
    trials = problem.trials.astype(np.int64)
    hits = np.stack(
        [
            stream(seed, "Bartlett's factor").binomial(trials, np.minimum(share, 1.0), (draws, len(trials)))
            for share, seed in zip(shares(problem, most.parameters)[0], seeds, strict=True)
        ]
    ).astype(np.float64)
    return Simulated(hits, _best(problem, hits, most.parameters))


def _best(problem: Problem, hits: Floats, place: Floats) -> Floats:
    """Return the highest log likelihood of answers (fits, draws, levels), searched from each fit's `place`."""
    draws, chunk = hits.shape[1], max(1, AT_ONCE // hits.shape[1])
    parts = [slice(first, first + chunk) for first in range(0, len(hits), chunk)]
    found = [
        _from_two_starts(
            replace(problem, hits=hits[part].reshape(-1, hits.shape[2])), np.repeat(place[part], draws, axis=0), ROUGH
        )
        for part in parts
    ]
    return np.concatenate(found).reshape(hits.shape[:2])


def profile_ends(
    problem: Problem,
    most: Fitted,
    spec: FunctionSpec,
    answers: Levels,
    which: Which,
    confidence: float,
    simulated: Simulated | None,
) -> Floats:
    """Return the ends of the profile intervals of many fits at the same levels, (fits, 2), in the level's units.

    They have Bartlett's factor from the answers that the fits simulated (`simulate`); None leaves it out.
    """
    by = by_threshold(spec.shape, spec.threshold) if which == "threshold" else by_jnd(spec.shape, spec.jnd)
    # The problem in coordinates whose first one is profiled: it rests, and its bounds are lifted.
    free = problem.free.copy()
    free[0] = False
    _, second = by.of(most.parameters[:, 0], most.parameters[:, 1])
    low, high = problem.low.copy(), problem.high.copy()
    reach = 1e3 * (1 + float(np.abs(second).max()))
    low[:2], high[:2] = (-1e12, float(second.min()) - reach), (1e12, float(second.max()) + reach)
    if by.ends_in_spread:
        low[1], high[1] = problem.low[1], problem.high[1]
    first, second = by.of(most.parameters[:, 0], most.parameters[:, 1])
    result: Floats = np.column_stack([first, second, most.parameters[:, 2:]])
    turned, place = replace(problem, coordinates=by, low=low, high=high, free=free), result
    factor = np.ones(len(place)) if simulated is None else _bartlett(turned, place, simulated)
    allowed = most.log_likelihood - 0.5 * factor * float(ndtri((1 + confidence) / 2)) ** 2
    # The first coordinate's standard error from the expected information, guess and lapse held.
    hit, miss, tilt = shares(turned, place)
    weight = turned.trials / (hit * miss)
    information = np.einsum("bl,blp,blq->bpq", weight, tilt[..., :2], tilt[..., :2])
    se: Floats = np.sqrt(np.maximum(np.linalg.pinv(information)[:, 0, 0], 1e-300))
    edges = np.array([limit[int(which == "jnd")] for limit in (problem.low, problem.high)])
    steps = (se[:, None] * [-1.0, 1.0]).ravel()
    ends = _ends(turned, np.repeat(place, 2, axis=0), steps, np.repeat(allowed, 2), np.tile(edges, len(place))).reshape(
        -1, 2
    )
    if spec.falling and which == "threshold":
        ends = ends[:, ::-1]
    return (to_level if which == "threshold" else to_size)(ends, spec, answers)


def _ends(turned: Problem, place: Floats, step: Floats, allowed: Floats, edge: Floats) -> Floats:
    """Return the first values at which the profiles fall by the allowed amount; NaN where they never do.

    Each row is a search of its own: along `step` from `place`, as far as `edge`. A fit has as many rows as others.
    """
    start = place[:, 0]
    step = step * np.minimum((edge - start) / (step * REACH), 1.0)  # no further than a fit is looked for
    scan = np.concatenate(([0.0], np.geomspace(0.02, REACH, SCAN)))
    above = _profiles(turned, place, start[:, None] + scan * step[:, None], ROUGH) - allowed[:, None]
    reached = (above < 0).any(axis=1)
    first = np.maximum(np.argmax(above < 0, axis=1), 1)
    rows = np.arange(len(place))
    near, far = scan[first - 1], scan[first]
    high, low = above[rows, first - 1], above[rows, first]
    cross, moved = far, np.zeros(len(place))
    for _ in range(REFINED):  # the Illinois method: an end that stays twice counts half
        cross = near + (far - near) * np.clip(high / np.where(high > low, high - low, 1.0), 0.0, 1.0)
        value = _profiles(turned, place, (start + cross * step)[:, None], DONE)[:, 0] - allowed
        inside = value >= 0
        low = np.where(inside, np.where(moved > 0, low * 0.5, low), value)
        high = np.where(inside, value, np.where(moved < 0, high * 0.5, high))
        near, far = np.where(inside, cross, near), np.where(inside, far, cross)
        moved = np.where(inside, 1.0, -1.0)
    return np.where(reached, start + cross * step, np.nan)


def _bartlett(turned: Problem, place: Floats, simulated: Simulated) -> Floats:
    """Return Bartlett's factor of each fit, at least 1, from answers simulated by the fit.

    It is the mean of twice the fall at the simulating parameters; the score statistic at the same parameters, whose
    mean is exactly 1, serves as a control variate.
    """
    fall = 2 * np.maximum(simulated.best - _best(turned, simulated.hits, place), 0.0)
    factors: Floats = 1 + (fall - _score_statistics(turned, place, simulated.hits)).mean(axis=1)
    return np.maximum(factors, 1.0)


def _score_statistics(turned: Problem, place: Floats, hits: Floats) -> Floats:
    """Return the squared efficient score of the first coordinate over its variance, (fits, draws)."""
    hit, miss, tilt = shares(turned, place)
    pull = (hits - turned.trials * hit[:, None]) / (hit * miss)[:, None]
    slope = pull @ tilt
    information = np.swapaxes(tilt * (turned.trials / (hit * miss))[..., None], 1, 2) @ tilt
    rest = turned.free & (place > turned.low) & (place < turned.high)
    rest[:, 0] = False
    both = rest[:, :, None] & rest[:, None, :]
    system = np.where(both, information, np.eye(4))
    weights = np.linalg.solve(system, np.where(rest, information[:, 0], 0.0)[..., None])[..., 0]
    direction = np.eye(4)[0] - weights
    variance = np.einsum("bp,bpq,bq->b", direction, information, direction)
    result: Floats = np.einsum("bdp,bp->bd", slope, direction) ** 2 / variance[:, None]
    return result


def _profiles(turned: Problem, place: Floats, values: Floats, done: float) -> Floats:
    """Return the log likelihoods (fits, values) at values of the first coordinate, maximised over the rest.

    The search starts at two points.
    """
    many = np.repeat(place, values.shape[1], axis=0)
    many[:, 0] = values.ravel()
    return _from_two_starts(turned, many, done).reshape(values.shape)


def _from_two_starts(problem: Problem, place: Floats, done: float) -> Floats:
    """Return the better log likelihood of two searches: from these parameters, and from these with the lowest rates.

    A fixed coordinate may be outside the bounds, which only apply to free ones.
    """
    low_rates = place.copy()
    low_rates[:, 2:] = problem.low[2:]
    hits = np.repeat(problem.hits, len(place) // len(problem.hits), axis=0)
    fits = maximise(replace(problem, hits=np.tile(hits, (2, 1))), np.concatenate([place, low_rates]), done)
    result: Floats = fits.log_likelihood.reshape(2, -1).max(axis=0)
    return result


def resampled_answers(fit: Psychometric, draws: int = 1000, confidence: float = 0.95, seed: int = 0) -> Resampled:
    """Return intervals from answers drawn from the fitted function and fitted again (parametric bootstrap).

    Sources: Wichmann & Hill 2001b (intervals), 2001a (deviance: the p counts the observed one as a draw).
    """
    check_draws(draws)
    check_share(confidence, "confidence")
    answers, spec = fit.levels, fit.spec
    expected = fit.table["expected"].to_numpy()
    rng = stream(seed, "psychometric function")
    hits = rng.binomial(answers.trials.astype(np.int64), expected, size=(draws, len(expected))).astype(np.float64)
    problem = problem_of(answers, spec, hits)
    fits = best_of_starts(problem)
    at, size = quantities(spec, answers, fits.parameters)
    fitted = shares(problem, fits.parameters)[0]
    fitted = fitted[:, ::-1] if spec.falling else fitted
    deviances = (deviance_residuals(hits, answers.trials, np.minimum(fitted, 1.0)) ** 2).sum(axis=1)
    edges = (fits.parameters[:, :2] <= problem.low[:2]) | (fits.parameters[:, :2] >= problem.high[:2])
    reached = int((deviances >= fit.deviance * (1 - 1e-12)).sum())
    return Resampled(
        _percentiles(at, confidence),
        _percentiles(size, confidence),
        p_of_draws(reached, draws),
        draws,
        float(edges.any(axis=1).mean()),
    )


def _percentiles(values: Floats, confidence: float) -> Interval:
    low, high = np.quantile(values, [(1 - confidence) / 2, (1 + confidence) / 2])
    return Interval(float(low), float(high))
