"""Each rater against the others: in step with them, shifted from them, wider or narrower than they are."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.analysis.reliability.correlating import pearson
from palpate.analysis.reliability.crossed import cross_table, refuse_few
from palpate.analysis.statistics.cells import Aggregate
from palpate.analysis.statistics.doubles import Floats, deviation_ss, rescaled, scaled


class RaterSign(NamedTuple):
    """One rater: r with the mean of the others over `shared` targets, the mean difference from them in the data's
    unit (`shift`), and the SD over targets as a multiple of the others' (`spread`)."""

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
    """Compare each rater of a long table with the others: one row per rater, NaN with a `note` where undefined.

    A target counts for a rater who rated it where another one did; gaps are allowed. `spread` is over the root mean
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
        notes = []
        shift = math.nan
        if len(own):
            shift = rescaled(math.fsum((own - rest).tolist()) / len(own), exponent)
        else:
            notes.append("no target is shared with another rater")
        r = pearson(own, rest) if len(own) else None
        notes += [r.note.replace("first", "rater's").replace("second", "others'")] if r and math.isnan(r.r) else []
        of_others = [value for j, value in enumerate(variances) if j != i and not math.isnan(value)]
        pooled = math.fsum(of_others) / len(of_others) if of_others else math.nan
        spread = math.nan
        if math.isnan(variances[i]):
            notes.append("one value has no spread")
        elif math.isnan(pooled) or pooled == 0:
            notes.append("spread is undefined: no other rater's values vary")
        else:
            spread = math.sqrt(variances[i] / pooled)
        there = int(present[:, i].sum())
        signs.append(
            RaterSign(
                *(name, there, len(x) - there, len(own), r.r if r else math.nan, shift, spread),
                note="; ".join(notes),
            )
        )
    result = pd.DataFrame(signs)
    result.attrs.update(table.attrs("targets", "raters"))
    return result


def _without_own(x: Floats) -> Floats:
    """Return the sum over the other columns, from those before and those after: nothing cancels."""
    zero = np.zeros((len(x), 1))
    before = np.cumsum(np.concatenate((zero, x[:, :-1]), axis=1), axis=1)
    after = np.cumsum(np.concatenate((zero, x[:, :0:-1]), axis=1), axis=1)[:, ::-1]
    total: Floats = before + after
    return total
