"""One-way ANOVA between groups, equal or unequal in size."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from fractions import Fraction

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.doubles import ROUNDING, Floats, deviation_ss, exact_sum, rescaled, scaled
from palpate.analysis.statistics.groups import gather_groups
from palpate.analysis.statistics.pvalues import f_tail
from palpate.analysis.statistics.within import range_notes, share, undefined_f


def anova(
    data: pd.DataFrame,
    dv: Hashable,
    between: Hashable | Iterable[Hashable],
    *,
    subject: Hashable | None = None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """One-way ANOVA between groups of a long table: one row, pingouin's column names.

    Without `subject` every row is an independent value. `np2` (partial) and `eta2` (classical) eta squared are the same
    number in a one-way design; `note` says why a value is NaN. `missing="listwise"` leaves out rows without a value,
    `aggregate="mean"` averages each participant's values.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    """
    groups = gather_groups(data, dv, between, subject, missing, aggregate)
    table = pd.DataFrame([{"Source": str(groups.factor), **one_way(groups.values)}])
    table.attrs.update(groups.attrs())
    return table


def one_way(groups: Sequence[Floats]) -> dict[str, float | int | str]:
    """The statistics of a list of groups, under the names of the table's columns."""
    sizes = [len(group) for group in groups]
    x, exponent = scaled(np.concatenate(groups))
    parts = np.split(x, np.cumsum(sizes)[:-1])
    ssb, ssw = _between_ss(parts, float(x[0])), math.fsum(map(deviation_ss, parts))
    df1, df2 = len(groups) - 1, len(x) - len(groups)
    noise = x.size * ROUNDING**2
    note = undefined_f(ssb, ssw, noise, "the values of each group are the same")
    f = math.nan if note else ssb / df1 / (ssw / df2)
    p, eta2 = f_tail(f, df1, df2), share(ssb, ssw, noise)
    ss, ms, ss_error = (rescaled(value, 2 * exponent) for value in (ssb, ssb / df1, ssw))
    notes = [note] * bool(note) + range_notes(((ssb, ss), (ssw, ss_error)), (p,))
    return {
        **{"SS": ss, "ddof1": df1, "ddof2": df2, "MS": ms, "F": f, "p_unc": p, "np2": eta2, "eta2": eta2},
        **{"SS_error": ss_error, "note": "; ".join(notes)},
    }


def _between_ss(parts: Sequence[Floats], pivot: float) -> float:
    """sum T_g^2 / n_g - T^2 / N in exact rationals: few enough sums to afford it, and it cancels without loss."""
    totals = [exact_sum(part, pivot) for part in parts]
    squares = sum((total**2 / len(part) for total, part in zip(totals, parts, strict=True)), Fraction(0))
    return float(squares - sum(totals, Fraction(0)) ** 2 / sum(map(len, parts)))
