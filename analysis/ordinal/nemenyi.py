"""All pairs of conditions after Friedman: Nemenyi's test of mean ranks, and the exact test of each pair.

Nemenyi's p is the tail of the range of k standard normal values (the studentized range with infinite df):

    P(range > q) = k int phi(z) [Phi(z)^(k-1) - (Phi(z) - Phi(z - q))^(k-1)] dz, z the largest value

Every part is positive, so the smallest tail keeps its digits. The integrand is smooth and falls off like a normal
density, where the trapezoidal rule converges faster than any power of the step (Trefethen & Weideman 2014).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq
from scipy.special import log_ndtr

from palpate.analysis.ordinal.friedman import NO_RANKS, one_factor, rank_rows, spread
from palpate.analysis.ordinal.ranks import Ints
from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.f_and_t import SMALLEST, adjusted
from palpate.analysis.statistics.refusals import BadOption, shown

MOST_STEPS = 50_000_000  # participants times sums times differences, for the exact test
STEP = 1 / 32
REACH = 40.0  # beyond so many standard deviations a double holds no density
NEARLY_ONE = -(2.0**-52)  # a logarithm below 0 whose exponential is still below 1


def nemenyi(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable | Iterable[Hashable],
    subject: Hashable,
    *,
    alpha: float = 0.05,
    ties: bool = False,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return Nemenyi's test of all pairs of conditions: mean ranks A minus B, one row per pair.

    `q` is |difference| / sqrt(k (k + 1) / (12 n)), `p` its tail of the studentized range with infinite df, which
    already accounts for all pairs; a difference beyond `critical` is significant at `alpha`. `ties=True` uses the
    variance of the observed ranks instead of k (k + 1) / 12 (less conservative with ties). `p_exact` is the exact p of
    this pair alone given all ties, `p_exact_holm` the same adjusted by Holm; NaN where it costs too much. Raises a
    StatisticsError (a ValueError) that names what is wrong with the table. Sources: Nemenyi 1963; Demsar 2006, equation
    3; Eisinga et al. 2017 for the exact test.
    """
    if not isinstance(alpha, float) or not 0 < alpha < 1:
        raise BadOption(f"alpha={shown(alpha)}: a number between 0 and 1 is expected, such as 0.05")
    factor, cells = one_factor(data, dv, within, subject, missing, aggregate)
    ranks = rank_rows(cells)
    (n, k), error = ranks.shape, rank_error(ranks, ties)
    note = "" if error > 0 else f"q and the critical difference are {NO_RANKS}"
    sums, exact = ranks.sum(axis=0), _exact_tails(ranks)
    critical = range_quantile(alpha, k) * error if error > 0 else math.nan
    rows: list[dict[str, Any]] = []
    for i, j in combinations(range(k), 2):
        labels = {"Contrast": str(factor), "A": cells.levels[0][i], "B": cells.levels[0][j]}
        p_exact = math.nan if note or exact is None else exact[abs(int(sums[i] - sums[j]))]
        a, b = int(sums[i]), int(sums[j])
        q = abs(a - b) / (2 * n) / error if error > 0 else math.nan
        means = {"mean_rank_A": a / (2 * n), "mean_rank_B": b / (2 * n), "diff": (a - b) / (2 * n)}
        tests = {"q": q, "p": range_tail(q, k), "critical": critical, "p_exact": p_exact}
        rows.append({**labels, **means, **tests, "note": note})
    table = pd.DataFrame(rows)
    table.insert(len(table.columns) - 1, "p_exact_holm", adjusted(table["p_exact"].tolist(), "holm"))
    table.attrs.update(cells.attrs())
    return table


def rank_error(ranks: Ints, ties: bool) -> float:
    """Return the standard deviation of a mean rank: sqrt(k (k + 1) / (12 n)), or from the ranks where `ties`."""
    n, k = ranks.shape
    if spread(ranks)[1] == 0:
        return 0.0
    return math.sqrt(spread(ranks)[1] / (4 * n * n * (k - 1)) if ties else k * (k + 1) / (12 * n))


def _exact_tails(ranks: Ints) -> list[float] | None:
    """Return P(|difference of two rank sums| >= d) for d = 0, 1, ... (doubled ranks); None if that costs too much.

    Two conditions of one participant have two of the participant's ranks, drawn without replacement.
    """
    n, k = ranks.shape
    if n * (4 * n * k) * (4 * k) > MOST_STEPS:
        return None
    chances: Floats = np.ones(1)
    kinds, counts = np.unique(np.sort(ranks, axis=1), axis=0, return_counts=True)
    for kind, count in zip(kinds, counts.tolist(), strict=True):
        # The chance of each difference of two different places of one participant, from -2 (k - 1) to 2 (k - 1).
        apart = (kind[:, None] - kind[None, :])[~np.eye(k, dtype=bool)] + 2 * (k - 1)
        own: Floats = np.bincount(apart, minlength=4 * (k - 1) + 1) / (k * (k - 1))
        for _ in range(count):
            chances = np.convolve(chances, own).astype(np.float64)
    middle = len(chances) // 2
    folded = np.concatenate((chances[middle : middle + 1], 2 * chances[middle + 1 :]))
    tails = np.minimum(1.0, np.maximum(folded[::-1].cumsum()[::-1], SMALLEST))
    return [1.0, *tails[1:].tolist()]


def range_tail(q: float, k: int) -> float:
    """Return P(largest - smallest of k standard normal values > q), q >= 0; never 0, NaN for NaN."""
    if math.isnan(q):
        return math.nan
    if q <= 0:
        return 1.0
    if q > 2 * REACH:
        return SMALLEST
    z = np.arange(-REACH, REACH + q, STEP)
    below = log_ndtr(z)
    inside = np.log1p(-np.exp(np.minimum(log_ndtr(z - q) - below, NEARLY_ONE)))
    shares = np.exp((k - 1) * below - z * z / 2) * -np.expm1((k - 1) * inside)
    return min(1.0, max(float(shares.sum()) * k * STEP / math.sqrt(2 * math.pi), SMALLEST))


def range_quantile(alpha: float, k: int) -> float:
    """Return the q with P(range > q) = alpha."""
    return float(brentq(lambda q: range_tail(q, k) - alpha, 0.0, 60.0, xtol=1e-13, rtol=1e-14))
