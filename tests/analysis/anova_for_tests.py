"""What the tests of the statistics share: comparing numbers, and making long tables."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

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


def relative_error(found: float, expected: float) -> float:
    """|found - expected| / |expected|; the absolute error where the expected value is 0."""
    return abs(found - expected) / (abs(expected) or 1.0)


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
