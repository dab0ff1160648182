"""Drift of ratings and response times over a session, and carry-over from the previous stimulus."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.one_sample import OneSample, one_sample
from palpate.analysis.ratings.person_cells import written
from palpate.analysis.statistics.cells import check_columns, coded, numbers_of
from palpate.analysis.statistics.doubles import ROUNDING_ULPS, Floats
from palpate.analysis.statistics.refusals import BadOption

Adjust: TypeAlias = Literal["stimulus", "none"]
Codes: TypeAlias = NDArray[np.intp]
ROUNDS = 500
SETTLED = 1e-13


@dataclass(frozen=True)
class Bin:
    """Trials `first` to `last`: the mean over `n` participants of their means there.

    `low` and `high` are Cousineau and Morey's within-participant interval over the bins, NaN if undefined.
    """

    first: int
    last: int
    n: int
    mean: float
    low: float
    high: float


@dataclass(frozen=True)
class OrderEffect:
    """The course of one measure over a session: bins, and the mean over participants of their slopes per trial.

    `carry_over` is the mean slope on the previous stimulus' mean, None if not requested.
    """

    bins: tuple[Bin, ...]
    slope: OneSample
    carry_over: OneSample | None
    adjusted: bool


@dataclass(frozen=True)
class _Trials:
    """One row per value: participant, stimulus, position in the session."""

    y: Floats
    people: Codes
    stimuli: Codes
    position: Floats
    session: Codes


def order_effect(
    data: pd.DataFrame,
    dv: str = "value",
    *,
    subject: str = "participant",
    stimulus: str = "stimulus",
    position: str = "trial",
    session: str = "session",
    bins: int = 9,
    adjust: Adjust = "stimulus",
    carry_over: bool = False,
    confidence: float = 0.95,
) -> OrderEffect:
    """Return the dependence of a measure on the trial's place in the session, with one value per trial.

    With `adjust="stimulus"`, y = participant + stimulus + b position is fitted by least squares first, and the effect
    of the stimulus (centred on 0) is subtracted: so that balanced and random orders are treated equally. Then each
    participant's slope over positions is computed; its mean has Student's interval over participants. Bins have equal
    numbers of positions, which count the existing trials of each session from 1. `carry_over` adds each participant's
    slope of the adjusted values on the effect of the previous stimulus. Raises DataRefused if everyone had the stimuli
    in the same order (position and stimulus are then the same thing), BadOption, UnknownColumn, BadValue.
    """
    check_columns(data, [dv, subject, stimulus, position])
    if bins < 1:
        raise BadOption(f"bins={bins}: at least 1 is expected")
    if adjust not in ("stimulus", "none"):
        raise BadOption(f"adjust={adjust!r} is unknown: 'stimulus' or 'none'")
    if carry_over and adjust == "none":
        raise BadOption("carry_over needs adjust='stimulus': what a stimulus does must be known to leave a trace")
    trials = _trials(data, dv, subject, stimulus, position, session)
    y, effects = _adjusted(trials) if adjust == "stimulus" else (trials.y, np.zeros(int(trials.stimuli.max()) + 1))
    floor = ROUNDING_ULPS * float(np.spacing(np.abs(trials.y).max()))
    slopes = _slopes(y, trials.position, trials.people)
    span = float(np.ptp(trials.position))
    slope = one_sample(slopes, floor=floor / span if span else 0.0, confidence=confidence, what="slopes")
    return OrderEffect(
        tuple(_bins(y, trials, bins, confidence)),
        slope,
        _carried(y, trials, effects, confidence) if carry_over else None,
        adjust == "stimulus",
    )


def _trials(data: pd.DataFrame, dv: str, subject: str, stimulus: str, position_column: str, session: str) -> _Trials:
    y = numbers_of(data[dv], dv)
    place = numbers_of(data[position_column], position_column)
    people = coded(data[subject], subject).codes
    stimuli = coded(data[stimulus], stimulus).codes
    sessions = coded(data[session], session).codes if session in data.columns else people
    usable = np.flatnonzero(~np.isnan(y) & ~np.isnan(place))
    if not len(usable):
        raise DataRefused(f"no trial has both a place and a value in column {dv!r}")
    order = usable[np.lexsort((y[usable], stimuli[usable], place[usable], sessions[usable], people[usable]))]
    _, dense = np.unique(stimuli[order], return_inverse=True)
    _, who = np.unique(people[order], return_inverse=True)
    # 1, 2, 3 ... within each session of each participant; several values of one trial share a place.
    place, sessions = place[order], sessions[order]
    position, count = np.empty(len(place)), 0.0
    for i in range(len(place)):
        new = i == 0 or who[i] != who[i - 1] or sessions[i] != sessions[i - 1]
        count = 1.0 if new else count + (place[i] != place[i - 1])
        position[i] = count
    return _Trials(y[order], who, dense, position, sessions)


def _two_way(y: Floats, people: Codes, stimuli: Codes) -> tuple[Floats, Floats]:
    """Return y without additive participants and stimuli, and the stimuli's effects (by alternating means)."""
    n_people, n_stimuli = np.bincount(people), np.bincount(stimuli)
    rest, effects = y - y.mean(), np.zeros(len(n_stimuli))
    scale = float(np.abs(rest).max())
    for _ in range(ROUNDS):
        rest = rest - (np.bincount(people, rest) / n_people)[people]
        step = np.bincount(stimuli, rest) / n_stimuli
        effects += step
        rest = rest - step[stimuli]
        if float(np.abs(step).max()) <= SETTLED * scale:
            break
    return rest, effects


def _adjusted(trials: _Trials) -> tuple[Floats, Floats]:
    """Return y without the stimuli's effects, fitted with participants and a common slope (Frisch & Waugh 1933)."""
    free, shift = _two_way(trials.position, trials.people, trials.stimuli)
    around = trials.position - trials.position.mean()
    if math.fsum(free * free) <= 1e-9 * math.fsum(around * around):
        raise DataRefused(
            "all participants had the stimuli in the same order: effects of the position cannot be separated from"
            " those of the stimuli; show it with adjust: none"
        )
    rest, effects = _two_way(trials.y, trials.people, trials.stimuli)
    slope = math.fsum(free * rest) / math.fsum(free * free)
    effects = effects - slope * shift
    sizes = np.bincount(trials.stimuli)
    effects = effects - math.fsum(effects * sizes) / math.fsum(sizes)
    return trials.y - effects[trials.stimuli], effects


def _slopes(y: Floats, x: Floats, people: Codes) -> Floats:
    """Return the least-squares slope of every participant; NaN if all their x are equal."""
    n = np.bincount(people)
    away = x - (np.bincount(people, x) / n)[people]
    change = y - y[np.unique(people, return_index=True)[1]][people]
    change = change - (np.bincount(people, change) / n)[people]
    below = np.bincount(people, away * away)
    above = np.bincount(people, away * change)
    slopes: Floats = np.full(len(n), np.nan)
    known = below > 0
    slopes[known] = above[known] / below[known]
    return slopes


def _bins(y: Floats, trials: _Trials, bins: int, confidence: float) -> list[Bin]:
    last = int(trials.position.max())
    number = min(bins, last)
    edges = [round(last * k / number) for k in range(number + 1)]
    which = np.searchsorted(np.array(edges[1:]), trials.position, side="left")
    flat = trials.people * number + which
    counts = np.bincount(flat, minlength=(int(trials.people.max()) + 1) * number).reshape(-1, number)
    totals = np.bincount(flat, y, minlength=counts.size).reshape(counts.shape)
    means = np.full(counts.shape, np.nan)
    np.divide(totals, counts, out=means, where=counts > 0)
    own = means - np.nanmean(means, axis=1, keepdims=True)
    factor = math.sqrt(number / (number - 1)) if number > 1 else math.nan
    result = []
    for j, (low, high) in enumerate(pairwise(edges)):
        whole, within = one_sample(means[:, j]), one_sample(own[:, j] * factor, confidence=confidence)
        half = (within.high - within.low) / 2
        result.append(Bin(low + 1, high, whole.n, whole.mean, whole.mean - half, whole.mean + half))
    return result


def _carried(y: Floats, trials: _Trials, effects: Floats, confidence: float) -> OneSample:
    """Return each participant's slope on the effect of the previous trial's stimulus, within a session."""
    follows = np.flatnonzero(
        (trials.people[1:] == trials.people[:-1])
        & (trials.session[1:] == trials.session[:-1])
        & (trials.position[1:] == trials.position[:-1] + 1)
    )
    if not len(follows):
        return one_sample(np.array([]), confidence=confidence)
    _, who = np.unique(trials.people[follows + 1], return_inverse=True)
    sample = one_sample(_slopes(y[follows + 1], effects[trials.stimuli[follows]], who), confidence=confidence)
    return sample if sample.n else sample._replace(note="no stimulus has an effect")


def one_per_trial(data: pd.DataFrame, keys: Sequence[str], dv: str) -> pd.DataFrame:
    """Return one row per trial with the largest `dv`: the time at which the last of its attributes was answered."""
    values: dict[tuple[str, ...], float] = {}
    columns = [[written(label) for label in data[key].tolist()] for key in keys]
    for *label, value in zip(*columns, numbers_of(data[dv], dv).tolist(), strict=True):
        if not math.isnan(value):
            values[tuple(label)] = max(value, values.get(tuple(label), value))
    return pd.DataFrame([(*label, value) for label, value in values.items()], columns=[*keys, dv])
