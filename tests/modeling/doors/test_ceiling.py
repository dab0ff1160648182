"""The noise of mean ratings, recovered where it is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.modeling.doors.ceiling import noise_ceiling
from palpate.modeling.doors.data import Scaling
from palpate.modeling.doors.rated import Individual, Questions, Rated, StimulusProfile, rated_of
from palpate.modeling.evaluate.rows import ModelDataError
from tests.modeling.doors.data_for_tests import ANTONYMS, ATTRIBUTES, crossed

PLAIN = Scaling((0.0, 1.0), (0.0, 100.0))
"""Ratings as they are: 0..100."""


def known(stimuli=400, people=20, noise=4.0, bias=0.0, groups=2, seed=1, spread=10.0):
    """Truth of SD `spread`, each answer with `noise`, each person with `bias`; every group rates its own stimuli."""
    draw = np.random.default_rng(seed)
    data = crossed(groups, stimuli // groups)
    truth = draw.normal(50, spread, (stimuli, 7))
    value = np.full((people * groups, stimuli, 7), np.nan)
    for group in range(groups):
        own, here = (
            slice(people * group, people * (group + 1)),
            slice(stimuli // groups * group, stimuli // groups * (group + 1)),
        )
        answers = truth[here] + draw.normal(0, noise, (people, stimuli // groups, 7))
        value[own, here] = answers + draw.normal(0, bias or 1e-300, (people, 1, 7))
    who = tuple(f"P{n:03d}" for n in range(people * groups))
    individual = Individual(who, tuple(str(n // people) for n in range(people * groups)), value)
    return Rated(replace(data, rating=np.nanmean(value, axis=0)), individual), truth


def test_the_error_of_a_perfect_predictor_is_the_noise_of_the_mean():
    rated, truth = known()
    ceiling = noise_ceiling(rated, PLAIN, splits=100)
    error = rated.data.rating - truth
    assert ceiling.rmse[:7] == pytest.approx(np.full(7, 4 / np.sqrt(20)), rel=0.05)
    assert ceiling.rmse[7] == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.03)
    assert ceiling.mae[7] == pytest.approx(np.mean(np.abs(error)), rel=0.03)
    assert ceiling.r2[7] == pytest.approx(1 - np.mean(error**2) / np.var(rated.data.rating, axis=0).mean(), abs=0.002)


def test_reliability_is_the_share_of_variance_that_is_true():
    rated, _ = known(noise=20.0, spread=5.0)
    ceiling = noise_ceiling(rated, PLAIN, splits=100)
    assert ceiling.reliability[7] == pytest.approx(25 / (25 + 400 / 20), abs=0.04)
    assert ceiling.half_r[7] == pytest.approx(25 / (25 + 400 / 10), abs=0.05)
    assert ceiling.reliability == pytest.approx(2 * ceiling.half_r / (1 + ceiling.half_r))


def test_the_same_peoples_bias_is_noise_to_one_and_known_to_the_other():
    rated, _ = known(noise=2.0, bias=5.0, groups=1)
    other = noise_ceiling(rated, PLAIN, splits=400)
    same = noise_ceiling(rated, PLAIN, of="same_people", splits=100)
    assert same.rmse[7] == pytest.approx(2 / np.sqrt(20), rel=0.05)
    assert other.rmse[7] == pytest.approx(np.sqrt((25 + 4) / 20), rel=0.25)
    assert (same.r2 > other.r2).all()


def test_groups_of_odd_size_and_gaps_change_nothing_in_expectation():
    rated, truth = known(people=7)
    value = rated.individual.value.copy()
    value[0, :50] = np.nan
    gappy = Rated(replace(rated.data, rating=np.nanmean(value, axis=0)), replace(rated.individual, value=value))
    ceiling = noise_ceiling(gappy, PLAIN, splits=200)
    assert ceiling.rmse[7] == pytest.approx(np.sqrt(np.mean((gappy.data.rating - truth) ** 2)), rel=0.05)


def test_the_order_of_the_people_does_not_matter():
    rated, _ = known(stimuli=40)
    order = np.random.default_rng(2).permutation(40)
    one = rated.individual
    turned = Individual(tuple(one.people[i] for i in order), tuple(one.groups[i] for i in order), one.value[order])
    first, second = (noise_ceiling(ratings, PLAIN, splits=20) for ratings in (rated, Rated(rated.data, turned)))
    assert first.mae == pytest.approx(second.mae, rel=1e-12)


def test_the_rmse_is_what_the_sd_between_raters_says():
    """Over all halves the mean square of the halves' difference is 4 s^2 / n, with s^2 over n - 1."""
    rated, _ = known(stimuli=60, people=6, noise=3.0, bias=3.0)
    ceiling = noise_ceiling(rated, PLAIN, splits=2000)
    variance = np.nanvar(rated.individual.value, axis=0, ddof=1)
    assert ceiling.rmse[:7] == pytest.approx(np.sqrt(np.mean(variance / 6, axis=0)), rel=0.03)
    assert (noise_ceiling(rated, PLAIN, of="same_people", splits=50).mae < ceiling.mae).all()


def test_ratings_that_do_not_vary_have_no_r2_and_the_note_says_so():
    rated, _ = known(stimuli=20)
    value = rated.individual.value.copy()
    value[:, :, 2] = np.where(np.isnan(value[:, :, 2]), np.nan, 40.0)
    flat = Rated(replace(rated.data, rating=np.nanmean(value, axis=0)), replace(rated.individual, value=value))
    ceiling = noise_ceiling(flat, PLAIN, splits=10)
    assert np.isnan(ceiling.r2[2]) and np.isnan(ceiling.reliability[2]) and ceiling.rmse[2] == 0
    assert np.isfinite(np.delete(ceiling.r2, 2)).all()
    assert ceiling.note == "the means do not vary: no correlation and no R2 of Consistent"


def rated_by(people):
    """Two stimuli that these people rated."""
    rows = [(who, "1", name, word, value) for who in people for name in "AB" for value, word in enumerate(ATTRIBUTES)]
    table = pd.DataFrame(rows, columns=["participant", "group", "stimulus", "attribute", "value"])
    shown = [StimulusProfile(name, name, "g0", np.full(621, float(level))) for level, name in enumerate("AB")]
    return rated_of(shown, Questions(ATTRIBUTES, ANTONYMS, (-10, 10)), table, simulated=True, made_from=())


def test_one_rater_cannot_be_split():
    with pytest.raises(ModelDataError, match="group '1' has 1 rater: there is nothing to split"):
        noise_ceiling(rated_by(["P001"]))


def test_a_stimulus_with_one_rater_is_named():
    rated, _ = known(stimuli=20)
    value = rated.individual.value.copy()
    value[1:20, 3] = np.nan
    with pytest.raises(ModelDataError, match=r"stimulus 'D0_g3#3' has 1 rater"):
        noise_ceiling(Rated(rated.data, replace(rated.individual, value=value)), PLAIN)


def test_a_person_who_skipped_an_attribute_is_no_hindrance():
    rated, _ = known(stimuli=20)
    value = rated.individual.value.copy()
    value[3, :, 2] = np.nan
    gappy = Rated(rated.data, replace(rated.individual, value=value))
    assert np.isfinite(noise_ceiling(gappy, PLAIN, of="same_people", splits=10).mae).all()


def test_an_unknown_question_is_refused():
    with pytest.raises(ModelDataError, match="one of other_people, same_people"):
        noise_ceiling(rated_by(["P001", "P002"]), of="everybody")


def test_a_level_that_was_estimated_from_few_answers_takes_no_noise_away():
    rated, _ = known(stimuli=6, noise=2.0, bias=5.0, groups=1)
    errors = [noise_ceiling(ratings, PLAIN, of="same_people", splits=200).rmse[7] for ratings in (rated, *again(5))]
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(2 / np.sqrt(20), rel=0.04)


def again(times):
    """Other people, of the same kind."""
    return [known(stimuli=6, noise=2.0, bias=5.0, groups=1, seed=seed)[0] for seed in range(2, 2 + times)]


def answered(people):
    """Seven stimuli, and for each person what they answer to a stimulus."""
    rows = [
        (who, "1", name, "X", answer(place)) for who, answer in people.items() for place, name in enumerate("ABCDEFG")
    ]
    table = pd.DataFrame(rows, columns=["participant", "group", "stimulus", "attribute", "value"])
    shown = [StimulusProfile(name, name, "g0", np.full(621, float(level))) for level, name in enumerate("ABCDEFG")]
    return rated_of(shown, Questions(("X",), ("Y",), (-10, 10)), table, simulated=True, made_from=())


@pytest.mark.parametrize("of", ["other_people", "same_people"])
def test_means_that_differ_by_rounding_only_do_not_vary(of):
    rated = answered({"P1": lambda _: 0.1, "P2": lambda _: 0.3, "P3": lambda _: 0.7})
    ceiling = noise_ceiling(rated, PLAIN, of=of, splits=20)
    assert np.isnan(ceiling.r2).all() and np.isnan(ceiling.half_r).all()
    assert ceiling.note == "the means do not vary: no correlation and no R2 of X, overall"


def test_a_person_who_always_answers_the_same_leaves_no_correlation_and_the_note_says_so():
    ceiling = noise_ceiling(answered({"P1": lambda _: 2.0, "P2": float}), PLAIN, splits=20)
    assert np.isnan(ceiling.half_r).all() and np.isfinite(ceiling.r2).all()
    assert ceiling.note == "a half's means do not vary: no correlation of X, overall"


def test_a_person_with_one_answer_has_no_level():
    rated, _ = known(stimuli=20)
    value = rated.individual.value.copy()
    value[0, 1:] = np.nan
    gappy = Rated(rated.data, replace(rated.individual, value=value))
    without = Rated(
        rated.data, replace(rated.individual, value=np.where(np.arange(40)[:, None, None] == 0, np.nan, value))
    )
    first, second = (noise_ceiling(ratings, PLAIN, of="same_people", splits=10) for ratings in (gappy, without))
    assert first.mae == pytest.approx(second.mae)
