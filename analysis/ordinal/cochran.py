"""Cochran's Q: whether answers of yes or no are equally often yes in every condition."""

from __future__ import annotations

import math
from collections.abc import Hashable

import numpy as np
import pandas as pd

from palpate.analysis.ordinal.friedman import NO_EXACT, one_factor, rank_test
from palpate.analysis.ordinal.friedman_exact import exact_tail
from palpate.analysis.ordinal.ranks import doubled_ranks
from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.refusals import BadValue

NO_DIFFERENCE = "every participant answered alike in all conditions: Q is undefined"


def cochran_q(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable,
    subject: Hashable,
    *,
    yes: float | None = None,
    exact: bool = True,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Cochran's Q of a long table whose values are 0 (no) or 1 (yes), one for each participant and condition: one row.

    With `yes`, values of at least that much are 1, after averaging where `aggregate` is "mean".

    `Q`, `ddof1`, `p_unc`: the chi-squared form; `p_exact`: over all orders of each participant's own answers, NaN where
    `exact` is off or there are too many; `decides`: participants whose answers differ, on whom alone Q rests. The
    attribute `yes` of the table maps each condition to its number of yes.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    Q is Friedman's chi-squared of these answers, corrected for ties. Sources: Cochran 1950; Patil 1975 (exact test).
    """
    factor, cells = one_factor(data, dv, within, subject, missing, aggregate)
    values = cells.values if yes is None else (cells.values >= yes).astype(np.float64)
    if odd := sorted({float(value) for value in np.unique(values)} - {0.0, 1.0}):
        raise BadValue(f"{dv!s}: {odd[0]:g} found; Cochran's Q compares answers that are 0 (no) or 1 (yes)")
    ranks = doubled_ranks(values, np.zeros_like(values))
    test = rank_test(ranks)
    alike = math.isnan(test.chi2)
    p_exact = exact_tail(ranks) if exact and not alike else math.nan
    notes = [NO_DIFFERENCE] if alike else [NO_EXACT] if exact and math.isnan(p_exact) else []
    (n, k), answered_yes = values.shape, values.sum(axis=1)
    row = {
        **{"Source": str(factor), "n": n, "k": k, "decides": int(((answered_yes > 0) & (answered_yes < k)).sum())},
        **{"Q": test.chi2, "ddof1": test.df, "p_unc": test.p, "p_exact": p_exact, "note": "; ".join(notes)},
    }
    table = pd.DataFrame([row])
    counts = values.sum(axis=0).astype(int).tolist()
    table.attrs.update(cells.attrs(), yes=dict(zip(cells.levels[0], counts, strict=True)))
    return table
