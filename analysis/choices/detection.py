"""Sensitivity d' and criterion c by the decision model of each design, with delta-method intervals.

| design | model |
|---|---|
| yes_no | d' = z(H) - z(F), c = -(z(H) + z(F)) / 2 (Green & Swets 1966) |
| forced_choice of m | P(correct) = integral of phi(x - d') Phi(x)^(m - 1) (Hacker & Ratcliff 1979) |
| same_different, differencing | F = 2 Phi(-k / r2), H = Phi((d' - k) / r2) + Phi((-d' - k) / r2), r2 = root 2 |
| same_different, independent observation | p = Phi((z(H) - z(F)) / 2), d' = 2 z((1 + root(2 p - 1)) / 2) |
| oddity of three, differencing | P = 2 int_0 [Phi(-x r3 + d' r(2/3)) + Phi(-x r3 - d' r(2/3))] phi(x) |

Sources: same/different Kaplan, Macmillan & Creelman 1978, Macmillan & Creelman 2005, ch. 9; the triangle Frijters 1979,
Ennis 1993.

Rates of 0 and 1 have no normal deviate. The log-linear correction (Hautus 1995) adds half a hit and one trial to every
rate; among m alternatives 1 / m of a hit and one trial.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from palpate.analysis.statistics.draws import check_share
from palpate.analysis.statistics.refusals import BadOption, BadValue, NoEstimate, TooFew, shown

Design: TypeAlias = Literal["yes_no", "forced_choice", "same_different", "oddity"]
Model: TypeAlias = Literal["differencing", "independent_observation"]
Correction: TypeAlias = Literal["log_linear", "when_extreme", "none"]
MOST = 12.0
"""The highest d' that is looked for; a share of correct answers beyond it is 1 in doubles."""
NODES = 160
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(NODES)
REACH = 9.5
"""Standard deviations on both sides that an integral covers: the rest is below 1e-20."""


@dataclass(frozen=True)
class Detection:
    """The result: d' with its interval, c (None where the design has none), the rates used, whether corrected.

    `hit_rate` and `false_alarm_rate` are as used, after the correction; in designs without a false alarm the latter is
    None and `hit_rate` is the share of correct answers. `se` is by the delta method. `chance` says that the share of
    correct answers is not above chance, so that d' is 0 (or negative where the model has negative values).
    """

    dprime: float
    se: float | None
    low: float | None
    high: float | None
    criterion: float | None
    criterion_se: float | None
    hit_rate: float
    false_alarm_rate: float | None
    corrected: bool
    chance: bool
    model: str


def share_correct(dprime: float, alternatives: int) -> float:
    """Return the probability of a correct answer of an unbiased observer among `alternatives` intervals.

    The integral is by Gauss-Legendre quadrature, right to 1e-13.
    """
    x = _PLACES * REACH
    density = np.exp(-0.5 * x * x) / math.sqrt(2 * math.pi)
    return float(REACH * (_WEIGHTS @ (density * ndtr(x + dprime) ** (alternatives - 1))))


def share_odd(dprime: float) -> float:
    """Return the probability of finding the odd one of three by the largest difference (the triangle)."""
    x = (_PLACES + 1) * REACH / 2
    density = np.exp(-0.5 * x * x) / math.sqrt(2 * math.pi)
    lift = dprime * math.sqrt(2 / 3)
    both = ndtr(-x * math.sqrt(3) + lift) + ndtr(-x * math.sqrt(3) - lift)
    return float(REACH * (_WEIGHTS @ (density * both)))


def same_different_rates(dprime: float, criterion: float) -> tuple[float, float]:
    """Return the rates of "different" for different and for equal pairs by differencing; `criterion` is k."""
    root = math.sqrt(2)
    hit = float(ndtr((dprime - criterion) / root) + ndtr((-dprime - criterion) / root))
    return hit, float(2 * ndtr(-criterion / root))


def _of_yes_no(hit: float, false: float) -> tuple[float, float]:
    return float(ndtri(hit) - ndtri(false)), float(-(ndtri(hit) + ndtri(false)) / 2)


def _of_two_intervals(hit: float, false: float) -> tuple[float, float]:
    """Return d' and c of a forced choice of two: `hit` is the rate of "first" where it is right, `false` otherwise."""
    return float((ndtri(hit) - ndtri(false)) / math.sqrt(2)), float(-(ndtri(hit) + ndtri(false)) / 2)


def _of_differencing(hit: float, false: float) -> tuple[float, float]:
    criterion = float(-math.sqrt(2) * ndtri(false / 2))
    if hit <= false:
        return 0.0, criterion
    return _root(lambda d: same_different_rates(d, criterion)[0] - hit), criterion


def _of_independent(hit: float, false: float) -> tuple[float, float]:
    both = float(ndtri(hit) - ndtri(false))
    criterion = -float(ndtri(hit) + ndtri(false)) / 2
    if both <= 0:
        return 0.0, criterion
    share = float(ndtr(both / 2))
    return 2 * float(ndtri((1 + math.sqrt(2 * share - 1)) / 2)), criterion


def _root(gap: Callable[[float], float]) -> float:
    """Return the d' at which an increasing function is 0. Raises NoEstimate beyond `MOST`."""
    if gap(MOST) <= 0:
        raise NoEstimate(f"d' is above {MOST:g}: almost every answer is right; make the task harder")
    return float(brentq(gap, 0.0, MOST, xtol=1e-13, rtol=1e-14))


def dprime_of_share(share: float, design: Design, alternatives: int) -> float:
    """Return d' of a share of correct answers of an unbiased observer; 0 at chance or below."""
    expected: Callable[[float], float] = (
        share_odd if design == "oddity" else lambda value: share_correct(value, alternatives)
    )
    return 0.0 if share <= 1 / alternatives else _root(lambda value: expected(value) - share)


PAIRS: Mapping[str, Callable[[float, float], tuple[float, float]]] = {
    "yes_no": _of_yes_no,
    "two_intervals": _of_two_intervals,
    "differencing": _of_differencing,
    "independent_observation": _of_independent,
}
"""The functions of two rates, by model."""


def corrected_rate(hits: float, trials: float, chance: float, correction: Correction) -> tuple[float, bool]:
    """Return a rate, and whether it was corrected. Raises NoEstimate for 0 or 1 without a correction."""
    if correction == "log_linear":
        return (hits + chance) / (trials + 1), True
    if 0 < hits < trials:
        return hits / trials, False
    if correction == "when_extreme":
        return (chance if hits == 0 else trials - (1 - chance)) / trials, True
    raise NoEstimate(f"{hits:g} of {trials:g} answers: a rate of 0 or 1 has no d'; choose a correction")


def detection_of_pairs(
    hits: float,
    signals: float,
    false_alarms: float,
    noises: float,
    *,
    model: str,
    correction: Correction = "log_linear",
    confidence: float = 0.95,
) -> Detection:
    """Return d' and c of counts of two kinds of trials; `model` is a key of `PAIRS`.

    Raises TooFew where a kind of trial is missing, BadValue for counts that are none, BadOption, NoEstimate.
    """
    check_share(confidence, "confidence")
    _check_correction(correction)
    if model not in PAIRS:
        raise BadOption(f"model={shown(model)} is unknown: {', '.join(map(repr, PAIRS))}")
    for name, count, trials in (("signal", hits, signals), ("noise", false_alarms, noises)):
        if trials < 1:
            raise TooFew(f"no {name} trial; d' needs trials with and without a signal (or difference)")
        if not 0 <= count <= trials:
            raise BadValue(f"{count:g} answers in {trials:g} {name} trials")
    hit, fixed = corrected_rate(hits, signals, 0.5, correction)
    false, too = corrected_rate(false_alarms, noises, 0.5, correction)
    of = PAIRS[model]
    dprime, criterion = of(hit, false)
    variances = (hit * (1 - hit) / signals, false * (1 - false) / noises)
    chance = hit <= false
    ses: list[float | None] = [*_delta(of, (hit, false), variances)]
    if chance and model in ("differencing", "independent_observation"):
        ses[0] = None  # the likelihood is flat there: no normal interval
    return _detection(dprime, ses, criterion, (hit, false), fixed or too, chance, model, confidence)


def detection_of_share(
    correct: float,
    trials: float,
    *,
    design: Design,
    alternatives: int,
    correction: Correction = "log_linear",
    confidence: float = 0.95,
) -> Detection:
    """Return d' of a count of correct answers in a forced choice or an oddity task. Raises as for pairs."""
    check_share(confidence, "confidence")
    _check_correction(correction)
    if design not in ("forced_choice", "oddity"):
        raise BadOption(f"design={shown(design)}: 'forced_choice' or 'oddity' has a share of correct answers")
    if alternatives < 2 or (design == "oddity" and alternatives != 3):
        most = "three: the triangle" if design == "oddity" else "two or more"
        raise BadOption(f"alternatives={alternatives}: the decision model is known for {most}")
    if trials < 1:
        raise TooFew("no trial; d' needs one or more")
    if not 0 <= correct <= trials:
        raise BadValue(f"{correct:g} correct answers in {trials:g} trials")
    chance = 1 / alternatives
    share, fixed = corrected_rate(correct, trials, chance, correction)
    dprime = dprime_of_share(share, design, alternatives)
    se = None
    if dprime > 0:
        expected: Callable[[float], float] = (
            share_odd if design == "oddity" else lambda value: share_correct(value, alternatives)
        )
        step = 1e-4
        slope = (expected(dprime + step) - expected(dprime - step)) / (2 * step)
        se = math.sqrt(share * (1 - share) / trials) / slope
    name = "triangle, differencing" if design == "oddity" else f"forced choice of {alternatives}, unbiased"
    return _detection(dprime, [se, None], None, (share, None), fixed, share <= chance, name, confidence)


def _check_correction(correction: str) -> None:
    if correction not in get_args(Correction):
        raise BadOption(f"correction={shown(correction)} is unknown: {', '.join(map(repr, get_args(Correction)))}")


def _delta(
    of: Callable[[float, float], tuple[float, float]], at: tuple[float, float], variances: tuple[float, float]
) -> tuple[float, float]:
    """Return the standard errors of both values of a function of two independent rates, by central differences."""
    total = [0.0, 0.0]
    for i, (place, variance) in enumerate(zip(at, variances, strict=True)):
        step = 1e-5 * min(place, 1 - place)
        up, down = list(at), list(at)
        up[i] += step
        down[i] -= step
        ends = zip(of(up[0], up[1]), of(down[0], down[1]), strict=True)
        for k, (high, low) in enumerate(ends):
            total[k] += ((high - low) / (2 * step)) ** 2 * variance
    return math.sqrt(total[0]), math.sqrt(total[1])


def _detection(
    dprime: float,
    ses: list[float | None],
    criterion: float | None,
    rates: tuple[float, float | None],
    corrected: bool,
    chance: bool,
    model: str,
    confidence: float,
) -> Detection:
    half = None if ses[0] is None else float(ndtri((1 + confidence) / 2)) * ses[0]
    low, high = (None, None) if half is None else (dprime - half, dprime + half)
    return Detection(dprime, ses[0], low, high, criterion, ses[1], rates[0], rates[1], corrected, chance, model)
