"""Whether a cumulative model has a maximum: answers that the predictors divide without overlap have none.

The log likelihood never falls along a direction that raises every upper bound and lowers every lower one (by any
amount, also 0). If some such direction moves any bound, some estimate is infinite (Haberman 1980; Albert & Anderson
1984): a linear programme decides it exactly.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from palpate.analysis.ordinal.cumulative import Rows
from palpate.analysis.statistics.doubles import Floats

MOVED = 1e-7


def escape(rows: Rows) -> Floats | None:
    """A direction along which the likelihood rises for ever, each part at most 1; None where there is none."""
    bounds = np.concatenate((rows.upper[~rows.last], -rows.lower[~rows.first]))
    bounds = np.unique(bounds, axis=0)
    found = linprog(-bounds.sum(axis=0), A_ub=-bounds, b_ub=np.zeros(len(bounds)), bounds=(-1, 1), method="highs")
    if found.x is None or float((bounds @ found.x).max()) <= MOVED:
        return None
    direction: Floats = found.x
    return direction
