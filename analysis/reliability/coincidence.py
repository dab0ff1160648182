"""Krippendorff's alpha: agreement for any number of raters, any level of measurement, and with gaps.

Source: Krippendorff 2011, "Computing Krippendorff's alpha-reliability"; Hayes & Krippendorff 2007.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.reliability.crossed import crossed
from palpate.analysis.reliability.disagreement import LEVELS, disagreement_of
from palpate.analysis.reliability.intraclass import demand_confidence
from palpate.analysis.reliability.resampling import demand_draws, generator, percentile, refuse_without_draws, weights
from palpate.analysis.statistics.cells import Aggregate, check_columns
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.labels import coded
from palpate.analysis.statistics.refusals import BadOption, TooFew, shown

Level: TypeAlias = Literal["nominal", "ordinal", "interval", "ratio"]


@dataclass(frozen=True)
class Krippendorff:
    """Krippendorff's alpha with a bootstrap interval over units; NaN where undefined, and `note` says why.

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
    """Krippendorff's alpha of a long table; a missing value is a row without one, or no row.

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
    table = crossed(_numbered(data, dv, level), dv, units, raters, gaps="keep", aggregate=aggregate)
    found = krippendorff(table.values, level, draws=draws, seed=seed, confidence=confidence)
    return replace(found, values_per_cell=table.values_per_cell)


def krippendorff(
    values: Floats, level: Level, *, draws: int = 0, seed: int = 0, confidence: float = 0.95
) -> Krippendorff:
    """Krippendorff's alpha of an array (units, raters), NaN where a rater gave no value."""
    demand_confidence(confidence)
    demand_draws(draws)
    if values.ndim != 2 or values.shape[1] < 2:
        raise TooFew("one rater; agreement needs two or more")
    given = ~np.isnan(values)
    paired = given.sum(axis=1) >= 2
    kept = values[paired]
    alpha, drawn = math.nan, np.empty(0)
    if len(kept):
        of = disagreement_of(kept, level)
        alpha = float(of(np.ones((1, len(kept))))[0])
        if draws and len(kept) > 1 and not math.isnan(alpha):
            blocks = weights(generator(seed, "krippendorff"), len(kept), draws)
            drawn = np.concatenate([of(block) for block in blocks])
    low, high = percentile(drawn, confidence)
    return Krippendorff(
        *(alpha, low, high, level, len(kept), values.shape[1], int(given[paired].sum())),
        *(int((~given).sum()), int((~paired & given.any(axis=1)).sum()), draws, seed, confidence),
        note="; ".join(_notes(alpha, drawn, len(kept), draws)),
    )


def _numbered(data: pd.DataFrame, dv: Hashable, level: Level) -> pd.DataFrame:
    """The table with its labels as numbers at level nominal; a row without a label is a missing value."""
    if level != "nominal":
        return data
    there = data[dv].notna().to_numpy()
    values = np.full(len(data), np.nan)
    if there.any():
        values[there] = coded(data[dv][there], dv).codes
    found = data.copy()
    found[dv] = values
    return found


def _notes(alpha: float, drawn: Floats, units: int, draws: int) -> list[str]:
    if not units:
        return ["undefined: no unit has values of two raters"]
    if math.isnan(alpha):
        return ["undefined: all values are equal, so none could disagree by chance"]
    notes = ["negative: raters disagree more than by chance"] if alpha < 0 else []
    lost = int(np.isnan(drawn).sum())
    if draws and units < 2:
        notes.append("the interval needs two units or more")
    elif lost:
        what = "no interval" if 2 * lost > len(drawn) else "the interval rests on the others"
        notes.append(f"{lost} of {len(drawn)} draws hold one value only and have no alpha: {what}")
    return notes
