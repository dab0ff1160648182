"""The table that tests of refusals, labels and values share."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.analysis.statistics.anova_for_tests import long_table


@pytest.fixture
def table() -> pd.DataFrame:
    """8 participants who rated 3 cars in 2 variants each, labels as text."""
    cells = np.round(np.random.default_rng(6).normal(5, 2, (8, 3, 2)), 1)
    result = long_table(cells).rename(columns={"A": "car", "B": "variant", "subject": "participant"})
    result["participant"] = "P00" + result["participant"]
    return result.assign(car=result["car"].map({"0": "BC3", "1": "FORD", "2": "G90"}))
