"""Pairs turned round are the tests of the differences turned round."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.statistics.pairwise import pairs_in_order, pairwise_tests

LEVELS = ("a", "b", "c")


def ratings() -> pd.DataFrame:
    draw = np.random.Generator(np.random.PCG64(5))
    rows = [(f"P{i}", level, k + draw.normal()) for i in range(7) for k, level in enumerate(LEVELS)]
    return pd.DataFrame(rows, columns=["participant", "level", "value"])


def test_an_order_turned_round_is_the_test_of_the_negative_values() -> None:
    options = {"within": "level", "subject": "participant", "effect_interval": 0.95}
    table = pairwise_tests(ratings(), "value", **options)
    negative = pairwise_tests(ratings().assign(value=lambda t: -t["value"]), "value", **options)
    turned = pairs_in_order(table, ("c", "b", "a"))
    assert [(row["A"], row["B"]) for row in turned] == [("c", "b"), ("c", "a"), ("b", "a")]
    expected = {(row["B"], row["A"]): row for row in negative.to_dict("records")}
    for row in turned:
        for name in ("mean_diff", "ci_low", "ci_high", "T", "dz", "dz_low", "dz_high", "p_unc", "p_corr"):
            assert row[name] == pytest.approx(expected[row["A"], row["B"]][name], rel=1e-12), name


def test_levels_without_a_place_come_last() -> None:
    table = pairwise_tests(ratings(), "value", within="level", subject="participant")
    assert [(row["A"], row["B"]) for row in pairs_in_order(table, ("c",))] == [("c", "a"), ("c", "b"), ("a", "b")]
    assert pairs_in_order(table, LEVELS) == table.to_dict("records")
