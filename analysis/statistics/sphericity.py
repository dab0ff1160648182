"""Mauchly's test of sphericity, for every effect within participants that has more than one contrast."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from palpate.analysis.statistics.cells import Aggregate, Missing
from palpate.analysis.statistics.doubles import scaled
from palpate.analysis.statistics.mixed import Design, Names, Stratum, gather_design, strata
from palpate.analysis.statistics.pvalues import SMALLEST, p_note

COLUMNS = ("Source", "d", "W", "chi2", "ddof", "p", "p_anderson", "note")


@dataclass(frozen=True)
class Sphericity:
    """One test; `p` has R's second-order term, `p_anderson` the one of the literature."""

    Source: str
    d: int
    W: float
    chi2: float
    ddof: int
    p: float
    p_anderson: float
    note: str


def mauchly_tests(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Names,
    subject: Hashable,
    between: Names = None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Mauchly's test (1940) of every set of within factors with two or more contrasts (`d`): one row each.

    W and p are those of R's `mauchly.test` and car: p is that of Box's chi-squared series with two terms, in whose
    second R 4.2 writes the number of all within cells where Anderson (2003, 10.7.2) has the number of contrasts;
    `p_anderson` has the latter. With between factors the covariance is pooled over groups. With fewer participants
    (less groups) than contrasts there is no test: W and p are NaN and the `note` says so.
    Raises a StatisticsError as `mixed_anova` does.
    """
    design = gather_design(data, dv, within, between, subject, missing, aggregate)
    return pd.DataFrame([asdict(found) for found in sphericities(design)], columns=list(COLUMNS))


def sphericities(design: Design) -> Iterator[Sphericity]:
    """The tests of a design, in the order of its within effects."""
    x, _ = scaled(design.cells.values)
    cells = math.prod(x.shape[1:])
    for stratum in strata(design, x):
        if stratum.d > 1:
            yield _sphericity(design.source((), stratum.axes), stratum, design.error_df, cells)


def _sphericity(source: str, stratum: Stratum, n: int, cells: int) -> Sphericity:
    d = stratum.d
    ddof = d * (d + 1) // 2 - 1
    note, log_w = _log_w(stratum, n)
    if note:
        return Sphericity(source, d, math.nan, math.nan, ddof, math.nan, math.nan, note)
    rho = 1 - (2 * d * d + d + 2) / (6 * d * n)
    chi2 = -n * rho * log_w
    p, by_anderson = (_tail(chi2, ddof, _second_term(d, n * rho, size)) for size in (cells, d))
    w = max(math.exp(log_w), SMALLEST)
    return Sphericity(source, d, w, chi2, ddof, p, by_anderson, p_note((p, w)))


def _log_w(stratum: Stratum, n: int) -> tuple[str, float]:
    """log W = log det S - d log(tr S / d) of the contrasts' covariance S, or why there is none."""
    d = stratum.d
    if n < d:
        return f"fewer than d = {d} participants more than groups: there is no test of sphericity", math.nan
    if math.isnan(stratum.eps):
        return "the residual has no variation: there is no test of sphericity", math.nan
    values = np.linalg.svd(stratum.residual, compute_uv=False)[:d].astype(np.float64)
    if values[-1] <= values[0] * max(stratum.residual.shape) * 2.0**-52:
        return "the covariance of the contrasts is singular: there is no test of sphericity", math.nan
    squares = (values / values[0]) ** 2
    return "", min(0.0, math.fsum(np.log(squares)) - d * math.log(math.fsum(squares) / d))


def _second_term(d: int, room: float, size: int) -> float:
    return (d + 2) * (d - 1) * (d - 2) * (2 * d**3 + 6 * d**2 + 3 * size + 2) / (288 * (d * room) ** 2)


def _tail(chi2: float, ddof: int, second: float) -> float:
    first, later = float(chdtrc(ddof, chi2)), float(chdtrc(ddof + 4, chi2))
    return min(1.0, max(first + second * (later - first), SMALLEST))
