"""Each rater against the others: correlation, shift and relative spread."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.analysis.reliability.correlating import pearson
from palpate.analysis.reliability.crossed import cross_table, refuse_few
from palpate.analysis.statistics.cells import Aggregate
from palpate.analysis.statistics.doubles import Floats, deviation_ss, rescaled, scaled


class RaterSign(NamedTuple):
    """One rater against the mean of the others over `shared` targets.

    `r` is the correlation, `shift` the mean difference in the data's unit, `spread` the SD over targets as a multiple
    of the others'.
    """

    rater: Hashable
    values: int
    missing: int
    shared: int
    r_others: float
    shift: float
    spread: float
    note: str


def rater_signs(
    data: pd.DataFrame,
    dv: Hashable,
    targets: Hashable | Iterable[Hashable],
    raters: Hashable,
    *,
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Compare each rater of a long table with the others: one row per rater, NaN with a `note` if undefined.

    A target counts for a rater if the rater and another one rated it; gaps are allowed. `spread` is over the root mean
    square of the other raters' SDs. Raises a StatisticsError that names what is wrong with the table.
    """
    table = cross_table(data, dv, targets, raters, gaps="keep", aggregate=aggregate)
    refuse_few(table, "targets", f"raters ({raters})", (1, 2))
    values = table.values
    x, exponent = scaled(np.where(np.isnan(values), 0, values))
    present = ~np.isnan(values)
    x = np.where(present, x - x.flat[int(np.argmax(present))], 0)
    others, count = _without_own(x), _without_own(present.astype(np.float64))
    columns = [x[present[:, i], i] for i in range(len(table.columns))]
    variances = [deviation_ss(own) / (len(own) - 1) if len(own) > 1 else math.nan for own in columns]
    signs: list[RaterSign] = []
    for i, name in enumerate(table.columns):
        shared = present[:, i] & (count[:, i] > 0)
        own, rest = x[shared, i], others[shared, i] / count[shared, i]
        if len(own):
            correlation = pearson(own, rest)
            r, shift = correlation.r, rescaled(math.fsum((own - rest).tolist()) / len(own), exponent)
            why = correlation.note.replace("first", "rater's").replace("second", "others'")
            notes = [why] if math.isnan(r) else []
        else:
            r, shift, notes = math.nan, math.nan, ["no target is shared with another rater"]
        spread, why = _relative_spread(variances, i)
        notes += [why] if why else []
        there = int(present[:, i].sum())
        signs.append(RaterSign(name, there, len(x) - there, len(own), r, shift, spread, note="; ".join(notes)))
    result = pd.DataFrame(signs)
    result.attrs.update(table.attrs("targets", "raters"))
    return result


def _relative_spread(variances: Sequence[float], at: int) -> tuple[float, str]:
    """Return a rater's SD over the root mean square of the others' SDs, or NaN and the reason."""
    of_others = [value for j, value in enumerate(variances) if j != at and not math.isnan(value)]
    pooled = math.fsum(of_others) / len(of_others) if of_others else math.nan
    if math.isnan(variances[at]):
        return math.nan, "one value has no spread"
    if math.isnan(pooled) or pooled == 0:
        return math.nan, "spread is undefined: no other rater's values vary"
    return math.sqrt(variances[at] / pooled), ""


def _without_own(x: Floats) -> Floats:
    """Return the sum over the other columns, as the sum of those before and after, so that nothing cancels."""
    zero = np.zeros((len(x), 1))
    before = np.cumsum(np.concatenate((zero, x[:, :-1]), axis=1), axis=1)
    after = np.cumsum(np.concatenate((zero, x[:, :0:-1]), axis=1), axis=1)[:, ::-1]
    total: Floats = before + after
    return total
