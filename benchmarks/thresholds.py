"""Figures of thresholds: how far they lie from a simulated observer's, how often intervals miss it, and the time.

Seeds follow from the observers' names.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from palpate.analysis.choices.intervals import CORRECTING_DRAWS, Which, profile_ends, simulate
from palpate.analysis.choices.maximising import Fitted, Problem, best_of_starts
from palpate.analysis.choices.posterior import UP_TO_HALF, posterior_of
from palpate.analysis.choices.psychometric import refuse_no_estimate
from palpate.analysis.choices.specification import (
    FunctionSpec,
    Levels,
    Rate,
    Rates,
    Task,
    function_spec,
    problem_of,
    quantities,
    rates_of,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import stream
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.bench import Case

AREA = "thresholds"
LEVELS = np.linspace(-10.0, 10.0, 9)
THRESHOLD, SD = 1.0, 2.5
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Observer:
    """An observer with a cumulative Gaussian (`THRESHOLD`, `SD`) and these guess and lapse rates in this task."""

    name: str
    task: Task
    guess: float
    lapse: float
    alternatives: int | None = None

    def declared(self) -> Rates:
        """Return the rates declared by the task."""
        return rates_of(self.task, self.alternatives, None, None)

    def undeclared(self) -> Rates:
        """Return the rates without a declared task: fixed guess rate, lapse rate from 0 to 0.06."""
        fixed: Rate | None = None if self.alternatives is None else self.guess
        return rates_of(None, None, fixed, None)


OBSERVERS = (
    Observer("symmetric, no lapses", "symmetric", 0.0, 0.0),
    Observer("symmetric, lapses 3 %", "symmetric", 0.03, 0.03),
    Observer("symmetric, lapses 8 %", "symmetric", 0.08, 0.08),
    Observer("forced choice of 2, lapses 3 %", "forced_choice", 1 / 2, 0.03, 2),
    Observer("forced choice of 3, lapses 3 %", "forced_choice", 1 / 3, 0.03, 3),
    Observer("yes/no, false alarms 5 %, lapses 3 %", "yes_no", 0.05, 0.03),
)


class Sets(NamedTuple):
    """One observer's data sets that have an estimate: the hits (sets, levels), the fits, and the number refused."""

    function: FunctionSpec
    data: Levels
    problem: Problem
    fits: Fitted
    thresholds: Floats
    jnds: Floats
    refused: int

    def ends(self, which: Which, draws: int, seeds: Sequence[int]) -> Floats:
        """Return the ends of the profile intervals (sets, 2), with Bartlett's factor unless there are no draws."""
        simulated = simulate(self.problem, self.fits, draws, seeds) if draws else None
        return profile_ends(self.problem, self.fits, self.function, self.data, which, CONFIDENCE, simulated)


def simulated(observer: Observer, count: int, trials: int) -> Floats:
    """Return the hits (count, levels) of an observer in `trials` trials at each level."""
    share = observer.guess + (1 - observer.guess - observer.lapse) * ndtr((LEVELS - THRESHOLD) / SD)
    hits = stream(0, f"observer: {observer.name}, {trials} trials").binomial(trials, share, (count, len(LEVELS)))
    return hits.astype(np.float64)


def fitted_sets(rates: Rates, hits: Floats, trials: int) -> Sets:
    """Fit every data set at once; those that `fit_psychometric` refuses are left out and counted."""
    function = function_spec("gaussian", rates, 0.5, "x84_x50", False)
    data = Levels(LEVELS, hits[0], np.full(len(LEVELS), float(trials)))
    problem = problem_of(data, function, hits)
    fits = best_of_starts(problem)
    has_estimate = np.array([_has_estimate(data, function, problem, fits, i) for i in range(len(hits))])
    problem, fits = problem_of(data, function, hits[has_estimate]), Fitted(*(part[has_estimate] for part in fits))
    thresholds, jnds = quantities(function, data, fits.parameters)
    return Sets(function, data, problem, fits, thresholds, jnds, int((~has_estimate).sum()))


def _has_estimate(data: Levels, function: FunctionSpec, problem: Problem, fits: Fitted, i: int) -> bool:
    try:
        refuse_no_estimate(data, function, problem, fits, i)
    except StatisticsError:
        return False
    return True


def missed(ends: Floats, true: float) -> float:
    """Return the share of intervals (sets, 2) that do not hold the true value; an open end is no bound."""
    low, high = np.nan_to_num(ends[:, 0], nan=-np.inf), np.nan_to_num(ends[:, 1], nan=np.inf)
    return float(((low > true) | (high < true)).mean())


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of each observer: bias over 150 data sets, and missed intervals over 1,000 (quick: 150)."""
    for trials in (100, 40):
        for observer in OBSERVERS:
            yield from _bias(observer, trials, 150)
            yield from _bias(observer, trials, 1000) if not quick else ()
            yield from _misses(observer, trials, 150 if quick else 1000)


def _bias(observer: Observer, trials: int, count: int) -> Iterator[Case]:
    hits = simulated(observer, count, trials)
    kind = "mean threshold - true threshold, in units of the level (steps of 2.5)"
    ways = {"task declared": observer.declared(), "no task declared": observer.undeclared()}
    for name, rates in ways.items():
        yield Case(
            AREA,
            f"bias of a threshold, {count} data sets",
            f"palpate, {name}",
            f"{observer.name}; 9 levels x {trials}",
            count,
            kind,
            partial(fitted_sets, rates, hits, trials),
            lambda sets: abs(float(sets.thresholds.mean()) - THRESHOLD),
            repeats=1,
        )


def _misses(observer: Observer, trials: int, count: int) -> Iterator[Case]:
    hits = simulated(observer, count, trials)
    sets = fitted_sets(observer.declared(), hits, trials)

    def profile(which: Which, draws: int) -> Floats:
        return sets.ends(which, draws, range(len(sets.thresholds)))

    def posterior() -> Floats:
        data = sets.data
        rates = rates_of(observer.task, observer.alternatives, None, None, UP_TO_HALF)
        function = function_spec("gaussian", rates, 0.5, "x84_x50", False)
        fits = (posterior_of(Levels(data.levels, hits, data.trials), function, False) for hits in sets.problem.hits)
        return np.array([fit.threshold_interval for fit in fits])

    corrected = f"profile, Bartlett's factor from {CORRECTING_DRAWS}"
    ways: list[tuple[Which, str, Callable[[], Floats]]] = [
        ("threshold", corrected, lambda: profile("threshold", CORRECTING_DRAWS)),
        ("threshold", "profile", lambda: profile("threshold", 0)),
        ("threshold", "posterior on a grid", posterior),
        ("jnd", corrected, lambda: profile("jnd", CORRECTING_DRAWS)),
        ("jnd", "profile", lambda: profile("jnd", 0)),
    ]
    for which, name, run in ways:
        yield Case(
            AREA,
            f"95 % interval of a {'JND' if which == 'jnd' else which}",
            f"palpate, {name}",
            f"{observer.name}; 9 levels x {trials}",
            len(sets.thresholds),
            "share of intervals that miss the true value; 0.05 is right",
            partial(_clocked, run),
            _misses_of(SD if which == "jnd" else THRESHOLD),
            seconds=lambda answer: answer[1],
        )


def _misses_of(true: float) -> Callable[[tuple[Floats, float]], float]:
    return lambda answer: missed(answer[0], true)


def _clocked(run: Callable[[], Floats]) -> tuple[Floats, float]:
    """Run once, because it takes minutes; return the result and the seconds."""
    start = time.perf_counter()
    found = run()
    return found, time.perf_counter() - start
