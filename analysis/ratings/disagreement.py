"""Differences between participants on physical and on emotional attributes, and their ratio."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.analysis.ratings.dataset import NoRows
from palpate.analysis.ratings.one_sample import NAN, one_sample
from palpate.analysis.ratings.person_cells import PersonCells, person_cells
from palpate.analysis.statistics.doubles import Floats, scaled

LEAST = 3
"""The least number of participants in a cell: with one left out, two must remain for a variance."""


@dataclass(frozen=True)
class Disagreement:
    """The SD between participants in two categories (root of the mean variance), and the ratio second / first.

    `low` and `high` bound the ratio, `t`, `df` and `p` test it against 1; `n` participants; `cells` counts the
    variances averaged in each category, `left_out` the cells with fewer than three participants. Undefined numbers are
    NaN, and `note` says why.
    """

    first: float
    second: float
    ratio: float
    low: float
    high: float
    t: float
    df: float
    p: float
    n: int
    cells: tuple[int, int]
    left_out: int
    note: str


def disagreement(
    data: pd.DataFrame,
    categories: Mapping[str, str],
    pair: tuple[str, str],
    *,
    over: Sequence[str] = ("stimulus",),
    subject: str = "participant",
    confidence: float = 0.95,
) -> Disagreement:
    """Return the SD between participants in each of two categories of attributes, and the second over the first.

    In each combination of attribute and `over` the variance over participants (n - 1) is computed, and these variances
    are averaged within a category. Participants are the sample, not stimuli: the interval is the jackknife's over
    participants of log(second / first), pseudo-values, t with n - 1 df (Miller 1968, Ann. Math. Stat. 39; Efron &
    Tibshirani 1993, ch. 11). Raises DataRefused where a category has no cell with three participants.
    """
    cells = person_cells(data, ("attribute", *over), subject=subject)
    numbers = np.count_nonzero(~np.isnan(cells.values), axis=0)
    sides = [
        [j for j, cell in enumerate(cells.cells) if categories.get(cell[0]) == name and numbers[j] >= LEAST]
        for name in pair
    ]
    if not all(sides):
        raise NoRows(
            f"no combination of attribute and {' and '.join(over)} has {LEAST} participants in both {pair[0]} and"
            f" {pair[1]}; an SD between participants needs them: compare over fewer columns, or collect more"
        )
    people = np.flatnonzero(~np.isnan(cells.values[:, [*sides[0], *sides[1]]]).all(axis=1))
    used = cells.only(range(len(cells.cells)), people.tolist())
    needed = sum(name in pair for name in (categories.get(cell[0]) for cell in cells.cells))
    return _compared(used, (sides[0], sides[1]), needed - len(sides[0]) - len(sides[1]), confidence)


def attribute_spreads(data: pd.DataFrame, over: Sequence[str], subject: str = "participant") -> dict[str, float]:
    """Return, for each attribute, the root of the mean variance between participants over the combinations of `over`.

    NaN where no combination has two participants.
    """
    cells = person_cells(data, ("attribute", *over), subject=subject)
    variances: dict[str, list[float]] = {cell[0]: [] for cell in cells.cells}
    for j, cell in enumerate(cells.cells):
        values = cells.values[~np.isnan(cells.values[:, j]), j]
        if len(values) > 1:
            variances[cell[0]].append(statistics.variance(np.sort(values).tolist()))
    return {name: math.sqrt(statistics.mean(value)) if value else NAN for name, value in variances.items()}


def _compared(cells: PersonCells, sides: tuple[list[int], list[int]], left_out: int, confidence: float) -> Disagreement:
    # Every column minus its first known value, all divided by one power of two.
    pivots = [next((v for v in column if not math.isnan(v)), 0.0) for column in cells.values.T.tolist()]
    change = cells.values - np.array(pivots)
    small, exponent = scaled(np.nan_to_num(change))
    small = np.where(np.isnan(change), NAN, small)
    (first, first_left), (second, second_left) = (_variances(small[:, side]) for side in sides)
    sds = math.ldexp(math.sqrt(first), exponent), math.ldexp(math.sqrt(second), exponent)
    n, counts = len(cells.participants), (len(sides[0]), len(sides[1]))
    if min(sds) <= cells.floor() or min(first_left.min(), second_left.min()) <= 0:
        why = "the ratio is undefined: there is no spread between participants in one of the categories"
        return Disagreement(*sds, NAN, NAN, NAN, NAN, n - 1.0, NAN, n, counts, left_out, why)
    log = 0.5 * math.log(second / first)
    pseudo = n * log - (n - 1) * 0.5 * np.log(second_left / first_left)
    difference = one_sample(pseudo, confidence=confidence, what="pseudo-values")
    low, high = math.exp(difference.low), math.exp(difference.high)
    return Disagreement(
        *sds, math.exp(log), low, high, difference.t, difference.df, difference.p, n, counts, left_out, difference.note
    )


def _variances(values: Floats) -> tuple[float, Floats]:
    """Return the mean variance of the columns, and that without each participant in turn."""
    there = ~np.isnan(values)
    n = np.count_nonzero(there, axis=0)
    away = values - np.nansum(values, axis=0) / n
    known = np.where(there, away, 0.0)
    squares = np.sum(known * known, axis=0)
    rest = np.maximum(squares - known * known * n / (n - 1), 0.0)
    divisor = np.where(there, n - 2, n - 1)
    return float(np.mean(squares / (n - 1))), np.mean(rest / divisor, axis=1)
