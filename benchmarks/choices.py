"""Figures of procedures that choose levels: time of a choice, and how far thresholds lie from a simulated observer's.

All methods see the same random numbers: an observer's n-th answer is drawn by its seed and n alone.
"""

from __future__ import annotations

import math
import random
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from importlib.util import find_spec
from statistics import median
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.choices.declared_model import DeclaredModel, model_posterior
from palpate.analysis.choices.posterior import UP_TO_HALF, posterior_of
from palpate.analysis.choices.specification import Levels, function_spec, gather_levels, rates_of
from palpate.protocols.bench import Case
from palpate.protocols.procedures import QuestPlus, procedures_from
from palpate.protocols.study import Stimulus
from palpate.protocols.tracks import Past, Track
from palpate.studies.procedures.adviser import Adviser, End, Estimate, adviser_for

AREA = "choices"
THRESHOLD, SLOPE, GUESS, LAPSE = -18.0, 3.0, 0.5, 0.02
LOW, HIGH = -40, 0
GRID = {"column": "level_db", "from": LOW, "to": HIGH, "points": 41}
LAPSES = {"lapses to .04": [0, 0.02, 0.04], "lapses to .2": [0, 0.02, 0.04, 0.08, 0.12, 0.16, 0.2]}


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases: times of choices, then errors of thresholds over many observers."""
    yield from _times(quick)
    yield from _errors(quick)


def track(lapses: Sequence[float], trials: int, **changes: Any) -> Track:
    """Return a track of QUEST+ on 41 levels, with 41 x 20 x 3 combinations of parameters for three lapse rates."""
    model = {
        "shape": "weibull", "scale": "db", "threshold": {"from": -40, "to": 0, "points": 41},
        "slope": {"from": 0.5, "to": 10, "points": 20}, "guess": GUESS, "lapse": list(lapses),
    }  # fmt: skip
    settings = {"kind": "questplus", "level": GRID, "model": model, "stop": {"trials": trials}, **changes}
    return _track(settings)


def staircase() -> Track:
    """Return a staircase, 2 down and 1 up, of 8 reversals."""
    return _track({
        "kind": "staircase", "level": GRID, "start": -10, "down": 2, "step": [4, 2, 1], "last": 6,
        "stop": {"trials": 400, "reversals": 8},
    })  # fmt: skip


def _track(settings: dict[str, Any]) -> Track:
    [procedure] = procedures_from(settings)
    return Track("track", procedure, procedure.grids[0].levels, (Stimulus(id="track"),), ("bench",))


def share(level: float) -> float:
    """Return the observer's share of hits: a Weibull function in dB."""
    return GUESS + (1 - GUESS - LAPSE) * (1 - math.exp(-(10 ** (SLOPE * (level - THRESHOLD) / 20))))


def draws(seed: int, count: int) -> list[float]:
    """Return the random numbers of an observer's answers."""
    chance = random.Random(f"observer {seed}")
    return [chance.random() for _ in range(count)]


@dataclass(frozen=True)
class Choices:
    """The choices of a track: their times, and how much less the chosen levels tell than the best, in nats."""

    seconds: list[float]
    losses: list[float]


def palpate_choices(count: int, resumed: bool) -> Choices:
    """Make the choices of one track; `resumed`: each by a new adviser, as after an interruption."""
    of = track(LAPSES["lapses to .04"], 1000)
    adviser, answers = adviser_for(of), draws(1, count)
    past: Past = ()
    times, losses = [], []
    for number in range(count):
        if resumed:
            adviser = adviser_for(of)
        start = time.perf_counter()
        step = adviser.advise(past)
        times.append(time.perf_counter() - start)
        if isinstance(step, End):
            break
        losses.append(getattr(adviser, "loss")(past, step.index))  # noqa: B009
        past = (*past, (step.index, answers[number] < share(of.levels[step.index])))  # type: ignore[arg-type]
    return Choices(times, losses)


def questplus_choices(count: int) -> Choices:
    """Make the choices of the same track by questplus."""
    of = track(LAPSES["lapses to .04"], 1000)
    reference, ours = questplus_of(LAPSES["lapses to .04"]), adviser_for(of)
    answers = draws(1, count)
    past: Past = ()
    times, losses = [], []
    for number in range(count):
        start = time.perf_counter()
        level = float(reference.next_stim["intensity"])
        times.append(time.perf_counter() - start)
        index = of.levels.index(level)
        losses.append(getattr(ours, "loss")(past, index))  # noqa: B009
        hit = answers[number] < share(level)
        start = time.perf_counter()
        reference.update(stim={"intensity": level}, outcome={"response": "Correct" if hit else "Incorrect"})
        times[-1] += time.perf_counter() - start
        past = (*past, (index, hit))
    return Choices(times, losses)


def questplus_of(lapses: Sequence[float]) -> Any:
    """Return questplus' QuestPlus with the same grid, model and prior."""
    from questplus import QuestPlus

    return QuestPlus(
        stim_domain={"intensity": np.linspace(-40, 0, 41)},
        param_domain={
            "threshold": np.linspace(-40, 0, 41), "slope": np.linspace(0.5, 10, 20), "lower_asymptote": [GUESS],
            "lapse_rate": list(lapses),
        },
        outcome_domain={"response": ["Correct", "Incorrect"]},
        func="weibull", stim_scale="dB", stim_selection_method="min_entropy", param_estimation_method="mean",
    )  # fmt: skip


def _of_times(statistic: Callable[[list[float]], float], made: Choices) -> float:
    return statistic(made.seconds)


def _times(quick: bool) -> Iterator[Case]:
    count = 50 if quick else 200
    statistics: dict[str, Callable[[list[float]], float]] = {"median": median, "worst": max}
    methods: dict[str, Callable[[], Choices]] = {
        "palpate": partial(palpate_choices, count, False),
        "palpate, after a resume each": partial(palpate_choices, count, True),
    }
    if find_spec("questplus") is not None:
        methods["questplus"] = partial(questplus_choices, count)
    yield Case(
        AREA, "choices: the table of a track, arranged once before its first trial", "palpate", "41 x 2460", 1,
        "none", arranged, lambda _made: 0.0, seconds=float,
    )  # fmt: skip
    for method, run in methods.items():
        once = cache(run)
        for name, of in statistics.items():
            yield Case(
                AREA, f"choices: time of a choice, {name}", method, f"41 x 2460, trials 1 to {count}", count,
                "nats less than the best level, at most", once, lambda made: max(made.losses),
                seconds=partial(_of_times, of),
            )  # fmt: skip


def arranged() -> float:
    """Return the seconds in which an adviser arranges its table, once in a run, before the first trial."""
    start = time.perf_counter()
    adviser_for(track(LAPSES["lapses to .04"], 1000))
    return time.perf_counter() - start


@dataclass(frozen=True)
class Thresholds:
    """Estimates of many observers, with the share of 95 % intervals that hold, and the seconds of all."""

    errors: list[float]
    covered: float | None
    seconds: float


def estimated(of: Track, trials: int, observers: int) -> Thresholds:
    """Run a track for each observer and estimate its threshold; those without a number count by the nearest bound."""
    start, adviser = time.perf_counter(), adviser_for(of)
    estimates = [adviser.estimate(_ran(adviser, of, trials, seed)) for seed in range(observers)]
    intervals = [estimate.interval for estimate in estimates if estimate.interval is not None]
    held = sum(low <= THRESHOLD <= high for low, high in intervals)
    target = level_of(of)
    return Thresholds(
        [_number(estimate) - target for estimate in estimates],
        held / observers if intervals else None,
        time.perf_counter() - start,
    )


def level_of(of: Track) -> float:
    """Return the level that a track estimates: the threshold, or that of a staircase's share of hits."""
    target: float | None = getattr(of.procedure, "target", None)
    if target is None:
        return THRESHOLD
    rise = (target - GUESS) / (1 - GUESS - LAPSE)
    return THRESHOLD + 20 / SLOPE * math.log10(-math.log(1 - rise))


def _number(estimate: Estimate) -> float:
    for value in (estimate.threshold, estimate.bound):
        if value is not None:
            return value
    return (LOW + HIGH) / 2


def _ran(adviser: Adviser, of: Track, trials: int, seed: int) -> Past:
    past: Past = ()
    for draw in draws(seed, trials):
        step = adviser.advise(past)
        if isinstance(step, End):
            break
        past = (*past, (step.index, draw < share(of.levels[step.index])))  # type: ignore[arg-type]
    return past


def psychopy_staircase(trials: int, observers: int) -> Thresholds:
    """Run PsychoPy's StairHandler by the same rule, steps, start and reversals, and average its last six."""
    from psychopy.data import StairHandler

    start, errors = time.perf_counter(), []
    target = level_of(staircase())
    for seed in range(observers):
        stair = StairHandler(
            startVal=-10, nReversals=8, stepSizes=[4, 2, 1], stepType="lin", nTrials=0, nUp=1, nDown=2, minVal=-40,
            maxVal=0, applyInitialRule=False,
        )  # fmt: skip
        for level, draw in zip(stair, draws(seed, trials), strict=False):
            stair.addResponse(int(draw < share(level)))
        errors.append(float(np.mean(stair.reversalIntensities[-6:])) - target)
    return Thresholds(errors, None, time.perf_counter() - start)


def questplus_thresholds(trials: int, observers: int) -> Thresholds:
    """Run questplus for each observer."""
    start, errors = time.perf_counter(), []
    for seed in range(observers):
        reference = questplus_of(LAPSES["lapses to .04"])
        for draw in draws(seed, trials):
            level = float(reference.next_stim["intensity"])
            hit = draw < share(level)
            reference.update(stim={"intensity": level}, outcome={"response": "Correct" if hit else "Incorrect"})
        errors.append(float(reference.param_estimate["threshold"]) - THRESHOLD)
    return Thresholds(errors, None, time.perf_counter() - start)


def _errors(quick: bool) -> Iterator[Case]:
    observers = 20 if quick else 500
    for trials in (32,) if quick else (32, 64, 128):
        methods: dict[str, Callable[[], Thresholds]] = {
            f"palpate, {name}": partial(estimated, track(lapses, 1000), trials, observers)
            for name, lapses in LAPSES.items()
        }
        nuisance = track(LAPSES["lapses to .04"], 1000, interest=["threshold"])
        methods["palpate, slope and lapse averaged out"] = partial(estimated, nuisance, trials, observers)
        if find_spec("questplus") is not None:
            few = 5 if quick else 20
            methods["questplus, first observers only"] = partial(questplus_thresholds, trials, few)
            methods["palpate, first observers only"] = partial(
                estimated, track(LAPSES["lapses to .04"], 1000), trials, few
            )
        yield from _rows(methods, f"{trials} trials")
        yield from _rows(_fits(trials, 3 if quick else 20), f"{trials} trials, fitted afterwards")
    stairs: dict[str, Callable[[], Thresholds]] = {"palpate": partial(estimated, staircase(), 400, observers)}
    if find_spec("psychopy") is not None:
        stairs["PsychoPy StairHandler"] = partial(psychopy_staircase, 400, observers)
    yield from _rows(stairs, "2 down 1 up, 8 reversals", intervals=False)


Fit = Callable[[Levels], tuple[float, tuple[float, float]]]
"""A threshold in dB and its interval from counted answers at levels in dB."""


def fitted(fit: Fit, trials: int, observers: int) -> Thresholds:
    """Fit the answers of QUEST+ tracks; the time is that of the fits."""
    of, seconds = track(LAPSES["lapses to .04"], 1000), 0.0
    adviser, made = adviser_for(of), []
    for seed in range(observers):
        past = _ran(adviser, of, trials, seed)
        answers = pd.DataFrame([(of.levels[index], float(hit)) for index, hit in past], columns=["level", "correct"])
        counted = gather_levels(answers, "level", "correct", None)
        start = time.perf_counter()
        made.append(fit(counted))
        seconds += time.perf_counter() - start
    held = sum(low <= THRESHOLD <= high for _, (low, high) in made)
    return Thresholds([threshold - THRESHOLD for threshold, _ in made], held / observers, seconds)


def _fits(trials: int, observers: int) -> dict[str, Callable[[], Thresholds]]:
    fits: dict[str, Fit] = {"palpate, model of the study": _by_model, "palpate, prior of the levels": _by_levels}
    if find_spec("psignifit") is not None:
        fits["psignifit"] = _by_psignifit
    return {name: partial(fitted, fit, trials, observers) for name, fit in fits.items()}


def _by_model(counted: Levels) -> tuple[float, tuple[float, float]]:
    of = track(LAPSES["lapses to .04"], 1000)
    if not isinstance(of.procedure, QuestPlus):
        raise TypeError(of.procedure.kind)
    model = DeclaredModel(of.procedure.model, of.procedure.grids[0].levels, chance=GUESS)
    hits = [[1.0] * int(k) + [0.0] * int(n - k) for k, n in zip(counted.hits, counted.trials, strict=True)]
    levels = np.repeat(counted.levels, counted.trials.astype(int))
    estimate = model_posterior(model, levels, np.concatenate(hits)).estimate()
    return _number(estimate), estimate.interval or (float("nan"), float("nan"))


def _by_levels(counted: Levels) -> tuple[float, tuple[float, float]]:
    rates = rates_of("forced_choice", 2, None, None, UP_TO_HALF)
    fit = posterior_of(counted, function_spec("weibull_db", rates, 1 - math.exp(-1), "half_interquartile", False))
    return fit.threshold, fit.threshold_interval


def _by_psignifit(counted: Levels) -> tuple[float, tuple[float, float]]:
    from psignifit import psignifit

    data = np.column_stack([10 ** (counted.levels / 20), counted.hits, counted.trials])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that the threshold is not at F = .5
        fit = psignifit(data, sigmoid="weibull", experiment_type="2AFC", thresh_PC=1 - math.exp(-1))
    ends = fit.confidence_intervals["threshold"]["0.95"]
    low, high = (20 * math.log10(end) if end > 0 else -math.inf for end in ends)
    return 20 * math.log10(fit.parameter_estimate_mean["threshold"]), (low, high)


def _off_coverage(made: Thresholds) -> float | None:
    return None if made.covered is None else abs(made.covered - 0.95)


def _rows(methods: dict[str, Callable[[], Thresholds]], what: str, intervals: bool = True) -> Iterator[Case]:
    kinds: dict[str, Callable[[Thresholds], float | None]] = {
        "bias, dB": lambda made: abs(float(np.mean(made.errors))),
        "SD, dB": lambda made: float(np.std(made.errors)),
        "RMS error, dB": lambda made: float(np.sqrt(np.mean(np.square(made.errors)))),
    }
    if intervals:
        kinds["share of 95 % intervals off .95"] = _off_coverage
    for method, run in methods.items():
        once = cache(run)
        for kind, error in kinds.items():
            yield Case(
                AREA, f"choices: thresholds of {what}", method, "2IFC, threshold -18 dB, slope 3, lapse .02", 1, kind,
                once, error, seconds=lambda made: made.seconds,
            )  # fmt: skip
