"""The relevance of each word by a named normalisation, with an interval and the probability that it is kept again."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri

from palpate.analysis.adjectives.selections import Selections
from palpate.analysis.reliability.intraclass import demand_confidence
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import demand_draws, generator, percentile, refuse_without_draws, weights
from palpate.analysis.statistics.refusals import BadOption, TooFew, shown

Interval: TypeAlias = Literal["percentile", "bca"]
INTERVALS = ("percentile", "bca")
Normalisation: TypeAlias = Literal["share_of_trials", "share_of_maximum", "any_stimulus"]
Scored: TypeAlias = Callable[[Floats], Floats]
"""A function from weights of the participants (draws, participants) to the relevance of each word (draws, words)."""


def relevance(
    selections: Selections,
    normalisation: Normalisation,
    threshold: float,
    *,
    draws: int = 2000,
    seed: int = 0,
    interval: Interval = "percentile",
    confidence: float = 0.95,
) -> pd.DataFrame:
    """Return the relevance of every word, most relevant first (ties as offered), and whether it reaches the threshold.

    `normalisation` is "share_of_trials" (ticks over answered trials), "share_of_maximum" (ticks over those of the word
    with most) or "any_stimulus" (the largest share, over stimuli, of the people who saw the stimulus and ticked the
    word). Columns: word, ticks, participants and stimuli (for how many it was ticked), relevance, ci_low, ci_high,
    kept, kept_chance (the share of draws in which it is kept), note. Participants are drawn with replacement; `draws=0`
    leaves intervals out. Raises BadOption or TooFew (nobody ticked anything, for a share of the maximum).
    """
    kinds: Mapping[str, Callable[[Selections], Scored]] = {
        "share_of_trials": _share_of_trials,
        "share_of_maximum": _share_of_maximum,
        "any_stimulus": _any_stimulus,
    }
    if not isinstance(normalisation, str) or normalisation not in kinds:
        raise BadOption(f"normalisation={shown(normalisation)} is unknown: one of {', '.join(map(repr, kinds))}")
    if not selections.words:
        raise TooFew("no words: nothing was offered and nothing was ticked")
    scored = kinds[normalisation](selections)
    if isinstance(threshold, bool) or not isinstance(threshold, int | float) or not 0 < threshold <= 1:
        raise BadOption(f"threshold={shown(threshold)}: a share above 0, at most 1, is expected, such as 0.5")
    demand_draws(draws)
    demand_interval(interval)
    demand_confidence(confidence)
    idle = {"seed": (seed, 0), "interval": (interval, "percentile"), "confidence": (confidence, 0.95)}
    refuse_without_draws(draws, **idle)
    n = len(selections.participants)
    observed = scored(np.ones((1, n)))[0]
    drawn = np.empty((0, len(observed)))
    if draws and n > 1:
        drawn = np.concatenate([scored(batch) for batch in weights(generator(seed, "relevance"), n, draws, 100)])
    limits = [(math.nan, math.nan)] * len(observed)
    if len(drawn) and interval == "percentile":
        limits = [percentile(column, confidence) for column in drawn.T]
    elif len(drawn):
        jackknife = np.concatenate([scored(block) for block in np.array_split(left_out(n), max(1, n // 100))])
        parts = zip(observed.tolist(), drawn.T, jackknife.T, strict=True)
        limits = [bca(estimate, column, others, confidence) for estimate, column, others in parts]
    table = pd.DataFrame(_rows(selections, observed, drawn, limits, threshold))
    table = table.sort_values("relevance", ascending=False, kind="stable", ignore_index=True)
    sizes = {"participants": len(selections.participants), "stimuli": len(selections.stimuli)}
    table.attrs.update({**sizes, "trials": selections.trials, "normalisation": normalisation, "threshold": threshold})
    table.attrs.update({"draws": len(drawn), "seed": seed, "interval": interval, "confidence": confidence})
    return table


def _share_of_trials(selections: Selections) -> Scored:
    ticks, trials = (
        selections.ticked.sum(axis=1).astype(np.float64),
        selections.presented.sum(axis=1).astype(np.float64),
    )
    return lambda w: (w @ ticks) / (w @ trials)[:, None]


def _share_of_maximum(selections: Selections) -> Scored:
    ticks = selections.ticked.sum(axis=1).astype(np.float64)
    if not ticks.any():
        raise TooFew("no word was ticked, so there is no largest number of ticks to divide by")

    def scored(w: Floats) -> Floats:
        total = w @ ticks
        most = total.max(axis=1, keepdims=True)
        shares: Floats = np.divide(total, most, out=np.full_like(total, np.nan), where=most > 0)
        return shares

    return scored


def _any_stimulus(selections: Selections) -> Scored:
    n, stimuli, words = selections.ticked.shape
    ticked, presented = selections.any_ticked.reshape(n, -1), (selections.presented > 0).astype(np.float64)

    def scored(w: Floats) -> Floats:
        who = (w @ presented)[:, :, None]
        share = np.divide(
            (w @ ticked).reshape(-1, stimuli, words), who, out=np.zeros((len(w), stimuli, words)), where=who > 0
        )
        return np.asarray(share.max(axis=1))

    return scored


def _rows(
    selections: Selections, observed: Floats, drawn: Floats, limits: list[tuple[float, float]], threshold: float
) -> Iterator[dict[str, Any]]:
    for i, word in enumerate(selections.words):
        ticked, (low, high), note = selections.ticked[:, :, i], limits[i], ""
        if not len(drawn):
            alone = len(selections.participants) < 2
            note = "no interval: it needs two participants or more" if alone else "no interval was requested"
        elif not ticked.any():
            note = "never ticked: every draw gives 0"
        elif math.isnan(low):
            note = "no interval: the draws lie on one side of the estimate; use percentile"
        yield {
            **{"word": word, "ticks": int(ticked.sum())},
            "participants": int(ticked.any(axis=1).sum()),
            "stimuli": int(ticked.any(axis=0).sum()),
            **{"relevance": float(observed[i]), "ci_low": low, "ci_high": high, "kept": bool(observed[i] >= threshold)},
            "kept_chance": float((drawn[:, i] >= threshold).mean()) if len(drawn) else math.nan,
            "note": note,
        }


def demand_interval(interval: object) -> None:
    """Refuse an unknown kind of interval."""
    if interval not in INTERVALS:
        raise BadOption(f"interval={shown(interval)} is unknown: 'percentile' or 'bca'")


def left_out(units: int) -> Floats:
    """Return the weights of a jackknife, whose rows leave out one unit each."""
    jackknife: Floats = np.ones((units, units)) - np.eye(units)
    return jackknife


def bca(estimate: float, drawn: Floats, jackknife: Floats, confidence: float) -> tuple[float, float]:
    """Return the bias-corrected and accelerated interval; NaN where all draws are on one side of the estimate.

    Draws equal to the estimate count half on either side, as shares of few people are often equal.
    Source: Efron & Tibshirani 1993, ch. 14.
    """
    defined = drawn[~np.isnan(drawn)]
    if not len(drawn) or 2 * len(defined) < len(drawn) or math.isnan(estimate) or np.isnan(jackknife).any():
        return math.nan, math.nan
    if defined.min() == defined.max() == estimate:
        return estimate, estimate
    below = (np.count_nonzero(defined < estimate) + np.count_nonzero(defined == estimate) / 2) / len(defined)
    if not 0 < below < 1:
        return math.nan, math.nan
    bias, tail = float(ndtri(below)), (1 - confidence) / 2
    spread = jackknife.mean() - jackknife
    square = float((spread**2).sum())
    faster = float((spread**3).sum()) / (6 * square**1.5) if square > 0 else 0.0
    ends = []
    for z in (float(ndtri(tail)), -float(ndtri(tail))):
        shifted = bias + z
        ends.append(float(ndtr(bias + shifted / (1 - faster * shifted))))
    low, high = np.quantile(defined, sorted(ends))
    return float(low), float(high)
