"""Raters who shift, widen, reverse or miss are seen; the numbers are those of plain NumPy."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.reliability.rater_signs import rater_signs
from palpate.analysis.reliability.sessions import session_signs
from palpate.analysis.statistics.refusals import TooFew
from tests.analysis.reliability.tables import long, wide


def signs(values: np.ndarray) -> pd.DataFrame:
    return rater_signs(long(values, int), "y", "target", "rater").set_index("rater")


def test_the_numbers_are_those_of_numpy() -> None:
    x = wide("many")
    result = signs(x)
    for i in (0, 7, 25):
        rest = np.delete(x, i, axis=1)
        assert result.loc[i, "r_others"] == pytest.approx(np.corrcoef(x[:, i], rest.mean(axis=1))[0, 1], rel=1e-12)
        assert result.loc[i, "shift"] == pytest.approx((x[:, i] - rest.mean(axis=1)).mean(), rel=1e-12)
        pooled = np.sqrt(rest.var(axis=0, ddof=1).mean())
        assert result.loc[i, "spread"] == pytest.approx(x[:, i].std(ddof=1) / pooled, rel=1e-12)


def test_planted_raters_stand_out_at_any_offset() -> None:
    x = wide("many").copy()
    x[:, 3] = 100 - x[:, 3]
    x[:, 4] += 1e9
    x[:, 5] = 5 * x[:, 5]
    result = signs(x)
    assert result["r_others"].idxmin() == 3
    assert result["shift"].idxmax() == 4
    assert result["spread"].idxmax() == 5
    assert result.loc[3, "r_others"] < -0.5


def test_gaps_and_constant_raters_are_handled_and_reported() -> None:
    x = wide("many")[:6, :4].copy()
    x[:, 0] = 0.1
    x[1:, 1] = np.nan
    x[0, 1:] = np.nan
    x[0, 1] = 50
    result = signs(x)
    assert "the rater's values do not vary" in result.loc[0, "note"]
    assert result.loc[0, "spread"] == 0
    assert (result.loc[1, "values"], result.loc[1, "missing"], result.loc[1, "shared"]) == (1, 5, 1)
    assert "three pairs" in result.loc[1, "note"]
    with pytest.raises(TooFew, match="too few raters"):
        signs(x[:, :1])


def test_the_signs_of_a_session_are_those_of_the_diagnostics() -> None:
    rows = [
        {"participant": who, "session": f"s/{who}/1", "trial": t, "stimulus": f"S{t}", "attribute": a, "value": value}
        for who in ("P1", "P2")
        for t in range(6)
        for a, value in (("rough", 50.0), ("hard", 50.0 if who == "P2" else 40.0 + t))
    ]
    result = session_signs(pd.DataFrame(rows).assign(response_time_s=2.0), (0.0, 100.0))
    straight = result[result["sign"] == "same value on all items"].set_index("participant")
    assert straight["value"].to_dict() == {"P1": 0.0, "P2": 1.0}
    assert straight["flagged"].to_dict() == {"P1": False, "P2": True}
    assert session_signs(pd.DataFrame(rows), None).empty
