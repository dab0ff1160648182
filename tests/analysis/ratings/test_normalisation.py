"""Ratings on another scale: exact at the ends, each participant's own, and refused by name where there is none."""

from __future__ import annotations

import random

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.normalisation import normalised
from palpate.analysis.statistics.refusals import BadValue
from tests.examples import examples


def table(**people: list[float]) -> pd.DataFrame:
    rows = [(who, "Hard", value) for who, values in people.items() for value in values]
    return pd.DataFrame(rows, columns=["participant", "attribute", "value"])


def values(normalised_ratings: tuple[pd.DataFrame, object]) -> list[float]:
    return normalised_ratings[0]["value"].tolist()


def test_the_declared_ends_and_the_middle_go_exactly_to_the_new_ones() -> None:
    result = normalised(table(P1=[-10.0, -9.0, 0.0, 10.0]), (-10, 10), "to_-100_100")
    assert values(result) == [-100.0, -90.0, 0.0, 100.0]
    assert result[1] == (-100.0, 100.0)
    assert values(normalised(table(P1=[1.0, 4.0, 7.0]), (1, 7), "to_0_100")) == [0.0, 50.0, 100.0]
    assert values(normalised(table(P1=[0.1, 33.3]), (0, 100), "to_0_100")) == [0.1, 33.3]


def test_nothing_in_the_table_given_changes() -> None:
    given_table = table(P1=[1.0, 2.0])
    normalised(given_table, (0, 10), "to_0_100")
    assert given_table["value"].tolist() == [1.0, 2.0]


def test_each_participant_s_range_becomes_0_to_100_and_a_missing_rating_stays_missing() -> None:
    rescaled, scale = normalised(table(P1=[2.0, np.nan, 4.0, 3.0], P2=[0.0, 10.0]), (0, 10), "range_within_participant")
    np.testing.assert_array_equal(rescaled["value"], [0, np.nan, 100, 50, 0, 100])
    assert scale == (0.0, 100.0)


@pytest.mark.parametrize("how", ["z_within_participant", "range_within_participant"])
def test_whoever_has_no_spread_is_named(how: str) -> None:
    with pytest.raises(DataRefused, match=r"P2 on Hard \(all 3 ratings are 0\.3\); P3 on Hard \(one rating\)"):
        normalised(table(P1=[1.0, 2.0], P2=[0.3, 0.1 + 0.2, 0.3], P3=[5.0]), None, how)


def test_what_a_scale_cannot_hold_is_refused() -> None:
    with pytest.raises(DataRefused, match="needs the ends of the rating scale"):
        normalised(table(P1=[1.0]), None, "to_0_100")
    with pytest.raises(DataRefused, match=r"from 0 to 10: 11 of P1 in row 2"):
        normalised(table(P1=[1.0, 11.0]), (0, 10), "to_0_100")
    with pytest.raises(DataRefused, match="did you mean 'to_0_100'"):
        normalised(table(P1=[1.0]), (0, 10), "to_0_10")
    with pytest.raises(BadValue, match="inf in row 1"):
        normalised(table(P1=[np.inf, 1.0]), None, "z_within_participant")


def test_an_offset_of_a_billion_costs_z_no_digit() -> None:
    small = [0.0, 1.0, 3.0, 7.0]
    near = values(normalised(table(P1=small), None, "z_within_participant"))
    far = values(normalised(table(P1=[1e9 + value for value in small]), None, "z_within_participant"))
    assert far == pytest.approx(near, rel=1e-15)


whole = st.lists(st.integers(-50, 50), min_size=3, max_size=9, unique=True)


@settings(max_examples=examples(30), deadline=None)
@given(whole, st.integers(0, 1000), st.sampled_from([1.0, 4.0, 1e-3, 1e6]), st.randoms())
def test_neither_the_order_of_rows_nor_the_unit_changes_a_z(
    rows: list[int], shift: int, unit: float, draw: random.Random
) -> None:
    data = table(P1=[float(value) for value in rows], P2=[1.0, 2.0])
    mixed = data.sample(frac=1, random_state=draw.randrange(10_000))
    first = normalised(data, None, "z_within_participant")[0]["value"]
    np.testing.assert_array_equal(normalised(mixed, None, "z_within_participant")[0]["value"].sort_index(), first)
    moved = data.assign(value=(data["value"] + shift) * unit)
    np.testing.assert_allclose(
        normalised(moved, None, "z_within_participant")[0]["value"], first, rtol=1e-9, atol=1e-12
    )
