"""What people answered, joined with the profiles that they felt: right, or refused by name."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.plans.reading import PlanError
from palpate.analysis.ratings.dataset import DataRefused, Ratings, Scale
from palpate.analysis.ratings.rating_files import save_ratings
from palpate.modeling.doors.rated import Questions, StimulusProfile, rated_of
from palpate.modeling.doors.reading import rated_in_lab, read_lab, simulated_data, simulated_ratings
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.plan import compile_plan
from palpate.protocols.reading import StudyError
from palpate.signals.doors.profile_file import read_profile as read_by_the_door
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.collecting.collect import collect, open_database
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.participants.withdrawal import withdraw
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from tests.analysis.exporting.labs import rewritten
from tests.modeling.doors.data_for_tests import ANTONYMS, ATTRIBUTES
from tests.modeling.doors.labs_for_doors import RECORDED, doors_small

SMALL = ("Easy-to-pull", "Damped", "Luxurious")


@pytest.fixture
def lab(tmp_path):
    return doors_small(tmp_path, range(1, 5))


def expected(people):
    """The means of the view `ratings`, as plain tables of the recorded sessions hold it; practice does not count."""
    table = pd.read_csv(RECORDED / "expected" / "ratings.csv")
    return table[table["participant"].isin(people) & ~table["practice"].astype(bool)]


def test_a_labs_sessions_give_profiles_and_mean_ratings(lab):
    data = read_lab(lab, "doors_small")
    assert data.ids == ("BC3_g0", "BC3_g3", "BC3_g6", "K3_g0", "K3_g3", "K3_g6")
    assert (data.attributes, data.antonyms) == (SMALL, ("Hard-to-pull", "Recoiling", "Cheap"))
    assert data.doors == ("BC3",) * 3 + ("K3",) * 3 and data.variants == ("g0", "g3", "g6") * 2
    assert data.scale == (-10, 10) and data.simulated and set(data.groups) == {""}
    rows = expected({"P001", "P002", "P003", "P004"}).groupby(["stimulus", "attribute"])["value"]
    for place, name in enumerate(data.ids):
        assert data.rating[place] == pytest.approx([rows.mean()[name, word] for word in SMALL], abs=1e-12)
        assert data.sd[place] == pytest.approx([rows.std()[name, word] for word in SMALL], abs=1e-12)
        assert data.raters[place] == 4
        file = lab / "studies" / "doors_small" / "profiles" / f"{name}.csv"
        assert data.force_N[place].tolist() == list(read_by_the_door(file))


def test_what_the_data_came_from_is_reported_by_name_and_digest(lab):
    sources = read_lab(lab, "doors_small").made_from
    assert sources[0].startswith("study doors_small ")
    assert [line.split()[0] for line in sources[1:5]] == [f"doors_small_P00{n}_s1.sqlite" for n in range(1, 5)]
    assert sources[-1].startswith("6 door profiles ") and all(len(line.split()[-1]) == 64 for line in sources)


def test_a_collected_database_gives_the_same_where_the_session_files_are_elsewhere(lab):
    from_files = read_lab(lab, "doors_small")
    engine = open_database(f"sqlite:///{lab / 'lab.sqlite'}")
    list(collect(sorted((lab / "sessions").glob("*.sqlite")), engine))
    engine.dispose()
    shutil.rmtree(lab / "sessions")
    assert read_lab(lab, "doors_small").digest == from_files.digest


def test_who_withdrew_is_left_out_and_reported(lab):
    registry = open_registry(lab)
    enter(registry, "P002")
    withdraw(registry, "P002", "asked to")
    rated = rated_in_lab(lab, "doors_small")
    assert rated.individual.people == ("P001", "P003", "P004")
    assert [line for line in rated.data.made_from if "P002" in line and "withdrew" in line]


def test_an_unfinished_session_is_left_out_unless_the_plan_takes_it(lab):
    sessions = lab / "sessions"
    rewritten(RECORDED / "sessions" / "doors_small_P005_s1.sqlite", sessions / "doors_small_P005_s1.sqlite", upto=30)
    assert "P005" not in rated_in_lab(lab, "doors_small").individual.people
    plan = lab / "studies" / "doors_small" / "analysis.yaml"
    plan.write_text(
        "study: doors_small\nsessions: also_interrupted\ntests: [{name: means, test: means, by: [variant]}]\n"
    )
    rated = rated_in_lab(lab, "doors_small")
    assert rated.individual.people[-1] == "P005"
    assert set(rated.data.raters.tolist()) == {4, 5}, "P005 came as far as some of the stimuli"


def test_whom_the_plan_excludes_is_left_out(lab):
    plan = lab / "studies" / "doors_small" / "analysis.yaml"
    rule = (
        "exclusions: [{participants: [P003], because: was ill}]\ntests: [{name: means, test: means, by: [variant]}]\n"
    )
    plan.write_text(f"study: doors_small\n{rule}")
    rated = rated_in_lab(lab, "doors_small")
    assert rated.individual.people == ("P001", "P002", "P004")
    assert "left out: P003: was ill" in rated.data.made_from
    plan.write_text(f"study: door_ratings\n{rule}")
    with pytest.raises(PlanError, match="found 'door_ratings', the plan of 'doors_small'"):
        read_lab(lab, "doors_small")


def test_people_who_felt_another_version_of_the_study_are_never_mixed_in(lab):
    source = RECORDED / "sessions" / "doors_small_P005_s1.sqlite"
    from palpate.studies.sessions.record import read

    changed = {**read(source).header["study"], "title": "Doors, changed"}
    rewritten(source, lab / "sessions" / "doors_small_P005_s1.sqlite", header={"study": changed})
    with pytest.raises(DataRefused, match="was changed between participants"):
        read_lab(lab, "doors_small")


def test_simulated_people_are_not_taken_where_real_ones_are_requested(lab):
    with pytest.raises(DataRefused, match="no session is left"):
        read_lab(lab, "doors_small", simulated=False)


def test_a_profile_that_is_not_the_one_people_felt_is_refused(lab):
    file = lab / "studies" / "doors_small" / "profiles" / "K3_g3.csv"
    file.write_bytes(file.read_bytes().replace(b"\n30.0,", b"\n30.0,1", 1))
    with pytest.raises(ModelDataError, match=r"K3_g3\.csv: not the file that people felt"):
        read_lab(lab, "doors_small")


def test_a_profile_that_is_gone_is_named(lab):
    """As in a lab that took its study's folder away; the study is found, one of its files is not."""
    (lab / "studies" / "doors_small" / "profiles" / "K3_g3.csv").unlink()
    with pytest.raises(ModelDataError, match=r"stimulus 'K3_g3': no door profile .*K3_g3\.csv"):
        read_lab(lab, "doors_small")


@pytest.mark.parametrize(
    ("study", "error", "says"),
    [
        ("door_rating", StudyError, "did you mean 'door_ratings'"),
        ("door_ratings", DataRefused, "no sessions of a study 'door_ratings'"),
        ("doors_smal", StudyError, "did you mean 'doors_small'"),
    ],
)
def test_a_study_without_sessions_is_refused_by_name(lab, study, error, says):
    with pytest.raises(error, match=says):
        read_lab(lab, study)


def test_a_lab_that_is_none_is_refused(tmp_path):
    with pytest.raises(DataRefused, match="nowhere: no such lab"):
        read_lab(tmp_path / "nowhere")


def imported(lab, **columns):
    """A data set imported under the name `others`: two people, two doors."""
    rows = [
        {"participant": who, "attribute": "Heavy", "value": value, "stimulus": door, "file": f"{door}.csv"}
        for who, value in (("a", 1.0), ("b", 3.0))
        for door in ("BC3_g0", "K3_g0")
    ]
    table = pd.DataFrame(rows).assign(**columns)
    ratings = Ratings("others", table, ("stimulus",), (), ("Heavy",), Scale(0, 5), (), antonyms={"Heavy": "Light"})
    save_ratings(ratings, lab / "imported" / "others")
    (lab / "studies" / "others").mkdir()
    for door in ("BC3_g0", "K3_g0"):
        shutil.copyfile(
            RECORDED / "doors_small" / "profiles" / f"{door}.csv", lab / "studies" / "others" / f"{door}.csv"
        )


def test_an_imported_data_set_that_carries_profiles_is_read_like_a_study(lab):
    imported(lab, car=["BC3", "K3"] * 2)
    data = read_lab(lab, "others")
    assert (data.ids, data.doors, data.variants) == (("BC3_g0", "K3_g0"), ("BC3", "K3"), ("BC3_g0", "K3_g0"))
    assert data.rating.tolist() == [[2.0], [2.0]] and data.scale == (0, 5) and not data.simulated


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({"file": ["BC3_g0.csv", "K3_g0.csv", "K3_g0.csv", "K3_g0.csv"]}, "'BC3_g0' has more than one file"),
        ({"file": "K9.csv"}, r"stimulus 'BC3_g0': no door profile .*K9\.csv"),
        ({"file": ""}, r"stimulus 'BC3_g0': no door profile \(the column 'file' of its table is empty"),
        ({"value": [1.0, 7.0, 3.0, 3.0]}, "a rated K3_g0 7 on Heavy: a number on the scale from 0 to 5"),
    ],
)
def test_an_imported_data_set_without_its_profiles_or_off_its_scale_is_refused(lab, columns, says):
    imported(lab, **columns)
    with pytest.raises((ModelDataError, DataRefused), match=says):
        read_lab(lab, "others")


def ratings(*rows):
    return pd.DataFrame(rows, columns=["participant", "group", "stimulus", "attribute", "value"])


def shown(*levels):
    return [
        StimulusProfile(name, name, "g0", np.linspace(0, level, 621))
        for name, level in zip("ABCD", levels, strict=False)
    ]


QUESTIONS = Questions(("Soft", "Warm"), ("Hard", "Cold"), (-10.0, 10.0))
WHOLE = [
    (who, group, name, word, 1.0)
    for who, group in (("p", "1"), ("q", "2"))
    for name in "AB"
    for word in ("Soft", "Warm")
]


def of(stimuli, *rows, **how):
    return rated_of(stimuli, QUESTIONS, ratings(*rows), simulated=False, made_from=(), **how)


def test_a_person_who_rated_twice_counts_once():
    data = of(shown(1, 2), *WHOLE, ("p", "1", "A", "Soft", 5.0)).data
    assert data.rating.tolist() == [[2.0, 1.0], [1.0, 1.0]]  # (3 + 1) / 2
    assert data.raters.tolist() == [2, 2] and data.groups == ("1+2", "1+2")


def test_one_rater_has_no_sd_rather_than_one_of_zero():
    data = of(shown(1, 2), *WHOLE[:4]).data
    assert np.isnan(data.sd).all() and data.raters.tolist() == [1, 1]


def test_a_stimulus_without_ratings_is_named_or_left_out_on_request():
    with pytest.raises(ModelDataError, match="no ratings of C, D on every attribute.*rated_only"):
        of(shown(1, 2, 3, 4), *WHOLE, ("p", "1", "C", "Soft", 0.0))
    rated = of(shown(1, 2, 3, 4), *WHOLE, rated_only=True)
    assert rated.data.ids == ("A", "B") and rated.individual.value.shape == (2, 2, 2)


@pytest.mark.parametrize(
    ("stimuli", "rows", "says"),
    [
        (shown(1, 2), [row for row in WHOLE if row[3] == "Soft"], "nobody rated Warm"),
        (shown(1, 2), [(*row[:4], float("nan")) for row in WHOLE], "nobody rated Soft, Warm"),
        (shown(1), [row for row in WHOLE if row[2] == "A"], "1 stimulus: nothing can be learned"),
        (shown(1, 1), WHOLE, "2 stimuli, of one force profile: nothing can be learned"),
        (shown(1, 2), [*WHOLE, ("q", "2", "A", "Soft", 10.5)], "q rated A 10.5 on Soft"),
    ],
)
def test_what_nothing_can_be_learned_from_is_refused(stimuli, rows, says):
    with pytest.raises((ModelDataError, DataRefused), match=says):
        of(stimuli, *rows)


def test_two_different_stimuli_are_enough(lab):
    data = read_lab(lab, "doors_small")
    assert len(replace(data.rows(np.array([0, 3])))) == 2


@pytest.fixture(scope="module")
def four():
    return simulated_ratings(4, 1)


def test_people_answer_in_memory_what_sessions_record(tmp_path):
    """P006 goes back and revises an answer."""
    lab, file = doors_small(tmp_path, []), RECORDED / "doors_small" / "study.yaml"
    study = read_study(file).study
    for who in ("P001", "P006"):
        start(lab, compile_plan(study, allocate(study, who), seed=3), simulated(study, RECORDED / "doors_small"))
    recorded, simulated_rated = rated_in_lab(lab, "doors_small"), simulated_ratings(6, seed=3, study=file)
    assert recorded.individual.people == ("P001", "P006")
    assert np.array_equal(simulated_rated.individual.value[[0, 5]], recorded.individual.value)
    assert simulated_rated.data.source == recorded.data.source
    assert np.array_equal(simulated_rated.data.force_N, recorded.data.force_N)


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


def test_the_means_are_those_of_the_people_who_felt_a_stimulus(four):
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
