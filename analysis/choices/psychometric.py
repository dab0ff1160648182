"""Psychometric functions by maximum likelihood: threshold, just noticeable difference, intervals, goodness of fit."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import gammaln, rel_entr

from palpate.analysis.choices.evidence import CERTAIN, refuse_guessing
from palpate.analysis.choices.maximising import Fitted, Problem, best_of_starts, shares
from palpate.analysis.choices.shapes import JndKind
from palpate.analysis.choices.specification import (
    Function,
    FunctionSpec,
    Levels,
    Rate,
    Task,
    function_spec,
    gather_levels,
    problem_of,
    quantities,
    rates_of,
    refuse_flat,
    refuse_step,
    to_level,
    unit_of,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import NoEstimate


@dataclass(frozen=True)
class Psychometric:
    """A fitted function psi(x) = guess + (1 - guess - lapse) F(x).

    `threshold` is the level at which F = `at` (psi = `share_at`), `jnd` as `jnd_kind` says, both in the level's units.
    `centre` and `spread` are the shape's own parameters (see `shapes`; of the log level for "weibull"). `slope` is that
    of psi at the threshold, per unit of level. `deviance` (`df`) is against free shares at every level. `table`: level,
    n, hits, share, expected, deviance_residual. `assumed` describes the task's assumptions about the two rates.
    """

    function: str
    threshold: float
    at: float
    share_at: float
    jnd: float
    jnd_kind: str
    centre: float
    spread: float
    slope: float
    guess: float
    lapse: float
    log_likelihood: float
    deviance: float
    df: int
    table: pd.DataFrame
    falling: bool
    assumed: str
    notes: tuple[str, ...]
    spec: FunctionSpec
    levels: Levels
    maximum: Fitted


def fit_psychometric(
    data: pd.DataFrame,
    level: Hashable,
    correct: Hashable,
    n: Hashable | None = None,
    *,
    task: Task,
    alternatives: int | None = None,
    function: Function = "logistic",
    guess: Rate | None = None,
    lapse: Rate | None = None,
    threshold: float = 0.5,
    jnd: JndKind = "half_interquartile",
    falling: bool = False,
) -> Psychometric:
    """Fit a psychometric function to answers at levels: one row per trial, or counts `correct` of `n`.

    The task decides which rates are free. "symmetric" (a comparison with a standard): one lapse rate on both sides,
    none with `lapse=0`. "forced_choice": guess is 1 / `alternatives`, the lapse rate free. "yes_no": a guess
    (false-alarm) rate and a lapse rate of their own. A free rate lies between 0 and 0.25; `guess` and `lapse` set other
    bounds (lowest, highest) or fix a rate where the task leaves it free. `threshold` is a value of F, so 0.5 is halfway
    between guess and 1 - lapse whatever these are. JND: "half_interquartile" (x.75 - x.25) / 2 of F, or "x84_x50", the
    standard deviation of a cumulative Gaussian. `falling`: hits become rarer as the level rises. Raises NoEstimate
    where the answers do not rise, are all equal, or step from one side to the other; BadValue, TooFew, UnknownColumn,
    BadOption (also for a rate that the task decides). Sources: Wichmann & Hill 2001a; Levenberg-Marquardt scoring with
    bounds; docs/decisions/0012.
    """
    answers = gather_levels(data, level, correct, n)
    spec = function_spec(function, rates_of(task, alternatives, guess, lapse), threshold, jnd, falling)
    return fit_function(answers, spec)


def fit_function(answers: Levels, spec: FunctionSpec) -> Psychometric:
    """Return the fit of counted levels."""
    problem = problem_of(answers, spec)
    fits = best_of_starts(problem)
    refuse_no_estimate(answers, spec, problem, fits, 0)
    centre, log_spread, guess, lapse = fits.parameters[0].tolist()
    spread = math.exp(log_spread) * unit_of(answers, spec)
    at, size = (float(value[0]) for value in quantities(spec, answers, fits.parameters))
    hit = shares(problem, fits.parameters)[0][0]
    expected = hit[::-1] if spec.falling else hit
    residuals = deviance_residuals(answers.hits, answers.trials, expected)
    columns = {"level": answers.levels, "n": answers.trials.astype(int), "hits": answers.hits.astype(int)}
    shared = {"share": answers.hits / answers.trials, "expected": expected, "deviance_residual": residuals}
    table = pd.DataFrame(columns | shared)
    steep = float(spec.shape.curve(np.array([spec.shape.place(spec.threshold)]))[2][0]) / spread
    chain = 1 / at if spec.shape.logarithmic else (-1.0 if spec.falling else 1.0)
    offset = math.log(answers.levels[0]) if spec.shape.logarithmic else 0.0
    # The part of the log likelihood that does not depend on the function: log binomial coefficients.
    misses = answers.trials - answers.hits
    constant = float((gammaln(answers.trials + 1) - gammaln(answers.hits + 1) - gammaln(misses + 1)).sum())
    notes = []
    if not answers.levels[0] <= at <= answers.levels[-1]:
        notes.append(f"the threshold is outside the tested levels ({answers.levels[0]:g} to {answers.levels[-1]:g})")
    for place, name in ((2, "guess"), (3, "lapse")):
        value, high = float(fits.parameters[0, place]), float(problem.high[place])
        if problem.free[place] and value >= high:
            notes.append(f"the {name} rate is at its upper bound {high:g}: the data would take it higher")
    if len(answers.levels) <= int(problem.free.sum()):
        notes.append("as many parameters as levels: the fit cannot be tested")
    return Psychometric(
        spec.shape.name,
        at,
        spec.threshold,
        guess + (1 - guess - lapse) * spec.threshold,
        size,
        spec.jnd,
        centre + offset if spec.shape.logarithmic else float(to_level(np.array(centre), spec, answers)),
        spread,
        (1 - guess - lapse) * steep * chain,
        guess,
        lapse,
        float(fits.log_likelihood[0]) + constant,
        float((table["deviance_residual"] ** 2).sum()),
        len(answers.levels) - int(problem.free.sum()),
        table,
        spec.falling,
        spec.assumed,
        tuple(notes),
        spec,
        answers,
        fits,
    )


def refuse_no_estimate(answers: Levels, spec: FunctionSpec, problem: Problem, fits: Fitted, i: int) -> None:
    """Raise NoEstimate where fit `i` of several to answers at the same levels determines no threshold or no slope."""
    reached = float(fits.log_likelihood[i])
    turned = Levels(problem.t, problem.hits[i], problem.trials)
    refuse_flat(turned, reached, spec.guess, spec.lapse)
    simulated = Levels(answers.levels, turned.hits[::-1] if spec.falling else turned.hits, answers.trials)
    certain = not spec.chance or refuse_guessing(simulated, spec) >= math.log(CERTAIN)
    named = Levels(answers.levels[::-1] if spec.falling else answers.levels, turned.hits, turned.trials)
    refuse_step(named, reached, spec.guess, spec.lapse, spec.equal_rates, certain)
    place, low, high = fits.parameters[i], problem.low, problem.high
    edges = (place[0] <= low[0], place[0] >= high[0], place[1] >= high[1])
    if any(edges) or not fits.arrived[i]:
        raise NoEstimate(
            f"the fit leads to a threshold far from the levels {answers.levels[0]:g} to {answers.levels[-1]:g}: "
            "the answers hardly change with the level; test a wider range"
        )
    if place[1] <= low[1]:
        raise NoEstimate("the fit is a step between two levels: the slope has no estimate; test levels in between")


def deviance_residuals(hits: Floats, trials: Floats, expected: Floats) -> Floats:
    """Return the signed square roots of each level's contribution to the deviance."""
    share = hits / trials
    parts = trials * (rel_entr(share, expected) + rel_entr(1 - share, 1 - expected))
    result: Floats = np.sign(share - expected) * np.sqrt(2 * np.maximum(parts, 0.0))
    return result
