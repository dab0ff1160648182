"""The forward network learns, does so twice alike, runs without torch, and refuses what it cannot learn from."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from palpate.modeling.doors.forward_network import DELTA, LITERAL_SETTINGS, MLP, NETWORK, SETTINGS, fit_network, huber
from palpate.modeling.doors.networks import POINTS, ForceToPerception
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.training.refusals import TrainingError
from tests.modeling.doors.network_learning import (
    SEEN,
    UNSEEN,
    data_of,
    learning,
    of_the_mean,
    profiles,
    run_by_numpy,
)

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(scope="module")
def fitted():
    return NETWORK.fit(learning(epochs=6))


def tiny(_attributes):
    return nn.Linear(POINTS, 7)


def huber_of(off):
    return np.where(np.abs(off) <= DELTA, off**2 / 2, DELTA * (np.abs(off) - DELTA / 2)).mean()


def weights(fitted):
    return torch.cat([value.reshape(-1) for value in fitted.network.state_dict().values()])


def test_training_is_that_of_the_thesis():
    assert (SETTINGS.epochs, SETTINGS.batch, SETTINGS.least_rate, DELTA) == (200, 8, 1e-6, 2.0)
    assert SETTINGS.plateau_patience is not None
    assert NETWORK.holds_out


def test_a_few_steps_fall_below_the_loss_of_the_mean(fitted):
    assert isinstance(fitted.network[1], ForceToPerception)
    assert fitted.trained.best_loss < 0.7 * of_the_mean(learning(), huber_of)


def test_it_answers_for_profiles_that_it_never_saw(fitted):
    answer, data = fitted.predict(profiles(UNSEEN)), learning()
    rating = data.scaling.rating_up(data.held.rating)
    assert answer.shape == (8, 7)
    assert huber_of(answer - rating) == pytest.approx(fitted.trained.best_loss, rel=1e-4)


def test_the_answer_to_one_profile_is_that_within_a_batch(fitted):
    rows = profiles(UNSEEN)
    assert np.abs(fitted.predict(rows[3]) - fitted.predict(rows)[3]).max() < 1e-4


def test_numpy_alone_answers_the_same(fitted):
    rows = profiles(UNSEEN)
    assert np.abs(run_by_numpy(fitted.exported(), 621, 7).run(rows) - fitted.predict(rows)).max() < 1e-4


def test_the_same_seed_gives_the_same_bits_in_any_order_of_rows_and_another_seed_others():
    short = data_of(SEEN[:4])
    one, two = (NETWORK.fit(learning(data, epochs=1, batch=2)) for data in (short, short.rows(np.array([2, 0, 3, 1]))))
    assert torch.equal(weights(one), weights(two))
    other = NETWORK.fit(learning(short, seed=6, epochs=1, batch=2))
    assert not torch.equal(weights(one), weights(other))


def test_a_fitted_network_goes_to_another_process_and_back():
    fitted = fit_network(learning(epochs=1), tiny, SETTINGS)
    again = pickle.loads(pickle.dumps(fitted))
    assert np.array_equal(again.predict(profiles(UNSEEN)), fitted.predict(profiles(UNSEEN)))


def test_the_callers_wishes_and_quick_decide_how_long_it_trains():
    assert len(fit_network(learning(epochs=3), tiny, SETTINGS).trained.history) == 3
    assert len(fit_network(learning(quick=True), tiny, SETTINGS).trained.history) == 4
    with pytest.raises(TrainingError, match="epochs"):
        fit_network(learning(epochs=0), tiny, SETTINGS)


def test_early_stopping_watches_the_held_out_profiles_and_keeps_their_best_epoch():
    stopped = fit_network(learning(stop_patience=2), tiny, replace(SETTINGS, learning_rate=0.05)).trained
    assert stopped.stopped
    assert stopped.best_loss == min(epoch.held_loss for epoch in stopped.history)


def test_to_the_letter_it_trains_to_the_end_and_keeps_the_last_epoch():
    trained = fit_network(learning(epochs=20), tiny, replace(LITERAL_SETTINGS, learning_rate=2.0)).trained
    watched = [epoch.held_loss for epoch in trained.history]
    assert len(watched) == 20 == trained.best_epoch and min(watched) < watched[-1]


def test_without_held_out_profiles_it_trains_to_the_end_and_keeps_the_best_of_the_training_loss():
    nothing = data_of(SEEN).rows(np.array([], dtype=np.int64))
    trained = fit_network(learning(held=nothing, epochs=2), tiny, SETTINGS).trained
    assert [epoch.held_loss for epoch in trained.history] == [None, None]


def test_a_checkpoint_is_continued_to_the_same_bits(tmp_path):
    whole = fit_network(learning(epochs=8), tiny, SETTINGS)
    fit_network(learning(epochs=5, checkpoint=tmp_path), tiny, SETTINGS)
    continued = fit_network(learning(epochs=8, checkpoint=tmp_path), tiny, SETTINGS)
    assert continued.trained.continued_from == 5
    assert torch.equal(weights(continued), weights(whole))


def test_a_constant_profile_and_float16_get_a_finite_answer(fitted):
    constant = np.full((1, 621), 12.0)
    assert np.isfinite(fitted.predict(constant)).all()
    assert np.isfinite(fitted.predict(np.zeros(621))).all()
    half = profiles(UNSEEN[:1]).astype(np.float16)
    assert np.abs(fitted.predict(half) - fitted.predict(profiles(UNSEEN[:1]))).max() < 0.5


@pytest.mark.parametrize("points", [620, 622])
def test_profiles_of_another_length_are_refused(fitted, points):
    with pytest.raises(ModelDataError, match="621 numbers a row are expected"):
        fitted.predict(np.zeros((2, points)))


@pytest.mark.parametrize("value", [1e6, np.nan, np.inf])
def test_a_spike_or_a_missing_sample_is_refused_with_its_row(fitted, value):
    rows = profiles(UNSEEN[:2])
    rows[1, 300] = value
    with pytest.raises(ModelDataError, match="row 2 holds"):
        fitted.predict(rows)


@pytest.mark.parametrize("value", [1e6, np.nan])
@pytest.mark.parametrize("where", ["train", "held"])
def test_nothing_is_learned_from_data_with_a_spike_of_a_million_or_a_missing_sample(value, where):
    names = SEEN if where == "train" else UNSEEN
    rows = profiles(names)
    rows[2, 100] = value
    data = data_of(names, rows, data_of(names).rating)
    learned = replace(learning(epochs=1), **({"train": data, "measured": data} if where == "train" else {"held": data}))
    with pytest.raises(ModelDataError, match="force profiles: row"):
        fit_network(learned, tiny, SETTINGS)


def test_two_stimuli_are_enough_and_one_is_not():
    two = NETWORK.fit(learning(data_of(SEEN[:2]), epochs=1))
    assert torch.isfinite(weights(two)).all()
    with pytest.raises(ModelDataError, match="at least 2 are needed"):
        fit_network(replace(learning(epochs=1), train=data_of(SEEN[:1])), tiny, SETTINGS)


def test_profiles_that_are_all_equal_or_constant_train_without_a_number_that_is_none():
    flat = np.repeat(np.array([[10.0], [10.0], [20.0], [20.0]]), 621, axis=1)
    for rows in (flat, flat[[0, 0, 0, 0]]):
        data = data_of(SEEN[:4], rows, data_of(SEEN[:4]).rating)
        learned = replace(learning(epochs=2), train=data, measured=data)
        assert torch.isfinite(weights(fit_network(learned, tiny, SETTINGS))).all()


def test_ratings_that_are_all_equal_are_refused_with_the_scaling():
    with pytest.raises(ModelDataError, match="all ratings are"):
        learning(data_of(SEEN, rating=np.zeros((16, 7))))


def test_huber_is_the_mean_of_equation_5_4():
    off = np.array([[0.5, -3.0], [2.0, 10.0]])
    assert huber(torch.tensor(off), torch.zeros(2, 2)).item() == pytest.approx((0.125 + 4.0 + 2.0 + 18.0) / 4)


@pytest.fixture(scope="module")
def fitted_mlp():
    return MLP.fit(learning(epochs=60))


def test_its_layers_are_621_64_32_7(fitted_mlp):
    dense = [(layer.in_features, layer.out_features) for layer in fitted_mlp.network[1] if isinstance(layer, nn.Linear)]
    assert dense == [(621, 64), (64, 32), (32, 7)]


def test_it_falls_below_half_the_error_of_the_mean(fitted_mlp):
    data = learning()
    off = np.abs(fitted_mlp.predict(profiles(UNSEEN)) - data.scaling.rating_up(data.held.rating)).mean()
    assert off < 0.5 * of_the_mean(data, lambda off: np.abs(off).mean())


def test_two_fits_are_bit_equal():
    one, two = (MLP.fit(learning(epochs=3)).network.state_dict() for _ in range(2))
    assert all(torch.equal(one[name], two[name]) for name in one)
