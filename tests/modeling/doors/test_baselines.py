"""What holds for every plain method of either direction."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from palpate.modeling.doors.data import Scaling, scaling_of
from palpate.modeling.doors.forest import FOREST
from palpate.modeling.doors.linear import PCA_REGRESSION, PCA_RIDGE
from palpate.modeling.doors.methods import Learning
from palpate.modeling.doors.nearest import NEAREST
from palpate.modeling.evaluate.rows import ModelDataError
from tests.modeling.doors.baseline_learning import (
    CHOOSING,
    FORWARD,
    INVERSE,
    ON_FEATURES,
    SEEN,
    data_of,
    fitted_to_all,
    learn,
    profiles,
    shuffled,
    through_a_file,
    unseen_rows,
)

ALL = (*FORWARD, *INVERSE)
every = pytest.mark.parametrize("method", ALL, ids=lambda method: method.name)
forward = pytest.mark.parametrize("method", FORWARD, ids=lambda method: method.name)
inverse = pytest.mark.parametrize("method", INVERSE, ids=lambda method: method.name)


def with_profile(row, force_N):
    """The sixteen stimuli, one of them with another profile."""
    data = data_of(SEEN)
    changed = data.force_N.copy()
    changed[row] = force_N
    return replace(data, force_N=changed)


@every
def test_what_is_exported_answers_as_the_fitted_model_does(method, tmp_path):
    fitted, given = fitted_to_all(method), unseen_rows(method)
    expected = fitted.predict(given)
    model = through_a_file(fitted.exported(), tmp_path, given.shape[1], expected.shape[1])
    assert np.abs(model.run(given) - expected).max() < 1e-9
    assert np.abs(model.run(given[0]) - expected[0]).max() < 1e-9


@every
def test_a_fitted_model_travels_between_processes(method):
    fitted = fitted_to_all(method)
    copy = pickle.loads(pickle.dumps(fitted))
    assert np.array_equal(copy.predict(unseen_rows(method)), fitted.predict(unseen_rows(method)))


@every
def test_the_order_of_rows_changes_nothing(method):
    first = learn()
    again = replace(first, measured=shuffled(first.measured), train=shuffled(first.train))
    assert np.array_equal(
        fitted_to_all(method).predict(unseen_rows(method)), method.fit(again).predict(unseen_rows(method))
    )


@every
def test_the_names_of_the_stimuli_teach_nothing(method):
    data = data_of(SEEN)
    renamed = replace(data, doors=("D",) * len(data), variants=("g9",) * len(data), groups=("B",) * len(data))
    other = replace(learn(data), measured=renamed)
    assert np.array_equal(
        fitted_to_all(method).predict(unseen_rows(method)), method.fit(other).predict(unseen_rows(method))
    )


@pytest.mark.parametrize("method", [*ON_FEATURES, PCA_RIDGE], ids=lambda method: method.name)
def test_a_rule_that_people_follow_is_learned(method):
    given, unseen = learn(), data_of(tuple(f"{door}_g7" for door in ("BC3", "FORD", "G90", "K3")))
    truth = given.scaling.rating_up(unseen.rating)
    mean = fitted_to_all(FORWARD[0]).predict(unseen.force_N)
    error, of_the_mean = (np.abs(p - truth).mean() for p in (fitted_to_all(method).predict(unseen.force_N), mean))
    assert error < 0.5 * of_the_mean


@forward
def test_a_copy_of_an_attribute_gets_the_same_answers(method):
    data = data_of(SEEN)
    doubled = replace(data, rating=np.c_[data.rating[:, :6], data.rating[:, 0]])
    # without training variants: they move a rating by its attribute's name, so a copy would be one no more
    answers = method.fit(replace(learn(doubled), train=doubled)).predict(unseen_rows(method))
    assert np.abs(answers[:, 6] - answers[:, 0]).max() < 1e-9


@pytest.mark.parametrize("method", [one for one in FORWARD if one is not FOREST], ids=lambda method: method.name)
def test_attributes_that_are_all_there_twice_change_no_answer(method):
    # not the forest: where two features divide the stimuli alike, rounding decides which of them is used
    data = data_of(SEEN)
    twice = replace(data, attributes=data.attributes * 2, rating=np.tile(data.rating, 2))
    single = method.fit(replace(learn(data), train=data)).predict(unseen_rows(method))
    answers = method.fit(replace(learn(data), measured=twice, train=twice)).predict(unseen_rows(method))
    assert answers == pytest.approx(np.tile(single, 2), abs=1e-6)


def test_wishes_that_are_all_there_twice_find_the_same_profile():
    data = data_of(SEEN)
    twice = replace(data, attributes=data.attributes * 2, rating=np.tile(data.rating, 2))
    profiles_of_twice = NEAREST.fit(replace(learn(data), measured=twice)).predict(np.tile(unseen_rows(NEAREST), 2))
    assert np.array_equal(profiles_of_twice, NEAREST.fit(learn(data)).predict(unseen_rows(NEAREST)))


def test_a_copy_of_an_attribute_shares_its_weight_in_the_profile():
    data = data_of(SEEN)
    doubled = replace(data, rating=np.c_[data.rating[:, :6], data.rating[:, 0]])
    weight = PCA_REGRESSION.fit(learn(doubled)).linear.weight
    assert np.abs(weight[:, 6] - weight[:, 0]).max() < 1e-9


@pytest.mark.parametrize("method", [FORWARD[0], PCA_RIDGE, *INVERSE], ids=lambda method: method.name)
def test_the_unit_of_force_does_not_matter(method):
    # forces so small that neither limit of a made profile is met
    data, unit = replace(data_of(SEEN), force_N=data_of(SEEN).force_N / 8), 0.5
    other = replace(data, force_N=data.force_N * unit)
    given, into = unseen_rows(method), method in FORWARD
    first = method.fit(replace(learn(data), train=data, scaling=scaling_of(data))).predict(given)
    scaled = method.fit(replace(learn(other), train=other, scaling=scaling_of(other)))
    again = scaled.predict(given * unit) if into else scaled.predict(given) / unit
    assert again == pytest.approx(first, abs=1e-8)


@every
def test_two_stimuli_are_enough_or_are_refused(method):
    answers = method.fit(learn(data_of(SEEN[:2]))).predict(unseen_rows(method))
    assert np.isfinite(answers).all()


@pytest.mark.parametrize("method", CHOOSING, ids=lambda method: method.name)
def test_one_source_is_refused_where_a_penalty_is_chosen(method):
    data = replace(data_of(SEEN[:3]), source=("BC3",) * 3)
    with pytest.raises(ModelDataError, match="come from one source"):
        method.fit(learn(data))


@pytest.mark.parametrize("method", [*ON_FEATURES, PCA_RIDGE, PCA_REGRESSION], ids=lambda method: method.name)
def test_one_stimulus_is_refused(method):
    given = learn(data_of(SEEN[:1]))
    with pytest.raises(ModelDataError, match="1 stimuli; at least 2 are needed"):
        method.fit(replace(given, train=given.measured))


@forward
def test_ratings_that_are_all_equal_are_answered_with(method):
    data = data_of(SEEN)
    flat = replace(data, rating=np.full_like(data.rating, 12.0))
    answers = method.fit(replace(learn(flat), train=flat)).predict(unseen_rows(method))
    assert answers == pytest.approx(Scaling((0, 1), learn().scaling.rating).rating_up(np.full_like(answers, 12.0)))


@inverse
def test_wishes_get_a_finite_profile_where_all_ratings_are_equal(method):
    data = data_of(SEEN)
    flat = replace(data, rating=np.full_like(data.rating, 12.0))
    assert np.isfinite(method.fit(learn(flat)).predict(unseen_rows(method))).all()


@every
def test_profiles_that_are_all_equal_teach_the_mean(method):
    data = data_of(SEEN)
    same = replace(data, force_N=np.tile(data.force_N[:1], (len(data), 1)))
    given = replace(learn(same), train=same)
    if method in CHOOSING:
        with pytest.raises(ModelDataError, match="come from one source"):
            method.fit(given)
        return
    answers = method.fit(given).predict(unseen_rows(method))
    expected = given.scaling.rating_up(data.rating).mean(axis=0) if method in FORWARD else same.force_N[0]
    # a tree grows on stimuli drawn with replacement, whose mean is near the mean
    assert answers == pytest.approx(np.tile(expected, (len(answers), 1)), abs=2.0 if method is FOREST else 1e-6)


@every
def test_a_constant_profile_may_be_learned_and_predicted(method):
    fitted = method.fit(learn(with_profile(0, np.full(621, 12.0))))
    answers = fitted.predict(np.full((1, 621), 20.0) if method in FORWARD else unseen_rows(method))
    assert np.isfinite(answers).all()


@every
@pytest.mark.parametrize("offset", [500.0, -500.0])
def test_a_huge_offset_stays_finite(method, offset):
    data = data_of(SEEN)
    moved = replace(data, force_N=data.force_N + offset)
    fitted = method.fit(learn(moved))
    answers = fitted.predict(unseen_rows(method) + offset if method in FORWARD else unseen_rows(method))
    assert np.isfinite(answers).all()


@every
def test_a_spike_in_training_is_refused_with_its_place(method):
    spiked = profiles(SEEN[:1])[0]
    spiked[123] = 1e6
    given: Learning = replace(learn(), measured=with_profile(5, spiked), train=with_profile(5, spiked))
    with pytest.raises(ModelDataError, match=r"row 6 holds 1e\+06 N at 12.3 deg"):
        method.fit(given)


@forward
def test_a_spike_in_a_request_is_refused(method):
    spiked = profiles(SEEN[:2])
    spiked[1, 300] = -1e6
    with pytest.raises(ModelDataError, match=r"row 2 holds -1e\+06 N at 30 deg"):
        fitted_to_all(method).predict(spiked)


@inverse
def test_a_wish_far_off_the_scale_is_refused(method):
    with pytest.raises(ModelDataError, match="row 1 holds 1e.06 at place 3"):
        fitted_to_all(method).predict(np.array([[50, 50, 1e6, 50, 50, 50, 50]]))


@every
def test_nan_in_training_is_refused(method):
    gap = np.where(np.arange(621) == 7, np.nan, 10.0)
    with pytest.raises(ModelDataError, match="row 3 holds nan at place 8"):
        method.fit(replace(learn(), measured=with_profile(2, gap), train=with_profile(2, gap)))
    rating = data_of(SEEN).rating.copy()
    rating[4, 1] = np.inf
    unrated = replace(data_of(SEEN), rating=rating)
    with pytest.raises(ModelDataError, match="row 5 holds inf at place 2"):
        method.fit(replace(learn(), measured=unrated, train=unrated))


@every
def test_what_is_not_a_number_or_too_short_or_long_is_not_answered(method):
    fitted, size = fitted_to_all(method), unseen_rows(method).shape[1]
    for wrong in (np.full((1, size), np.nan), np.zeros((1, size - 1)), np.zeros((1, size + 1)), np.zeros((0, size))):
        with pytest.raises(ModelDataError):
            fitted.predict(wrong)


@pytest.mark.long
@every
def test_float16_is_answered_as_the_numbers_it_holds(method):
    fitted, coarse = fitted_to_all(method), unseen_rows(method).astype(np.float16)
    assert np.array_equal(fitted.predict(coarse), fitted.predict(coarse.astype(np.float64)))
    data = data_of(SEEN)
    stored = replace(data, force_N=data.force_N.astype(np.float16), rating=data.rating.astype(np.float16))
    again = method.fit(replace(learn(), measured=stored, train=stored)).predict(coarse)
    assert again.dtype == np.float64
    assert np.isfinite(again).all()


def test_what_is_learned_from_is_a_setting():
    given = learn()
    as_rated = PCA_RIDGE.fit(replace(given, settings={"learn_from": "measured"}))
    assert np.array_equal(as_rated.weight, PCA_RIDGE.fit(replace(given, train=given.measured)).weight)
    assert not np.array_equal(as_rated.weight, PCA_RIDGE.fit(given).weight)
    with pytest.raises(ModelDataError, match="expected one of measured, train"):
        PCA_RIDGE.fit(replace(given, settings={"learn_from": "all"}))


@every
def test_the_number_of_threads_changes_no_bit(method):
    given, answers = learn(), []
    for threads in (1, 2):
        with threadpool_limits(threads, user_api="blas"):
            answers.append(method.fit(given).predict(unseen_rows(method)))
    assert np.array_equal(*answers)
