"""Simulated people's ratings in memory are those that sessions record."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.modeling.doors.data import ModelDataError
from palpate.modeling.doors.reading import rated_in_lab
from palpate.modeling.doors.simulated import simulated_data, simulated_ratings
from palpate.protocols.plan import compile_plan
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from tests.modeling.doors.labs_for_doors import RECORDED, doors_small
from tests.modeling.doors.made_up import ANTONYMS, ATTRIBUTES


@pytest.fixture(scope="module")
def four():
    return simulated_ratings(4, 1)


def test_people_answer_in_memory_what_sessions_record(tmp_path):
    """P006 goes back and revises an answer."""
    lab, file = doors_small(tmp_path, []), RECORDED / "doors_small" / "study.yaml"
    study = read_study(file).study
    for who in ("P001", "P006"):
        start(lab, compile_plan(study, allocate(study, who), seed=3), simulated(study, RECORDED / "doors_small"))
    recorded, made = rated_in_lab(lab, "doors_small"), simulated_ratings(6, seed=3, study=file)
    assert recorded.individual.people == ("P001", "P006")
    assert np.array_equal(made.individual.value[[0, 5]], recorded.individual.value)
    assert made.data.source == recorded.data.source
    assert np.array_equal(made.data.force_N, recorded.data.force_N)


def test_the_shipped_study_gives_90_stimuli_with_seven_attributes_on_its_scale(four):
    data = four.data
    assert len(data) == 90 and data.attributes == ATTRIBUTES and data.antonyms == ANTONYMS
    assert data.scale == (-10, 10) and data.simulated
    assert set(data.doors) == {"BC3", "FORD", "G90", "K3", "K8", "MQ4"}
    assert set(data.variants) == {f"g{n}" for n in range(15)}
    assert set(data.raters.tolist()) == {2} and data.force_N.shape == (90, 621)
    assert {data.doors[row] for row in range(90) if data.groups[row] == "1"} == {"BC3", "FORD", "G90"}


def test_g0_and_g10_are_one_source_and_nothing_else_is(four):
    data = four.data
    source = dict(zip(data.ids, data.source, strict=True))
    assert {name for name, of in source.items() if name != of} == {f"{door}_g10" for door in set(data.doors)}
    assert source["K3_g10"] == "K3_g0"


def test_the_means_are_those_of_the_people_who_met_a_stimulus(four):
    value, data = four.individual.value, four.data
    assert four.individual.groups == ("1", "2", "1", "2")
    assert np.isnan(value[0, data.ids.index("K3_g0")]).all()
    place = data.ids.index("G90_g7")
    assert data.rating[place] == pytest.approx((value[0, place] + value[2, place]) / 2)
    assert data.sd[place] == pytest.approx(np.abs(value[0, place] - value[2, place]) / np.sqrt(2))


def test_the_same_seed_gives_the_same_people_and_another_seed_others(four):
    again, other = simulated_data(4, 1), simulated_data(4, 2)
    assert again.digest == four.data.digest and np.array_equal(again.sd, four.data.sd)
    assert other.digest != again.digest
    assert "4 simulated people, seed 1" in again.made_from[0]


def test_fewer_than_two_people_leave_doors_unrated():
    with pytest.raises(ModelDataError, match="1 simulated people: at least 2"):
        simulated_data(1)


def test_a_study_that_rates_no_doors_is_refused():
    with pytest.raises(ModelDataError, match=r"no door profile \(the column 'file'"):
        simulated_data(2, study=SHIPPED / "texture_ratings" / "study.yaml")
