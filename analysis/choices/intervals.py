"""Intervals for a threshold and a JND: by profile likelihood, and by resampling the answers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.special import ndtri

from analysis.choices.asking import problem_of, quantities, to_level, to_size
from analysis.choices.coordinates import Coordinates, by_jnd, by_threshold
from analysis.choices.maximising import Fitted, Problem, maximised, shares
from analysis.choices.psychometric import Psychometric, deviance_residuals
from analysis.choices.starting import best_of_starts
from analysis.spaces.draws import check_draws, check_share, p_of_draws, stream
from analysis.statistics.doubles import Floats

Which: TypeAlias = Literal["threshold", "jnd"]
OPEN = "the data do not bound the {which} from {side}"
SCAN, REFINED = 24, 4
REACH = 40.0  # standard errors


class Interval(NamedTuple):
    """Its ends (NaN where open) and what to know of them."""

    low: float
    high: float
    note: str = ""


@dataclass(frozen=True)
class Resampled:
    """Percentile intervals, and the deviance's Monte Carlo p, from answers simulated by the fitted function.

    `lost` is the share of simulated data sets whose fit ran to the edge of what is looked for (a step, a flat line):
    they count as the extremes that they are.
    """

    threshold: Interval
    jnd: Interval
    p_deviance: float
    draws: int
    lost: float


def profile_interval(fit: Psychometric, which: Which, confidence: float = 0.95) -> Interval:
    """Where twice the fall of the log likelihood, maximised over all else, reaches the chi squared quantile (1 df).

    An end that is not reached within 40 standard errors, or only where no fit is looked for (ten ranges of levels away;
    a spread of a ten-thousandth or a thousand of them), is NaN and said to be open.
    Source: Venzon & Moolgavkar 1988.
    """
    check_share(confidence, "confidence")
    asked, given = fit.asked, fit.levels
    problem = problem_of(given, asked)
    most = fit.maximum
    by = by_threshold(asked.shape, asked.threshold) if which == "threshold" else by_jnd(asked.shape, asked.jnd)
    allowed = float(most.log_likelihood[0]) - 0.5 * float(ndtri((1 + confidence) / 2)) ** 2
    turned = _turned(problem, by, most)
    se = _standard_error(turned, most, by)
    ends = [_end(turned, most, by, side * se, allowed) for side in (-1.0, 1.0)]
    mirrored = asked.falling and which == "threshold"
    edges = problem.low[int(which == "jnd")], problem.high[int(which == "jnd")]
    ends = [end if edges[0] < end < edges[1] else math.copysign(math.inf, end - edges[0]) for end in ends]
    ends = [end if math.isfinite(end) else math.nan for end in (ends[::-1] if mirrored else ends)]
    low, high = (float((to_level if which == "threshold" else to_size)(np.array(end), asked, given)) for end in ends)
    sides = [side for side, place in zip(("below", "above"), (low, high), strict=True) if math.isnan(place)]
    return Interval(low, high, "; ".join(OPEN.format(which=which, side=side) for side in sides))


def _turned(problem: Problem, by: Coordinates, most: Fitted) -> Problem:
    """The problem in coordinates whose first one is profiled: it rests, and its bounds are lifted."""
    free = problem.free.copy()
    free[0] = False
    _, second = by.of(most.parameters[:, 0], most.parameters[:, 1])
    low, high = problem.low.copy(), problem.high.copy()
    reach = 1e3 * (1 + abs(float(second[0])))
    low[:2], high[:2] = (-1e12, float(second[0]) - reach), (1e12, float(second[0]) + reach)
    if by.ends_in_spread:
        low[1], high[1] = problem.low[1], problem.high[1]
    return replace(problem, coordinates=by, low=low, high=high, free=free)


def _standard_error(turned: Problem, most: Fitted, by: Coordinates) -> float:
    """The first coordinate's standard error from the expected information, guess and lapse held."""
    place = _placed(most, by)
    hit, miss, tilt = shares(turned, place)
    weight = turned.trials / (hit * miss)
    information = np.einsum("bl,blp,blq->pq", weight, tilt[..., :2], tilt[..., :2])
    spread = np.linalg.pinv(information)
    return math.sqrt(max(float(spread[0, 0]), 1e-300))


def _placed(most: Fitted, by: Coordinates) -> Floats:
    first, second = by.of(most.parameters[:, 0], most.parameters[:, 1])
    result: Floats = np.column_stack([first, second, most.parameters[:, 2:]])
    return result


def _end(turned: Problem, most: Fitted, by: Coordinates, step: float, allowed: float) -> float:
    """The value on one side at which the profile has fallen to what is allowed; infinite where it never does."""
    place = _placed(most, by)
    start = float(place[0, 0])
    near, far, cross = 0.0, REACH, math.nan
    for scan in range(REFINED):
        parts = np.linspace(near, far, SCAN) if scan else np.concatenate(([0.0], np.geomspace(0.02, REACH, SCAN)))
        values = _profile(turned, place, start + parts * step)
        below = np.flatnonzero(values < allowed)
        if not len(below):
            return math.copysign(math.inf, step)
        i = max(int(below[0]), 1)
        near, far = float(parts[i - 1]), float(parts[i])
        fall = float(values[i - 1] - values[i])
        cross = near + (far - near) * (float(values[i - 1]) - allowed) / fall if fall > 0 else far
    return start + cross * step


def _profile(turned: Problem, place: Floats, values: Floats) -> Floats:
    """The log likelihood at each value of the first coordinate, maximised over the rest from two starts."""
    many = np.repeat(place, len(values), axis=0)
    many[:, 0] = values
    low_rates = many.copy()
    low_rates[:, 2:] = turned.low[2:]
    hits = np.repeat(turned.hits, 2 * len(values), axis=0)
    # The value may lie beyond the bounds of a start, which hold for what moves only.
    found = maximised(replace(turned, hits=hits), np.concatenate([many, low_rates]))
    result: Floats = found.log_likelihood.reshape(2, -1).max(axis=0)
    return result


def resampled_answers(fit: Psychometric, draws: int = 1000, confidence: float = 0.95, seed: int = 0) -> Resampled:
    """Parametric bootstrap: answers drawn from the fitted function at the same levels, and fitted again.

    Sources: Wichmann & Hill 2001b (intervals), 2001a (deviance: the p counts the observed one as a draw).
    """
    check_draws(draws)
    check_share(confidence, "confidence")
    given, asked = fit.levels, fit.asked
    expected = fit.table["expected"].to_numpy()
    rng = stream(seed, "psychometric function")
    hits = rng.binomial(given.trials.astype(np.int64), expected, size=(draws, len(expected))).astype(np.float64)
    problem = problem_of(given, asked, hits)
    found = best_of_starts(problem, 1)
    at, size = quantities(asked, given, found.parameters)
    fitted = shares(problem, found.parameters)[0]
    fitted = fitted[:, ::-1] if asked.falling else fitted
    deviances = (deviance_residuals(hits, given.trials, np.minimum(fitted, 1.0)) ** 2).sum(axis=1)
    edges = (found.parameters[:, :2] <= problem.low[:2]) | (found.parameters[:, :2] >= problem.high[:2])
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
