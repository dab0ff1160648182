"""What the tests of the statistics share: comparing numbers, and making long tables."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from palpate.analysis import StatisticsError, rm_anova
from palpate.analysis.statistics.exact import ExactEffect, exact_ratio, integers

NAMES = {  # reference name -> our column
    "SS": "SS",
    "SS_error": "SS_error",
    "df1": "ddof1",
    "df2": "ddof2",
    "F": "F",
    "p": "p_unc",
    "p_GG": "p_GG_corr",
    "p_HF": "p_HF_corr",
    "GG_eps": "eps",
    "pes": "np2",
    "ges": "ng2",
}


def relative_error(result: float, expected: float) -> float:
    """|found - expected| / |expected|; the absolute error where the expected value is 0."""
    return abs(result - expected) / (abs(expected) or 1.0)


def long_table(cells: NDArray[np.float64], label: type = str) -> pd.DataFrame:
    """One row per value of an array (participants, levels of A, levels of B, ...)."""
    where = np.indices(cells.shape).reshape(cells.ndim, -1)
    names = ("subject", "A", "B", "C")[: cells.ndim]
    labels = {name: [label(int(i)) for i in axis] for name, axis in zip(names, where, strict=True)}
    return pd.DataFrame({**labels, "y": cells.ravel()})


def same(a: pd.DataFrame, b: pd.DataFrame) -> bool:
    """Whether two results agree in every bit."""
    pd.testing.assert_frame_equal(a, b, check_exact=True)
    return True


def tell(table: pd.DataFrame, error: type[StatisticsError], **options: object) -> str:
    """What `rm_anova` says when it refuses a table like that of the fixture `table`."""
    arguments = {"dv": "y", "within": ["car", "variant"], "subject": "participant"} | options
    with pytest.raises(error) as caught:
        rm_anova(table, **arguments)  # type: ignore[arg-type]
    assert isinstance(caught.value, ValueError)
    return str(caught.value)


def exact_one_way(groups: Sequence[Sequence[float]]) -> ExactEffect:
    """Return the one-way ANOVA of groups of any sizes; epsilon is None, generalized eta squared the classical one."""
    whole, unit = integers(value for group in groups for value in group)
    numbers, n = iter(whole), len(whole)
    parts = [[next(numbers) for _ in group] for group in groups]
    sums = sum((Fraction(sum(part) ** 2, len(part)) for part in parts), Fraction(0))
    ss = (sums - Fraction(sum(whole) ** 2, n)) * unit
    error = (sum(value * value for value in whole) - sums) * unit
    df1, df2 = len(groups) - 1, n - len(groups)
    eta2 = exact_ratio(ss, ss + error)
    return ExactEffect("", ss, error, df1, df2, exact_ratio(ss * df2, error * df1), None, eta2, eta2)
