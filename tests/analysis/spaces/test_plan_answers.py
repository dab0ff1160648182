"""Spaces as an analysis plan asks for them: plain rows, tables beside, mistakes refused by name."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.plans import kinds
from palpate.analysis.plans.answers import Answer, Selected
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.spaces.components import pca
from palpate.analysis.spaces.profiles import gather_profiles
from palpate.analysis.statistics.refusals import IncompleteCells, StatisticsError, TooFew
from tests.analysis.spaces.spaces_for_tests import ratings


def selected(table: pd.DataFrame | None = None) -> Selected:
    rows = ratings(people=10, stimuli=9) if table is None else table
    if "group" not in rows:
        rows = rows.assign(group=np.where(rows["participant"] < "P05", "1", "2"))
    return Selected(rows, rows.drop(columns=["value"]), ("A0", "A1", "A2", "A3"), {}, seed=3, draws=99)


def answer(test: str, given: Selected | None = None, **settings: Any) -> Answer:
    kind, given = kinds.TESTS[test], given or selected()
    before = given.table.copy()
    result = kind.answer(given, kind.settings.model_validate({"name": "x", "test": test, **settings}))
    pd.testing.assert_frame_equal(before, given.table)
    for row in (*result.rows, *(row for rows in result.more.values() for row in rows)):
        for name, value in row.items():
            assert value is None or type(value) in (float, int, str, bool), (name, value)
            assert not isinstance(value, float) or math.isfinite(value), (name, value)
            assert not name.startswith("p") or name not in ("p", "p_F") or value is None or value > 0
    return result


def test_components_with_variances_and_loadings() -> None:
    result = answer("pca", scaled=True)
    profiles = gather_profiles(ratings(10, 9), "value", "stimulus", "attribute", "participant")
    expected = pca(profiles.means(), "correlation")
    assert [row["stimulus"] for row in result.rows] == list(expected.scores.index)
    assert [row["pc1"] for row in result.rows] == pytest.approx(expected.scores["PC1"].tolist(), rel=1e-9)
    first = result.more["variances"][0]
    assert first["ci_low"] < first["ci_high"]
    assert {"reference_quantile", "kept", "p", "cumulative"} <= set(first)
    assert result.more["loadings"][0]["attribute"] == "A0"
    assert "parallel analysis keeps" in result.headline
    assert (result.participants, result.values) == (10, 360)


def test_a_map_with_all_that_a_figure_needs() -> None:
    result = answer("mds", replications=40, reference=19, starts=4, scree=3)
    assert set(result.rows[0]) == {"stimulus", "dim1", "dim2"}
    ellipse = result.more["ellipses"][0]
    assert {"stimulus", "centre_1", "centre_2", "semi_major", "semi_minor", "angle_deg"} <= set(ellipse)
    assert ellipse["centre_1"] == result.rows[0]["dim1"]
    assert [row["dimensions"] for row in result.more["scree"]] == [1, 2, 3]
    assert [row["starts"] for row in result.more["scree"]] == [3, 5, 3]  # the map's own is not looked for again
    assert "19 shuffles" in result.headline
    assert len(result.more["shepard"]) == 36
    assert result.headline.startswith("Stress-1 = 0")


def test_a_classical_map_of_one_participant_has_no_ellipses_and_says_why() -> None:
    alone = selected(ratings(people=1))
    result = answer("mds", alone, method="classical")
    assert "ellipses" not in result.more
    assert any("one participant" in note for note in result.notes)
    assert "ellipses" not in answer("mds", method="classical", dimensions=1).more


def test_a_map_from_ratings_of_pairs() -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(size=(6, 2))
    rows = [
        {"participant": f"P{p}", "a": f"S{i}", "b": f"S{j}", "attribute": "similar"}
        | {"value": 10 - np.hypot(*(points[i] - points[j])) + 0.1 * rng.normal()}
        for p in range(5)
        for i in range(6)
        for j in range(i)
    ]
    given = Selected(pd.DataFrame(rows), pd.DataFrame(rows), ("similar",), {}, seed=1)
    settings = {"pairs": ["a", "b"], "meaning": "similarity", "top": 10, "method": "classical", "replications": 30}
    result = answer("mds", given, **settings)
    assert len(result.rows) == 6
    assert "10 - mean similarity" in result.method
    assert len(result.more["ellipses"]) == 6
    with pytest.raises(DataRefused, match="one outcome"):
        answer("mds", replace(given, outcomes=("similar", "other")), **settings)
    with pytest.raises(DataRefused, match="no column 'c'"):
        answer("mds", given, **{**settings, "pairs": ["a", "c"]})


def test_groups_are_compared_in_pairs() -> None:
    result = answer("procrustes")
    (row,) = result.rows
    assert (row["group_a"], row["group_b"], row["participants_a"], row["stimuli"]) == ("1", "2", 5, 9)
    assert row["r"] > 0.8
    assert row["p"] == 1 / 100
    assert len(result.more["residuals"]) == 9
    with pytest.raises(TooFew, match="one level"):
        answer("procrustes", replace(selected(), table=selected().table.assign(group="1")))
    with pytest.raises(DataRefused, match="several levels"):
        answer("procrustes", groups="stimulus")


def test_groups_without_stimuli_in_common_cannot_be_compared() -> None:
    table = selected().table
    apart = table[(table["group"] == "1") == table["stimulus"].isin(["S0", "S1", "S2", "S3"])]
    with pytest.raises(TooFew, match="0 stimuli in common"):
        answer("procrustes", selected(apart))


def test_halves_tell_how_reliable_a_map_is() -> None:
    (row,) = answer("procrustes", halves=True, draws=20).rows
    assert 0 < row["r_low"] <= row["r"] <= row["r_high"] <= 1
    assert row["splits"] == 20


@pytest.mark.parametrize("on", ["classical", "nonmetric", "pca"])
def test_attributes_are_directions_in_the_map(on: str) -> None:
    result = answer("vectors", on=on, starts=3)
    assert [row["attribute"] for row in result.rows] == ["A0", "A1", "A2", "A3"]
    assert {"direction_1", "direction_2", "r2", "p", "note"} <= set(result.rows[0])
    assert result.rows[0]["direction_1"] ** 2 + result.rows[0]["direction_2"] ** 2 == pytest.approx(1)
    assert "configuration" in result.more


def test_the_vectors_map_is_the_map() -> None:
    one = answer("mds", starts=3, replications=0, reference=0, scree=0)
    two = answer("vectors", on="nonmetric", starts=3)
    assert one.rows == two.more["configuration"]


def test_gaps_are_treated_as_declared_and_reported() -> None:
    gappy = selected(ratings(10, 9).drop(index=[0]))
    assert any("9 to 10 of 10" in note for note in answer("pca", gappy).notes)
    assert answer("pca", gappy, missing="listwise").participants == 9
    for missing in ("refuse", "mixed_model"):  # a space has no form that takes gaps by a mixed model
        with pytest.raises(IncompleteCells, match="'P00'.*missing='listwise'"):
            answer("pca", gappy, missing=missing)
    with pytest.raises(DataRefused, match="did you mean 'stimulus'"):
        answer("pca", over="stimulis")
    with pytest.raises(StatisticsError):
        answer("mds", dimensions=20)
    for setting in ("replications", "reference"):
        with pytest.raises(ValueError, match="0 \\(none\\) or 19 and more"):
            answer("mds", **{setting: 5})


def test_the_order_of_rows_changes_nothing() -> None:
    mixed = selected(ratings(10, 9).sample(frac=1, random_state=4))
    for test, settings in (
        ("pca", {}),
        ("mds", {"starts": 2, "replications": 20, "reference": 0}),
        ("vectors", {"on": "pca"}),
    ):
        assert answer(test, **settings) == answer(test, mixed, **settings)


def test_offset_costs_no_digits() -> None:
    table = ratings(10, 9)
    whole = table.assign(value=(table["value"] * 64).round())
    one = answer("mds", selected(whole), method="classical", replications=0)
    two = answer("mds", selected(whole.assign(value=whole["value"] + 1e9)), method="classical", replications=0)
    assert one.rows == two.rows
