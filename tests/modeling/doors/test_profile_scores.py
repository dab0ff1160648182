"""Simulated people who never met the training data."""

import dataclasses

import numpy as np
import pytest

from palpate.modeling.doors.profile_scores import Perceivers, door_ratings
from palpate.modeling.doors.reading import read_profile
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.studies.catalogue import SHIPPED

FOLDER = SHIPPED / "door_ratings"


@pytest.fixture(scope="module")
def doors():
    """Six of the study's own profiles, of both groups."""
    names = [f"{car}_g{n}" for car, n in (("BC3", 0), ("FORD", 3), ("G90", 6), ("K3", 1), ("K8", 9), ("MQ4", 14))]
    return np.array([read_profile(FOLDER / "profiles" / f"{name}.csv") for name in names])


def quiet(**changes):
    study = door_ratings()
    update = {"gain_sd": 0, "bias_sd": 0, "noise_sd": 0, "lapse_rate": 0, **changes}
    return study.model_copy(update={"simulation": study.simulation.model_copy(update=update)})


def test_a_profile_of_the_study_is_felt_as_the_study_has_it(doors):
    """The table's columns are those of the file, rounded to four decimals: the latents agree to 1e-3."""
    people = Perceivers(people=1)
    person, stimuli = people.persons[0], {s.id: s for s in people.study.stimuli}
    expected = [person.latent(name, stimuli["BC3_g0"]) for name in people.attributes]
    assert people.felt(doors[:1])[0] == pytest.approx(expected, abs=1e-3)


def test_people_without_gain_bias_or_noise_answer_what_is_felt_in_steps(doors):
    people = Perceivers(people=3, study=quiet())
    assert np.abs(people.rate(doors) - people.felt(doors)).max() <= 0.5
    assert np.array_equal(people.rate(doors), np.round(people.rate(doors)))


def test_an_answer_depends_on_the_person_and_the_profile_alone(doors):
    people = Perceivers(people=8)
    assert np.array_equal(people.rate(doors)[::-1], people.rate(doors[::-1]))
    assert np.array_equal(people.rate(doors[2:3])[0], people.rate(doors)[2])
    assert np.abs(people.rate(doors) - Perceivers(people=8, seed=2).rate(doors)).max() > 0.3


def test_nobody_of_them_is_in_a_simulated_study_and_both_groups_are():
    people = Perceivers(people=40)
    whom = [person.plan.who for person in people.persons]
    assert {who.participant for who in whom}.isdisjoint(f"P{n:03d}" for n in range(1000)) and len(set(whom)) == 40
    assert [sum(who.group == group for who in whom) for group in ("1", "2")] == [20, 20]


def test_the_mean_of_more_people_lies_nearer_to_what_is_felt(doors):
    few, many = (Perceivers(people=n) for n in (4, 100))
    felt = np.clip(few.felt(doors), -6, 6)
    inside = np.abs(few.felt(doors)) < 6
    off = [np.abs(p.rate(doors) - felt)[inside].mean() for p in (few, many)]
    assert off[1] < 0.5 * off[0] < 1.0


def test_what_cannot_rate_is_refused(doors):
    with pytest.raises(ModelDataError, match="0 people cannot rate"):
        Perceivers(people=0)
    with pytest.raises(ModelDataError, match="does not say how simulated people perceive"):
        Perceivers(study=door_ratings().model_copy(update={"simulation": None}))
    with pytest.raises(ModelDataError, match="621 numbers a row"):
        Perceivers(people=1).rate(doors[:, :620])
    broken = doors.copy()
    broken[1, 7] = np.nan
    with pytest.raises(ModelDataError, match="row 2 holds nan at place 8"):
        Perceivers(people=1).felt(broken)


def test_they_pickle_for_other_processes(doors):
    import pickle

    people = Perceivers(people=2)
    assert np.array_equal(pickle.loads(pickle.dumps(people)).rate(doors[:1]), people.rate(doors[:1]))
    assert dataclasses.replace(people, people=3) != people
