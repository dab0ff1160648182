"""Krippendorff's alpha: agreement for any number of raters, any level of measurement, and with gaps.

With n values, m in a unit, and d a squared difference, alpha = 1 - (n - 1) sum_u D_u / (m_u - 1) / E, where D_u sums d
over the ordered pairs of values of unit u, and E over those of all values. It is computed for many weightings of the
units at once, one for each bootstrap draw.
Source: Krippendorff 2011, "Computing Krippendorff's alpha-reliability", part D; Hayes & Krippendorff 2007.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.ordinal.ranks import refuse_huge, rounding, same_value
from palpate.analysis.reliability.crossed import cross_table
from palpate.analysis.reliability.intraclass import demand_confidence
from palpate.analysis.statistics.cells import Aggregate, check_columns, coded
from palpate.analysis.statistics.doubles import ROUNDING, Floats, scaled
from palpate.analysis.statistics.draws import demand_draws, generator, percentile, refuse_without_draws, weights
from palpate.analysis.statistics.refusals import BadOption, BadValue, TooFew, shown

Level: TypeAlias = Literal["nominal", "ordinal", "interval", "ratio"]
Weighted: TypeAlias = Callable[[Floats], Floats]
"""A function from weights (draws, units) to one alpha per draw, NaN if no two values differ."""
LEVELS = ("nominal", "ordinal", "interval", "ratio")
BLOCK = 4_000_000


@dataclass(frozen=True)
class Krippendorff:
    """Krippendorff's alpha with a bootstrap interval over units; NaN if undefined, and `note` says why.

    `units` and `values` can be paired: a unit with one value says nothing of agreement and is counted in `unpaired`.
    `values_per_cell` are the fewest and most values that a rater's value of a unit is the mean of.
    """

    alpha: float
    ci_low: float
    ci_high: float
    level: str
    units: int
    raters: int
    values: int
    missing: int
    unpaired: int
    draws: int
    seed: int
    confidence: float
    note: str
    values_per_cell: tuple[int, int] = (1, 1)


def krippendorff_alpha(
    data: pd.DataFrame,
    dv: Hashable,
    units: Hashable | Iterable[Hashable],
    raters: Hashable,
    level: Level,
    *,
    draws: int = 2000,
    seed: int = 0,
    confidence: float = 0.95,
    aggregate: Aggregate = None,
) -> Krippendorff:
    """Return Krippendorff's alpha of a long table; a missing value is NaN or a missing row.

    At level "nominal" the values may be any labels; "ratio" needs values from 0 up. `aggregate="mean"` averages
    repetitions at level "interval" or "ratio". The percentile interval draws units with replacement; `draws=0` leaves
    it out.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    """
    if not isinstance(level, str) or level not in LEVELS:
        raise BadOption(f"level={shown(level)} is unknown: one of {', '.join(map(repr, LEVELS))}")
    if aggregate is not None and level in ("nominal", "ordinal"):
        raise BadOption(f"values of level {level!r} have no mean; keep one value per unit and rater")
    refuse_without_draws(draws, seed=(seed, 0), confidence=(confidence, 0.95))
    check_columns(data, [dv])
    if level == "nominal":  # labels as numbers; a row without a label is a missing value
        there = data[dv].notna().to_numpy()
        numbers = np.full(len(data), np.nan)
        if there.any():
            numbers[there] = coded(data[dv][there], dv).codes
        data = data.copy()
        data[dv] = numbers
    table = cross_table(data, dv, units, raters, gaps="keep", aggregate=aggregate)
    alpha = krippendorff(table.values, level, draws=draws, seed=seed, confidence=confidence)
    return replace(alpha, values_per_cell=table.values_per_cell)


def krippendorff(
    values: Floats, level: Level, *, draws: int = 0, seed: int = 0, confidence: float = 0.95
) -> Krippendorff:
    """Return Krippendorff's alpha of an array (units, raters), with NaN for missing values."""
    demand_confidence(confidence)
    demand_draws(draws)
    if values.ndim != 2 or values.shape[1] < 2:
        raise TooFew("one rater; agreement needs two or more")
    present = ~np.isnan(values)
    paired = present.sum(axis=1) >= 2
    pairable = values[paired]
    alpha, drawn = math.nan, np.empty(0)
    if len(pairable):
        of = disagreement_of(pairable, level)
        alpha = float(of(np.ones((1, len(pairable))))[0])
        if draws and len(pairable) > 1 and not math.isnan(alpha):
            blocks = weights(generator(seed, "krippendorff"), len(pairable), draws)
            drawn = np.concatenate([of(block) for block in blocks])
    low, high = percentile(drawn, confidence)
    lost, notes = int(np.isnan(drawn).sum()), []
    if not len(pairable):
        notes.append("undefined: no unit has values of two raters")
    elif math.isnan(alpha):
        notes.append("undefined: all values are equal, so none could disagree by chance")
    elif alpha < 0:
        notes.append("negative: raters disagree more than by chance")
    if draws and len(pairable) == 1 and not math.isnan(alpha):
        notes.append("the interval needs two units or more")
    elif lost:
        what = "no interval" if 2 * lost > len(drawn) else "the interval rests on the others"
        notes.append(f"{lost} of {len(drawn)} draws hold one value only and have no alpha: {what}")
    return Krippendorff(
        *(alpha, low, high, level, len(pairable), values.shape[1], int(present[paired].sum())),
        *(int((~present).sum()), int((~paired & present.any(axis=1)).sum()), draws, seed, confidence),
        note="; ".join(notes),
    )


def disagreement_of(values: Floats, level: str) -> Weighted:
    """Return alpha of an array (units, raters), with at least two values per unit, as a function of units' weights.

    Raises BadValue for a value below 0 at level "ratio", and beyond 1e300 at any level but "interval".
    """
    if level == "interval":
        return _interval(values)
    # How often each different value occurs in each unit; values that are only rounding apart are one.
    units, _ = np.nonzero(~np.isnan(values))
    distinct, places = np.unique(values[~np.isnan(values)], return_inverse=True)
    refuse_huge(distinct)
    room = rounding(distinct)
    starts = np.append(True, ~same_value(distinct[1:], distinct[:-1], np.maximum(room[1:], room[:-1])))
    counts = np.zeros((len(values), int(starts.sum())))
    np.add.at(counts, (units, (np.cumsum(starts) - 1)[places]), 1.0)
    levels = distinct[starts]
    if level == "nominal":
        return _nominal(counts)
    return _ordinal(counts) if level == "ordinal" else _ratio(counts, levels)


def _alpha(observed: Floats, expected: Floats, n: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(expected > 0, 1 - (n - 1) * observed / expected, np.nan)


def _nominal(counts: Floats) -> Weighted:
    m = counts.sum(axis=1)
    own = (m**2 - (counts**2).sum(axis=1)) / (m - 1)

    def alpha(w: Floats) -> Floats:
        n, of_value = w @ m, w @ counts
        return _alpha(w @ own, n**2 - (of_value**2).sum(axis=1), n)

    return alpha


def _interval(values: Floats) -> Weighted:
    """Return alpha by sums of squares about means, with a unit's own first, so that an offset costs no digit."""
    x, _ = scaled(np.where(np.isnan(values), np.nanmax(values), values))
    present = ~np.isnan(values)
    x = x - x.flat[0]
    m = present.sum(axis=1).astype(np.float64)
    middle = np.where(present, x, 0).sum(axis=1) / m
    within = (np.where(present, x - middle[:, None], 0) ** 2).sum(axis=1)
    noise = values.size * ROUNDING**2

    def alpha(w: Floats) -> Floats:
        n = w @ m
        centre = (w @ (m * middle)) / n
        between = np.stack([np.dot(row * m, (middle - at) ** 2) for row, at in zip(w, centre, strict=True)])
        total = w @ within + between
        return _alpha(w @ (2 * m * within / (m - 1)), np.where(total > noise, 2 * n * total, 0), n)

    return alpha


def _ordinal(counts: Floats) -> Weighted:
    """Return alpha on an interval scale of the mean ranks of all pairable values, computed again for each draw."""
    m = counts.sum(axis=1)

    def alpha(w: Floats) -> Floats:
        n, of_value = w @ m, w @ counts
        rank = np.cumsum(of_value, axis=1) - of_value / 2 - n[:, None] / 2  # about their mean: multiples of 1/2
        square = rank**2
        own = m * (square @ counts.T) - (rank @ counts.T) ** 2  # exact: 0 where a unit's raters agree
        observed = (w * own / (m - 1)).sum(axis=1)
        return _alpha(2 * observed, 2 * n * (of_value * square).sum(axis=1), n)

    return alpha


def _ratio(counts: Floats, levels: Floats) -> Weighted:
    if levels[0] < 0:
        raise BadValue(f"the value {levels[0]:g} is below 0; a ratio scale begins at 0: use level 'interval'")
    levels, _ = scaled(levels)  # so that no sum of two overflows
    m = counts.sum(axis=1)
    across = np.zeros((len(counts), len(counts)))
    for part in np.array_split(np.arange(len(levels)), max(1, len(levels) ** 2 // BLOCK)):
        a, b = levels[part][:, None], levels[None, :]
        with np.errstate(invalid="ignore"):
            squares = np.where(a == b, 0.0, (a - b) / (a + b)) ** 2
        across += counts[:, part] @ (squares @ counts.T)
    own = np.diag(across) / (m - 1)

    def alpha(w: Floats) -> Floats:
        return _alpha(w @ own, ((w @ across) * w).sum(axis=1), w @ m)

    return alpha
