"""What a plan leaves out is left out everywhere, counted and reported; a rule that selects nothing says so."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from palpate.analysis.plans.reading import AnalysisPlan
from palpate.analysis.plans.selecting import all_ratings, apply_exclusions
from palpate.analysis.ratings.dataset import DataRefused, Exclusion
from palpate.analysis.ratings.reading import imported_material
from tests.analysis.ratings_for_tests import recorded_material, small_ratings
from tests.analysis.synthetic_ratings import FAMILY, door_ratings, reasoning


@pytest.fixture(scope="module")
def material():
    return recorded_material()


def left(material, *rules):
    declared = AnalysisPlan(study="doors_small", exclusions=[{"because": "so", **rule} for rule in rules])
    return apply_exclusions(material, declared)


def test_the_material_of_the_recorded_sessions_is_whole(material):
    assert len(material.participants) == 12
    assert len(material.ratings.table) == 12 * 6 * 3
    assert len(material.trials) == 12 * 6
    assert material.levels["variant"] == ("g0", "g3", "g6")


def test_a_participant_goes_from_every_table(material):
    result = left(material, {"participants": ["P003"]})
    for table in (result.material.ratings.table, result.material.trials, result.material.forms):
        assert "P003" not in set(table["participant"])
    assert [(line.what, line.who, line.rows) for line in result.lines] == [("participant", "P003", 18)]


def test_an_unknown_participant_is_refused_by_the_nearest_name(material):
    with pytest.raises(DataRefused, match="'P03', who has no session; did you mean 'P003'"):
        left(material, {"participants": ["P03"]})


def test_trials_by_their_seconds(material):
    table = material.ratings.table
    seconds = table.groupby(["participant", "trial"])["response_time_s"].max()
    limit = float(seconds.median()) + 1e-6
    fast, slow = left(material, {"faster_than_s": limit}), left(material, {"slower_than_s": limit})
    assert len(fast.material.trials) + len(slow.material.trials) == 72
    assert sum(line.rows for line in fast.lines) == 72 - len(fast.material.trials) > 0


def test_trials_of_choices_by_their_seconds(material):
    choices = pd.DataFrame({"participant": "P1", "session": "s", "trial": [1, 2, 3], "rt_s": [0.4, 0.1, 0.3]})
    chosen = replace(
        material, ratings=None, own={"choices": choices}, trials=choices, words=choices[:0], forms=choices[:0]
    )
    result = left(chosen, {"faster_than_s": 0.2}, {"slower_than_s": 0.35})
    assert result.material.choices["trial"].tolist() == result.material.trials["trial"].tolist() == [3]
    with pytest.raises(DataRefused, match="no response times are recorded"):
        left(replace(chosen, own={"choices": choices.drop(columns="rt_s")}), {"faster_than_s": 0.2})


def test_trials_by_their_columns(material):
    result = left(material, {"where": {"variant": "g6"}})
    assert set(result.material.ratings.table["variant"]) == {"g0", "g3"}
    with pytest.raises(DataRefused, match="no variant 'g66'; did you mean 'g6'"):
        left(material, {"where": {"variant": "g66"}})


def test_single_ratings_far_from_the_others_in_their_cell(material):
    result = left(material, {"outlying": {"sd": 1.5}})
    dropped = len(material.ratings.table) - len(result.material.ratings.table)
    assert dropped == sum(line.rows for line in result.lines) > 0
    assert len(result.material.trials) == 72
    assert left(material, {"outlying": {"sd": 1e6}}).lines[0].what == "nothing"


def test_rules_follow_each_other(material):
    table = left(material, {"where": {"variant": "g6"}}, {"participants": ["P001", "P002"]}).material.ratings.table
    assert len(table) == 10 * 4 * 3


def test_nobody_left_is_refused(material):
    with pytest.raises(DataRefused, match="leave nobody"):
        left(material, {"participants": list(material.participants)})


def test_flagged_raters_go_at_the_number_of_flags_requested(material):
    one, many = left(material, {"flagged": 1}), left(material, {"flagged": 9})
    assert len(many.material.participants) == 12
    assert len(one.material.participants) <= 12


def test_an_answer_of_less_than_its_share(material):
    assert len(left(material, {"fewer_than": 1.0}).material.participants) == 12


def test_a_later_rule_may_name_whom_or_what_an_earlier_one_left_out(material):
    rules = ({"participants": ["P003"]}, {"participants": ["P003"]}, {"where": {"participant": "P003"}})
    result = left(material, *rules)
    assert [(line.what, line.rows) for line in result.lines] == [("participant", 18), ("nothing", 0), ("nothing", 0)]


def test_somebody_who_answered_a_form_and_no_trial_has_answered_too_few(material):
    planned = {**material.planned, "doors_small/P099/1": 6}
    form = {"participant": "P099", "session": "doors_small/P099/1", "group": "", "form": "demographics"}
    forms = pd.DataFrame([{**form, "attribute": "hand", "value": float("nan"), "text": "left"}])
    result = left(replace(material, planned=planned, forms=forms), {"fewer_than": 0.5})
    assert [(line.who, line.rows) for line in result.lines] == [("P099", 0)]
    assert "P099" not in result.material.participants


def imported():
    rows = [(f"P{p}", "Soft", level, float(p)) for p in range(3) for level in ("a", "b")]
    return imported_material(small_ratings(rows), "")


def test_trials_of_an_imported_table_are_left_out_by_its_columns():
    result = left(imported(), {"where": {"level": "a", "participant": ["P1", "P2"]}})
    assert [(line.what, line.who, line.rows) for line in result.lines] == [("trials", "P1", 1), ("trials", "P2", 1)]
    rows = result.material.ratings.table
    assert list(zip(rows["participant"], rows["level"], strict=True)) == [
        ("P0", "a"), ("P0", "b"), ("P1", "b"), ("P2", "b"),
    ]  # fmt: skip


def test_a_rule_may_name_somebody_whom_reading_left_out(material):
    exclusion = Exclusion("session", "P098, session doors_small/P098/1", "the participant withdrew", 18)
    whole = replace(material, exclusions=(*material.exclusions, exclusion))
    result = left(whole, {"participants": ["P098"]}, {"where": {"participant": "P098"}})
    assert [line.what for line in result.lines] == ["nothing", "nothing"]
    with pytest.raises(DataRefused, match="'P097', who has no session"):
        left(whole, {"where": {"participant": ["P001", "P097"]}})


@pytest.mark.parametrize("rule", [{"fewer_than": 0.5}, {"flagged": 1}])
def test_what_looks_at_sessions_is_refused_where_none_is_on_record(rule):
    with pytest.raises(DataRefused, match="no session is recorded|declared scale"):
        left(imported(), rule)


def test_levels_are_in_the_study_s_order_and_only_those_that_occur() -> None:
    ratings = door_ratings(people=1, attributes=2)
    rows = ratings.table[ratings.table["variant"] != "g2"].reset_index(drop=True)
    selected = all_ratings(replace(ratings, table=rows))
    assert selected.levels["variant"] == tuple(level for level in FAMILY if level != "g2")
    assert selected.levels["augmentation"] == tuple(dict.fromkeys(FAMILY.values()))
    assert selected.levels["participant"] == ("P100", "P200")
    assert selected.outcomes == ratings.attributes and selected.antonyms == ratings.antonyms


def test_a_trial_is_one_row_however_many_attributes_were_rated_in_it() -> None:
    ratings = door_ratings(people=1, attributes=3)
    table = ratings.table.assign(response_time_s=ratings.table.index / 7, revised=ratings.table.index % 2 == 0)
    selected = all_ratings(replace(ratings, table=table))
    assert len(selected.trials) * 3 == len(selected.table)
    assert not {"attribute", "value", "response_time_s", "revised"} & set(selected.trials.columns)


def test_the_ends_of_the_scale_are_the_declared_ones_or_none() -> None:
    assert all_ratings(reasoning()).scale == (0, 100)
    assert all_ratings(replace(reasoning(), scale=None)).scale is None
