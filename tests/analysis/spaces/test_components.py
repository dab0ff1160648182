"""Components are R's, unique, and whatever the order, the offset and the unit."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.spaces.components import parallel_analysis, pca, share_intervals
from palpate.analysis.spaces.profiles import gather_profiles
from palpate.analysis.statistics.refusals import BadOption, BadValue, IncompleteCells, TooFew
from tests.analysis.spaces.spaces_for_tests import attitude, in_r, ratings
from tests.examples import examples


@pytest.mark.parametrize("kind", ["covariance", "correlation"])
def test_components_are_those_of_r(kind: str) -> None:
    result, expected = pca(attitude(), kind), in_r()["prcomp"][kind]
    columns = [in_r()["attitude_columns"].index(name) for name in result.directions.index]
    rotation = np.array(expected["rotation"])[columns]
    turn = np.sign((rotation * result.directions.to_numpy()).sum(axis=0))
    assert np.sqrt(result.variances) == pytest.approx(expected["sdev"], rel=1e-13)
    assert result.directions.to_numpy() == pytest.approx(rotation * turn, abs=1e-12)
    assert result.scores.to_numpy() == pytest.approx(np.array(expected["scores"]) * turn, abs=1e-11)


def test_loadings_are_correlations_of_attributes_with_scores() -> None:
    result = pca(attitude())
    joined = np.corrcoef(attitude()[result.loadings.index], result.scores, rowvar=False)
    assert result.loadings.to_numpy() == pytest.approx(joined[:7, 7:], abs=1e-12)


def test_the_largest_coefficient_is_positive() -> None:
    directions = pca(-attitude()).directions.to_numpy()
    assert (directions[np.abs(directions).argmax(axis=0), range(7)] > 0).all()


@settings(max_examples=examples(30), deadline=None)
@given(st.integers(0, 1000), st.sampled_from([1e-150, 1.0, 1e150]), st.sampled_from([0.0, 1e9]))
def test_order_unit_and_offset_change_nothing(seed: int, unit: float, offset: float) -> None:
    whole = pd.DataFrame(np.random.default_rng(seed).integers(-50, 50, (9, 4)) * 1.0, columns=list("abcd"))
    mixed = whole.sample(frac=1, random_state=seed).sample(frac=1, axis=1, random_state=seed)
    one, two = pca(whole), pca((mixed + offset) * unit)
    assert np.array(two.variances) / unit / unit == pytest.approx(one.variances, rel=1e-12 if not offset else 1e-6)
    assert two.shares == pytest.approx(one.shares, rel=1e-6)
    assert list(two.scores.index) == list(one.scores.index)
    assert (two.scores / unit).to_numpy() == pytest.approx(one.scores.to_numpy(), abs=1e-4 if offset else 1e-11)


def test_an_offset_of_1e9_costs_nothing_on_integers() -> None:
    whole = pd.DataFrame(np.random.default_rng(1).integers(-50, 50, (20, 5)) * 1.0)
    assert pca(whole + 1e9).variances == pytest.approx(pca(whole).variances, rel=1e-13)


def test_more_attributes_than_objects_and_dependent_ones() -> None:
    assert len(pca(attitude().iloc[:4]).variances) == 3
    twice = attitude().assign(sum=attitude().sum(axis=1))
    assert len(pca(twice).variances) == 7


def test_equal_variances_are_reported() -> None:
    square = pd.DataFrame([[1, 0], [-1, 0], [0, 1], [0, -1]])
    assert "equal variances" in pca(square).notes[0]


def test_what_has_no_components_is_refused() -> None:
    with pytest.raises(BadValue, match="no attribute differs"):
        pca(pd.DataFrame({"a": [0.1 + 0.2, 0.3], "b": [1.0, 1.0]}))
    with pytest.raises(BadValue, match="'b'.*correlation"):
        pca(pd.DataFrame({"a": [1, 2, 3], "b": [4, 4, 4]}), "correlation")
    with pytest.raises(TooFew):
        pca(attitude().iloc[:1])
    with pytest.raises(BadOption, match="kind='r'"):
        pca(attitude(), "r")  # type: ignore[arg-type]
    with pytest.raises(BadValue, match="row 3, column 'raises'"):
        pca(attitude().mask(lambda t: (t == t.loc[3, "raises"]) & (t.columns == "raises") & (t.index == 3)[:, None]))


def test_parallel_analysis_finds_one_factor_and_none_in_noise() -> None:
    one = parallel_analysis(attitude(), draws=300)
    assert one.kept == 1
    assert one.table["p"].min() == 1 / 301
    noise = pd.DataFrame(np.random.default_rng(8).normal(size=(60, 6)))
    assert parallel_analysis(noise, draws=300).kept == 0
    assert parallel_analysis(attitude(), reference="permuted", draws=300).kept == 1
    assert one.table.equals(parallel_analysis(attitude().sample(frac=1, axis=1, random_state=2), draws=300).table)


def test_shares_have_intervals_over_participants() -> None:
    profiles = gather_profiles(ratings(), "value", "stimulus", "attribute", "participant")
    result = share_intervals(profiles, draws=400)
    assert (result["ci_low"] <= result["ci_high"]).all()
    assert result.loc[0, "ci_low"] < result.loc[0, "share"] + 0.05
    mixed = gather_profiles(ratings().sample(frac=1, random_state=1), "value", "stimulus", "attribute", "participant")
    assert result.equals(share_intervals(mixed, draws=400))
    alone = gather_profiles(ratings(people=1), "value", "stimulus", "attribute", "participant")
    with pytest.raises(TooFew, match="one participant"):
        share_intervals(alone)


def test_gaps_are_refused_or_reported() -> None:
    table = ratings().drop(index=[0, 1])
    names = ("value", "stimulus", "attribute", "participant")
    with pytest.raises(IncompleteCells, match="'P00'"):
        gather_profiles(table, *names)
    assert gather_profiles(table, *names, missing="listwise").dropped == ("P00",)
    some = gather_profiles(table, *names, missing="available")
    assert some.raters == (11, 12)
    without = table[(table["stimulus"] != "S1") | (table["attribute"] != "A2")]
    with pytest.raises(IncompleteCells, match="'S1' on 'A2'"):
        gather_profiles(without, *names, missing="available")


def test_groups_that_rate_their_own_stimuli_keep_their_sizes() -> None:
    table = ratings(people=10)
    first = table["participant"].isin([f"P{i:02d}" for i in range(4)])
    table = table[first == table["stimulus"].isin(["S0", "S1", "S2"])]
    profiles = gather_profiles(table, "value", "stimulus", "attribute", "participant", missing="available")
    assert profiles.raters == (4, 6)
    assert len(share_intervals(profiles, draws=100)) == 4
