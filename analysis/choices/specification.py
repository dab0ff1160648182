"""The specification of a psychometric function, the answers at each level, and the problem of fitting them.

Answers that do not determine a threshold are refused with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
import pandas as pd
from scipy.special import xlogy

from palpate.analysis.choices.maximising import Problem
from palpate.analysis.choices.shapes import SHAPES, JndKind, Shape, by_jnd, by_threshold, own
from palpate.analysis.statistics.cells import check_columns, numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, BadValue, NoEstimate, TooFew, listed, refuse_idle, shown

ALIKE = 1e-6  # log likelihoods closer than this are one
Bounds = tuple[float, float]
Function: TypeAlias = Literal["logistic", "gaussian", "weibull", "weibull_db"]
Task: TypeAlias = Literal["symmetric", "forced_choice", "yes_no"]
Rate: TypeAlias = float | Bounds
FAR, NARROW, WIDE = 10.0, 1e-4, 1e3  # of the range of levels
ESTIMATED = (0.0, 0.25)
"""The range of a rate that the task leaves free, unless the caller gives another."""
WICHMANN_HILL = (0.0, 0.06)
"""The range of the lapse rate in plans without a task (Wichmann & Hill 2001)."""


@dataclass(frozen=True)
class Levels:
    """Answers by level: `levels` ascending and distinct, `trials` at each, `hits` (correct, or "yes") among them."""

    levels: Floats
    hits: Floats
    trials: Floats


def gather_levels(data: pd.DataFrame, level: Hashable, correct: Hashable, n: Hashable | None = None) -> Levels:
    """Return levels and counts of a table: one row per trial (`correct` 0/1 or true/false), or per `n` trials.

    Raises UnknownColumn, BadValue (no value, counts that are not whole numbers from 0 to n), TooFew (one level).
    """
    check_columns(data, [level, correct] if n is None else [level, correct, n])
    at = _finite(data, level)
    hits = _finite(data, correct)
    trials = np.ones(len(data)) if n is None else _finite(data, n)
    wrong = (hits < 0) | (hits > trials) | (hits != np.floor(hits)) | (trials != np.floor(trials))
    if wrong.any():
        rows = (np.flatnonzero(wrong) + 1).tolist()
        top = "1" if n is None else f"column {n!r}"
        listing = listed((f"{hits[row - 1]:g} of {trials[row - 1]:g} in row {row}" for row in rows), len(rows))
        raise BadValue(f"column {correct!r} must count answers from 0 to {top} in whole numbers; found {listing}")
    levels, codes = np.unique(at, return_inverse=True)
    counted = [np.asarray(np.bincount(codes, weights=of), dtype=np.float64) for of in (trials, hits)]
    tested = counted[0] > 0
    if tested.sum() < 2:
        raise TooFew(f"{int(tested.sum())} level was presented; a psychometric function needs two or more")
    return Levels(levels[tested], counted[1][tested], counted[0][tested])


def _finite(data: pd.DataFrame, name: Hashable) -> Floats:
    values = numbers_of(data[name], name)
    rows = (np.flatnonzero(np.isnan(values)) + 1).tolist()
    if rows:
        listing = listed((f"row {row}" for row in rows), len(rows))
        raise BadValue(f"column {name!r} has no value in {listing}; take these trials out")
    return values


def log_likelihood(hits: Floats, trials: Floats, share: Floats) -> float:
    """Return the binomial log likelihood without its constant."""
    return float((xlogy(hits, share) + xlogy(trials - hits, 1 - share)).sum())


def refuse_flat(answers: Levels, reached: float, guess: Bounds, lapse: Bounds) -> None:
    """Refuse answers that a constant share fits as well as any rising function. Raises NoEstimate."""
    share = float(answers.hits.sum() / answers.trials.sum())
    level = min(max(share, guess[0]), 1 - lapse[0])
    if log_likelihood(answers.hits, answers.trials, np.full_like(answers.trials, level)) < reached - ALIKE:
        return
    if share in (0.0, 1.0):
        outcome = "every answer was a hit" if share else "no answer was a hit"
        raise NoEstimate(f"{outcome}: the threshold lies {'below' if share else 'above'} the levels; test others")
    raise NoEstimate(
        f"the share of hits does not rise with the level (it is {share:.3g} over all levels): there is no threshold; "
        "if it should fall as the level rises, set `falling` to true"
    )


def refuse_step(
    answers: Levels, reached: float, guess: Bounds, lapse: Bounds, equal_rates: bool = False, certain: bool = True
) -> None:
    """Refuse answers that a step fits as well as any slope, which then has no estimate. Raises NoEstimate.

    `certain`: the answers leave no doubt that there is a threshold, so that the message says where it lies.
    """
    count = len(answers.levels)
    places = [j for j in range(count) if _step(answers, j, guess, lapse, equal_rates) >= reached - ALIKE]
    if not places:
        return
    around = (places[0], places[-1]) if len(places) > 1 else (max(places[0] - 1, 0), min(places[0] + 1, count - 1))
    low, high = sorted(float(answers.levels[j]) for j in around)
    place = "the threshold lies there, but" if certain else "too few answers to say that a threshold lies there, and"
    raise NoEstimate(
        f"the answers step from one side to the other between levels {low:g} and {high:g}: {place} "
        "the slope (and any interval) has no estimate; test levels in between, or ask for the posterior of a prior"
    )


def _step(answers: Levels, j: int, guess: Bounds, lapse: Bounds, equal_rates: bool) -> float:
    """Return the log likelihood of a step at level j, where the share is free."""
    low = _pooled(answers, slice(0, j), *guess)
    high = _pooled(answers, slice(j + 1, None), 1 - lapse[1], 1 - lapse[0])
    if equal_rates:
        misses = np.concatenate([answers.hits[:j], (answers.trials - answers.hits)[j + 1 :]])
        both = Levels(answers.levels, misses, np.delete(answers.trials, j))
        low = _pooled(both, slice(None), *lapse)
        high = 1 - low
    share = np.full_like(answers.trials, high)
    share[:j] = low
    share[j] = min(max(answers.hits[j] / answers.trials[j], low), high)
    return log_likelihood(answers.hits, answers.trials, share)


def _pooled(answers: Levels, part: slice, low: float, high: float) -> float:
    trials = float(answers.trials[part].sum())
    return min(max(float(answers.hits[part].sum()) / trials, low), high) if trials else low


@dataclass(frozen=True)
class FunctionSpec:
    """The specification of a fit: the model, the level of F that is the threshold, the definition of the JND.

    `assumed` describes which rates the task fixes, ties or leaves free; `equal_rates`: guess equals the lapse rate;
    `chance`: the guess rate is that of somebody who perceives nothing. `standard`: the level that others are compared
    with, where all lie on one side of it, so that there is nothing to perceive at it.
    """

    shape: Shape
    guess: Bounds
    lapse: Bounds
    threshold: float
    jnd: JndKind
    falling: bool
    assumed: str
    equal_rates: bool = False
    chance: bool = False
    standard: float | None = None


class Rates(NamedTuple):
    """Bounds of the guess and the lapse rate, whether they are equal, and a description of these assumptions.

    `chance`: the guess rate is that of somebody who perceives nothing, as in a forced choice; not so a rate of false
    alarms, since a person may say yes at random.
    """

    guess: Bounds
    lapse: Bounds
    equal: bool
    assumed: str
    chance: bool = False


def rates_of(
    task: Task | None,
    alternatives: int | None,
    guess: Rate | None,
    lapse: Rate | None,
    estimated: Bounds = ESTIMATED,
) -> Rates:
    """Return the two rates of a task. Raises BadOption, also for a given rate that the task already determines.

    `estimated` bounds a free rate that is not given. None as a task is for analysis plans written before tasks were
    declared: guess 0 and lapse from 0 to 0.06 unless given.
    """
    if task not in (*get_args(Task), None):
        raise BadOption(f"task={shown(task)} is unknown: {', '.join(map(repr, get_args(Task)))}")
    if task != "forced_choice":
        refuse_idle("alternatives", alternatives, None, "except with task='forced_choice'")
    if task == "forced_choice":
        if guess is not None:
            raise BadOption("guess has no effect: in a forced choice it is 1 / alternatives; give `alternatives`")
        if isinstance(alternatives, bool) or not isinstance(alternatives, int) or alternatives < 2:
            raise BadOption(f"alternatives={shown(alternatives)}: a forced choice needs their number, 2 or more")
        high = _bounds(estimated if lapse is None else lapse, "lapse")
        words = f"forced choice, guess rate fixed at 1/{alternatives}, lapse rate {_words(high)}"
        return Rates((1 / alternatives, 1 / alternatives), high, False, words, chance=True)
    if task == "symmetric":
        if guess is not None:
            raise BadOption("guess has no effect: both sides of a symmetric task have the lapse rate; give `lapse`")
        both = _bounds(estimated if lapse is None else lapse, "lapse")
        words = "no lapses" if both == (0.0, 0.0) else f"equal lapse rates on both sides, {_words(both)}"
        return Rates(both, both, True, f"symmetric task, {words}")
    low = _bounds((0.0 if task is None else estimated) if guess is None else guess, "guess")
    high = _bounds((WICHMANN_HILL if task is None else estimated) if lapse is None else lapse, "lapse")
    name = "no task declared" if task is None else "yes/no task"
    words = f"{name}, guess rate {_words(low)}, lapse rate {_words(high)}"
    return Rates(low, high, False, words, chance=task is None and low[0] == low[1] > 0)


def _words(rate: Bounds) -> str:
    return f"fixed at {rate[0]:g}" if rate[0] == rate[1] else f"estimated between {rate[0]:g} and {rate[1]:g}"


def function_spec(function: str, rates: Rates, threshold: float, jnd: str, falling: bool) -> FunctionSpec:
    """Return the options of a fit, checked. Raises BadOption."""
    if not isinstance(function, str) or function not in SHAPES:
        raise BadOption(f"function={shown(function)} is unknown: {', '.join(map(repr, SHAPES))}")
    if jnd not in ("half_interquartile", "x84_x50"):
        raise BadOption(f"jnd={shown(jnd)} is unknown: 'half_interquartile' or 'x84_x50'")
    if not 0 < threshold < 1:
        raise BadOption(f"threshold={shown(threshold)}: expected a value of F between 0 and 1, such as 0.5")
    low, high = rates.guess, rates.lapse
    if low[1] + high[1] > 1 or low[0] + high[0] >= 1:
        raise BadOption(f"guess up to {low[1]:g} and lapse up to {high[1]:g} leave no room for the function")
    if falling and SHAPES[function].logarithmic:
        raise BadOption("a Weibull function of a falling share has no place here; use 'logistic' or 'gaussian'")
    kind: JndKind = "x84_x50" if jnd == "x84_x50" else "half_interquartile"
    return FunctionSpec(SHAPES[function], low, high, threshold, kind, falling, rates.assumed, rates.equal, rates.chance)


def _bounds(rate: Rate, name: str) -> Bounds:
    low, high = (rate, rate) if isinstance(rate, int | float) else rate
    if not 0 <= low <= high < 1:
        raise BadOption(f"{name}={rate!r}: expected a rate from 0 to below 1, or (lowest, highest)")
    return float(low), float(high)


def problem_of(answers: Levels, spec: FunctionSpec, hits: Floats | None = None) -> Problem:
    """Return the fit in its own coordinates: t starts at the lowest level, bounds follow from the levels."""
    order = slice(None, None, -1) if spec.falling else slice(None)
    levels = (-answers.levels if spec.falling else answers.levels)[order]
    if spec.shape.logarithmic and levels[0] <= 0:
        raise BadValue(
            f"level {levels[0]:g}: a Weibull function needs levels above 0; of levels in dB it is `weibull_db`"
        )
    t = np.log(levels / levels[0]) if spec.shape.logarithmic else (levels - levels[0]) / unit_of(answers, spec)
    span = float(t[-1])
    guess = (0.0, 0.0) if spec.equal_rates else spec.guess
    low = np.array([-FAR * span, math.log(NARROW * span), guess[0], spec.lapse[0]])
    high = np.array([(FAR + 1) * span, math.log(WIDE * span), guess[1], spec.lapse[1]])
    counted = answers.hits[None, order] if hits is None else hits[:, order]
    return Problem(t, answers.trials[order], counted, spec.shape, own(), low, high, high > low, spec.equal_rates)


def unit_of(answers: Levels, spec: FunctionSpec) -> float:
    """Return the levels in a step of 1 on the fit's axis: a power of two near their range, so that units cancel."""
    if spec.shape.logarithmic:
        return 1.0
    return float(np.ldexp(1.0, int(np.frexp(answers.levels[-1] - answers.levels[0])[1])))


def standard_place(spec: FunctionSpec, answers: Levels) -> float:
    """Return the standard on the fit's axis: at most 0, -inf where there is none or it lies infinitely far."""
    if spec.standard is None or (spec.shape.logarithmic and spec.standard <= 0):
        return -math.inf
    return float(to_place(np.asarray(spec.standard), spec, answers))


def quantities(spec: FunctionSpec, answers: Levels, place: Floats) -> tuple[Floats, Floats]:
    """Return threshold and JND of each row of parameters (centre, log spread, ...), in the level's units."""
    at, _ = by_threshold(spec.shape, spec.threshold).of(place[:, 0], place[:, 1])
    size, _ = by_jnd(spec.shape, spec.jnd).of(place[:, 0], place[:, 1])
    return to_level(at, spec, answers), to_size(size, spec, answers)


def to_place(levels: Floats, spec: FunctionSpec, answers: Levels) -> Floats:
    """Return levels on the fit's axis."""
    if spec.shape.logarithmic:
        return np.asarray(np.log(levels / answers.levels[0]))
    beyond = answers.levels[-1] - levels if spec.falling else levels - answers.levels[0]
    return np.asarray(beyond / unit_of(answers, spec))


def to_level(t: Floats, spec: FunctionSpec, answers: Levels) -> Floats:
    """Return the level at a point of the fit's axis."""
    if spec.shape.logarithmic:
        return np.asarray(answers.levels[0] * np.exp(t))
    shift = t * unit_of(answers, spec)
    return np.asarray(answers.levels[-1] - shift if spec.falling else answers.levels[0] + shift)


def to_size(log_jnd: Floats, spec: FunctionSpec, answers: Levels) -> Floats:
    """Return the difference of levels for the logarithm of a JND on the fit's axis."""
    return np.asarray(np.exp(log_jnd) * (answers.levels[0] if spec.shape.logarithmic else unit_of(answers, spec)))
