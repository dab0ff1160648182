"""The tables that ordinal statistics are measured on, with exact answers from decimals as written and integers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from itertools import product

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from palpate.analysis.statistics.cells import gather
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.references import reference_table

DIGITS = 12  # decimals to which the values of these tables were written


def _cells(name: str, factor: str) -> Floats:
    return gather(reference_table(f"csv/{name}.csv"), "y", factor, "subject").values


def _with_rounded_ties() -> Floats:
    """Return the answers of twelve people whose first two are 0.3, once written as 0.1 + 0.2."""
    third = [0.1, 0.5, 0.6, 0.7, 0.2, 0.9, 0.8, 0.4, 0.6, 0.5, 0.7, 0.9]
    return np.array([[0.1 + 0.2, 0.3, value] for value in third])


FRIEDMAN: dict[str, Floats] = {
    "RoundingTimes, 22 x 3": _cells("RoundingTimes", "method"),
    "ergoStool, 9 x 4": _cells("ergoStool", "type"),
    "0.1 + 0.2 against 0.3, 12 x 3": _with_rounded_ties(),
}

SIGNED: dict[str, tuple[Floats, Floats]] = {
    "depression scores (Hollander & Wolfe), 9 pairs": (
        np.array([1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]),
        np.array([0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]),
    ),
    "Likert answers, ties and zeros, 14 pairs": (
        np.array([5, 6, 4, 7, 3, 5, 6, 2, 4, 7, 5, 3, 6, 1], dtype=np.float64),
        np.array([4, 4, 4, 5, 5, 3, 6, 1, 2, 4, 5, 1, 3, 2], dtype=np.float64),
    ),
    "0.1 + 0.2 against 0.3, 10 pairs": (
        np.array([0.1 + 0.2, 0.1 + 0.2, 0.7, 0.5, 0.9, 0.4, 0.8, 0.6, 1.1, 0.2]),
        np.array([0.3, 0.3, 0.4, 0.2, 0.3, 0.5, 0.5, 0.7, 0.5, 0.4]),
    ),
}

RANGES: dict[tuple[float, int], float] = {
    (1.0, 2): math.erfc(0.5),  # two values: their difference is normal
    (8.0, 2): math.erfc(4.0),
    (20.0, 2): math.erfc(10.0),
    (3.5, 4): 0.06387633385690318526,  # 40-digit quadrature (mpmath); R's ptukey differs by 4e-11
    (12.0, 10): 9.683825946252485722e-16,  # the same
}

WINE = {  # R 4.2.2, ordinal 2022.11.16, clm(rating ~ temp + contact, data = wine)
    "slope 0": 2.503102007898927,
    "slope 1": 1.527797658095058,
    "log likelihood": -86.49192336564907,
}
_WINE_COUNTS = {  # Randall 1989, in R's ordinal: answers 1 to 5
    ("cold", "no"): (4, 9, 5, 0, 0),
    ("cold", "yes"): (1, 7, 8, 2, 0),
    ("warm", "no"): (0, 5, 8, 3, 2),
    ("warm", "yes"): (0, 1, 5, 7, 5),
}


def wine_table() -> pd.DataFrame:
    """Return 72 ratings of bitterness, 1 to 5, by temperature and contact with the skins."""
    rows = [
        (temp, contact, point)
        for (temp, contact), counts in _WINE_COUNTS.items()
        for point, count in enumerate(counts, start=1)
        for _ in range(count)
    ]
    return pd.DataFrame(rows, columns=["temp", "contact", "y"])


def separated_table() -> pd.DataFrame:
    """Return answers that the groups separate without overlap, so that no slope is finite."""
    return pd.DataFrame({"group": ["a"] * 6 + ["b"] * 6, "y": [1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3]})


def _as_decimal(value: float) -> Decimal:
    return Decimal(f"{value:.{DIGITS}f}")


def _ranks(values: Sequence[Decimal]) -> list[Fraction]:
    """Return midranks of decimals."""
    return [
        Fraction(sum(other < value for other in values)) + Fraction(1 + sum(other == value for other in values), 2)
        for value in values
    ]


def exact_friedman(cells: Floats) -> dict[str, float]:
    """Return chi-squared corrected for ties, in exact fractions of the decimals as written, and its p."""
    n, k = cells.shape
    if cells.size > 10_000:
        return _whole_friedman(cells)
    rows = [_ranks([_as_decimal(value) for value in row]) for row in cells.tolist()]
    middle = Fraction(k + 1, 2)
    between = sum((sum(row[j] for row in rows) - n * middle) ** 2 for j in range(k))
    total = sum((rank - middle) ** 2 for row in rows for rank in row)
    chi2 = (k - 1) * between / total
    return {"chi2": float(chi2), "p": float(chdtrc(k - 1, float(chi2)))}


def _whole_friedman(cells: Floats) -> dict[str, float]:
    """Return chi-squared corrected for ties, and its p, for many integers, by counting."""
    n, k = cells.shape
    doubled = np.stack([(row[:, None] > row).sum(1) * 2 + (row[:, None] == row).sum(1) + 1 for row in cells])
    between = sum((int(column) - n * (k + 1)) ** 2 for column in doubled.sum(axis=0))
    chi2 = Fraction((k - 1) * between, int(((doubled - (k + 1)) ** 2).sum()))
    return {"chi2": float(chi2), "p": float(chdtrc(k - 1, float(chi2)))}


def exact_signed_p(a: Floats, b: Floats) -> float:
    """Return Wilcoxon's two-sided p over every pattern of signs of the differences that are not zero."""
    pairs = zip(a.tolist(), b.tolist(), strict=True)
    changes = [change for x, y in pairs if (change := _as_decimal(x) - _as_decimal(y)) != 0]
    ranks = _ranks([abs(change) for change in changes])
    middle = sum(ranks, Fraction(0)) / 2
    observed = abs(sum((r for r, change in zip(ranks, changes, strict=True) if change > 0), Fraction(0)) - middle)
    patterns = product((0, 1), repeat=len(ranks))
    sums = (sum((r for r, sign in zip(ranks, pattern, strict=True) if sign), Fraction(0)) for pattern in patterns)
    return float(Fraction(sum(abs(value - middle) >= observed for value in sums), 2 ** len(ranks)))
