"""A whole data set as a selection: the study's order of levels, one row for each trial, the ends of its scale."""

from __future__ import annotations

from dataclasses import replace

from palpate.analysis.plans.selecting import all_ratings
from tests.analysis.synthetic_ratings import FAMILY, door_ratings, reasoning


def test_levels_stand_in_the_study_s_order_and_only_those_that_occur() -> None:
    ratings = door_ratings(people=1, attributes=2)
    kept = ratings.table[ratings.table["variant"] != "g2"].reset_index(drop=True)
    found = all_ratings(replace(ratings, table=kept))
    assert found.levels["variant"] == tuple(level for level in FAMILY if level != "g2")
    assert found.levels["augmentation"] == tuple(dict.fromkeys(FAMILY.values()))
    assert found.levels["participant"] == ("P100", "P200")
    assert found.outcomes == ratings.attributes and found.antonyms == ratings.antonyms


def test_a_trial_is_one_row_however_many_attributes_were_rated_in_it() -> None:
    ratings = door_ratings(people=1, attributes=3)
    table = ratings.table.assign(response_time_s=ratings.table.index / 7, revised=ratings.table.index % 2 == 0)
    found = all_ratings(replace(ratings, table=table))
    assert len(found.trials) * 3 == len(found.table)
    assert not {"attribute", "value", "response_time_s", "revised"} & set(found.trials.columns)


def test_the_ends_of_the_scale_are_the_declared_ones_or_none() -> None:
    assert all_ratings(reasoning()).scale == (0, 100)
    assert all_ratings(replace(reasoning(), scale=None)).scale is None
