"""Cronbach's alpha: the consistency of the items of a scale."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.reliability.correlating import deviations, deviations_of_sum, f_upper, product_moment
from palpate.analysis.reliability.crossed import cross_table, refuse_few
from palpate.analysis.reliability.intraclass import demand_confidence, mean_squares
from palpate.analysis.statistics.cells import Aggregate
from palpate.analysis.statistics.doubles import Floats, deviation_ss, rescaled, scaled
from palpate.analysis.statistics.refusals import BadOption, UnknownColumn, shown

Missing: TypeAlias = Literal["raise", "drop_cases"]
GAPS = {"raise": "raise", "drop_cases": "drop_rows"}


class Item(NamedTuple):
    """One item: mean and SD, correlations with the sum of all items and of the others, alpha without it."""

    item: Hashable
    mean: float
    sd: float
    item_total: float
    item_rest: float
    alpha_if_dropped: float
    note: str


@dataclass(frozen=True)
class Alpha:
    """Cronbach's alpha of `cases` by `items` with Feldt's interval; NaN if undefined, and `note` says why.

    `standardised` is alpha of the items' z scores, from their mean correlation `average_r`.
    """

    alpha: float
    ci_low: float
    ci_high: float
    standardised: float
    average_r: float
    cases: int
    items: pd.DataFrame
    confidence: float
    dropped: tuple[Hashable, ...]
    values_per_cell: tuple[int, int]
    note: str


def cronbach_alpha(
    data: pd.DataFrame,
    dv: Hashable,
    items: Hashable,
    cases: Hashable | Iterable[Hashable],
    *,
    reverse: Sequence[Hashable] = (),
    confidence: float = 0.95,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Alpha:
    """Return Cronbach's alpha of a long table: `items` are the items, `cases` the rated persons or things.

    The items in `reverse` are reverse-keyed. `missing="drop_cases"` leaves out cases with gaps, `aggregate="mean"`
    averages repetitions. Interval: Feldt 1965. The result's `items` has one row per item. Raises a StatisticsError (a
    ValueError) that names what is wrong with the table.
    """
    demand_confidence(confidence)
    if not isinstance(missing, str) or missing not in GAPS:
        raise BadOption(f"missing={shown(missing)} is unknown: one of {', '.join(map(repr, GAPS))}")
    table = cross_table(data, dv, cases, items, gaps=GAPS[missing], aggregate=aggregate)  # type: ignore[arg-type]
    refuse_few(table, "cases", f"items ({items})")
    for name in reverse:
        if name not in table.columns:
            raise UnknownColumn(f"reverse names {name!r}, which is not an item; the items are {table.columns}")
    signs = np.array([-1.0 if name in reverse else 1.0 for name in table.columns])
    values = table.values
    keyed = values * signs
    alpha, correlation = alpha_value(keyed), _mean_correlation(keyed)
    low, high = feldt_interval(alpha, len(values), values.shape[1], confidence) if alpha < 1 else (math.nan, math.nan)
    k = values.shape[1]
    total = 1 + (k - 1) * correlation
    standardised = k * correlation / total if total > 0 else math.nan
    per_item = pd.DataFrame(_item(values, keyed, i, name) for i, name in enumerate(table.columns))
    return Alpha(
        *(alpha, low, high, standardised, correlation, len(values), per_item, confidence),
        *(tuple(table.dropped), table.values_per_cell, "; ".join(_notes(alpha, standardised, per_item))),
    )


def _mean_correlation(values: Floats) -> float:
    """Return the mean correlation of two items of an array (cases, items), NaN where an item does not vary."""
    z = np.stack([deviations(column) for column in values.T], axis=1)
    length = np.sqrt(np.add.reduce(z * z, axis=0))
    if not (length != 0).all():
        return math.nan
    products = (z / length).T @ (z / length)
    sum_r = float(math.fsum(products[np.triu_indices(len(products), 1)].tolist()))
    return sum_r * 2 / (len(length) * (len(length) - 1))


def _notes(alpha: float, standardised: float, per_item: pd.DataFrame) -> list[str]:
    """Return why alpha, its interval or its standardised form is undefined, and what a negative alpha means."""
    notes = []
    if math.isnan(alpha):
        notes.append("alpha is undefined: the sums of the items do not vary")
    elif alpha < 0:
        notes.append("negative: the items run against each other")
    elif alpha == 1:
        notes.append("the items agree exactly: the interval is undefined")
    if math.isnan(standardised):
        still = [str(name) for name, sd in zip(per_item["item"], per_item["sd"], strict=True) if sd == 0]
        why = f"{', '.join(still)} does not vary" if still else "the correlations leave a sum without variance"
        notes.append(f"standardised alpha is undefined: {why}")
    return notes


def alpha_value(values: Floats) -> float:
    """Return alpha of an array (cases, items) without gaps: 1 - residual / between cases, NaN where no case differs."""
    ms = mean_squares(values)
    return math.nan if ms.rows == 0 else 1 - ms.residual / ms.rows


def feldt_interval(alpha: float, cases: int, items: int, confidence: float) -> tuple[float, float]:
    """Return Feldt's interval (1965): (1 - alpha) over its true value is distributed as F."""
    df1, df2, tail = cases - 1, (cases - 1) * (items - 1), (1 - confidence) / 2
    return 1 - (1 - alpha) * f_upper(tail, df1, df2), 1 - (1 - alpha) / f_upper(tail, df2, df1)


def _item(values: Floats, keyed: Floats, at: int, name: Hashable) -> Item:
    x, exponent = scaled(values[:, at])
    mean = rescaled(math.fsum(x.tolist()) / len(x), exponent)
    sd = rescaled(math.sqrt(deviation_ss(x) / (len(x) - 1)), exponent)
    others = np.delete(keyed, at, axis=1)
    own = deviations(keyed[:, at])
    with_all = product_moment(own, deviations_of_sum(keyed))
    with_rest = product_moment(own, deviations_of_sum(others))
    without = alpha_value(others) if others.shape[1] > 1 else math.nan
    notes = []
    if not own.any():
        notes.append("does not vary: its correlations are undefined")
    elif with_rest < 0:
        notes.append("runs against the other items: reverse it if it is keyed the other way round")
    elif math.isnan(with_rest):
        notes.append("the sum of the other items does not vary")
    if own.any() and others.shape[1] < 2:
        notes.append("alpha without it is undefined: one item would be left")
    return Item(name, mean, sd, with_all, with_rest, without, "; ".join(notes))
