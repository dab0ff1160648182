"""Answers at levels of a stimulus, counted; and the ways in which they can fail to tell a threshold."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import xlogy

from palpate.analysis.choices.existing import NoEstimate
from palpate.analysis.statistics.cells import check_columns
from palpate.analysis.statistics.column_values import numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadValue, TooFew, listed

ALIKE = 1e-6  # log likelihoods closer than this are one
Bounds = tuple[float, float]


@dataclass(frozen=True)
class Levels:
    """`levels` ascending and distinct, `trials` at each, `hits` (correct, or "yes") among them."""

    levels: Floats
    hits: Floats
    trials: Floats


def gather_levels(data: pd.DataFrame, level: Hashable, correct: Hashable, n: Hashable | None = None) -> Levels:
    """Levels and counts of a table: one row per trial (`correct` 0/1 or true/false), or per `n` trials.

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
        found = listed((f"{hits[row - 1]:g} of {trials[row - 1]:g} in row {row}" for row in rows), len(rows))
        raise BadValue(f"column {correct!r} must count answers from 0 to {top} in whole numbers; found {found}")
    levels, codes = np.unique(at, return_inverse=True)
    counted = [np.asarray(np.bincount(codes, weights=of), dtype=np.float64) for of in (trials, hits)]
    kept = counted[0] > 0
    if kept.sum() < 2:
        raise TooFew(f"{int(kept.sum())} level was presented; a psychometric function needs two or more")
    return Levels(levels[kept], counted[1][kept], counted[0][kept])


def _finite(data: pd.DataFrame, name: Hashable) -> Floats:
    values = numbers_of(data[name], name)
    rows = (np.flatnonzero(np.isnan(values)) + 1).tolist()
    if rows:
        found = listed((f"row {row}" for row in rows), len(rows))
        raise BadValue(f"column {name!r} has no value in {found}; take these trials out")
    return values


def log_likelihood(hits: Floats, trials: Floats, share: Floats) -> float:
    """The binomial log likelihood without its constant."""
    return float((xlogy(hits, share) + xlogy(trials - hits, 1 - share)).sum())


def refuse_flat(given: Levels, reached: float, guess: Bounds, lapse: Bounds) -> None:
    """Refuse answers that one constant share fits as well as any rising function does. Raises NoEstimate."""
    share = float(given.hits.sum() / given.trials.sum())
    level = min(max(share, guess[0]), 1 - lapse[0])
    if log_likelihood(given.hits, given.trials, np.full_like(given.trials, level)) < reached - ALIKE:
        return
    if share in (0.0, 1.0):
        found = "every answer was a hit" if share else "no answer was a hit"
        raise NoEstimate(f"{found}: the threshold lies {'below' if share else 'above'} the levels; test others")
    raise NoEstimate(
        f"the share of hits does not rise with the level (it is {share:.3g} over all levels): there is no threshold; "
        "if it should fall as the level rises, set `falling` to true"
    )


def refuse_step(given: Levels, reached: float, guess: Bounds, lapse: Bounds, equal_rates: bool = False) -> None:
    """Refuse answers that a step fits as well as any slope does: the slope then has no estimate. Raises NoEstimate."""
    count = len(given.levels)
    places = [j for j in range(count) if _step(given, j, guess, lapse, equal_rates) >= reached - ALIKE]
    if not places:
        return
    around = (places[0], places[-1]) if len(places) > 1 else (max(places[0] - 1, 0), min(places[0] + 1, count - 1))
    low, high = sorted(float(given.levels[j]) for j in around)
    raise NoEstimate(
        f"the answers step from one side to the other between levels {low:g} and {high:g}: the threshold lies there, "
        "but the slope (and any interval) has no estimate; test levels in between, or ask for the posterior of a prior"
    )


def _step(given: Levels, j: int, guess: Bounds, lapse: Bounds, equal_rates: bool) -> float:
    """The log likelihood of a step at level j, whose own share is free."""
    low = _pooled(given, slice(0, j), *guess)
    high = _pooled(given, slice(j + 1, None), 1 - lapse[1], 1 - lapse[0])
    if equal_rates:
        misses = np.concatenate([given.hits[:j], (given.trials - given.hits)[j + 1 :]])
        both = Levels(given.levels, misses, np.delete(given.trials, j))
        low = _pooled(both, slice(None), *lapse)
        high = 1 - low
    share = np.full_like(given.trials, high)
    share[:j] = low
    share[j] = min(max(given.hits[j] / given.trials[j], low), high)
    return log_likelihood(given.hits, given.trials, share)


def _pooled(given: Levels, part: slice, low: float, high: float) -> float:
    trials = float(given.trials[part].sum())
    return min(max(float(given.hits[part].sum()) / trials, low), high) if trials else low
