"""The inverse network learns with the forward network's decoder, leaves it as it is, and makes playable profiles."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from palpate.modeling.doors.forward_network import MLP, NETWORK
from palpate.modeling.doors.inverse_network import INVERSE_NETWORK, SETTINGS, fit
from palpate.modeling.doors.networks import PerceptionToForce
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG, refusal
from tests.modeling.doors.network_learning import SEEN, data_of, learning, run_by_numpy

pytestmark = pytest.mark.needs("torch")

FEW = data_of(SEEN[:6])
CORNERS = np.array([[0.0] * 7, [100.0] * 7, [0.0, 100.0] * 3 + [0.0], [100.0, 0.0] * 3 + [100.0]])


@pytest.fixture(scope="module")
def forward():
    return NETWORK.fit(learning(FEW, epochs=1))


@pytest.fixture(scope="module")
def fitted(forward):
    """Four steps, four times as long as the thesis' so that they show."""
    return fit(learning(FEW, epochs=4, forward=forward), replace(SETTINGS, learning_rate=4e-4))


def test_training_is_that_of_the_thesis():
    assert (SETTINGS.learning_rate, SETTINGS.batch) == (1e-4, 8)
    assert SETTINGS.plateau_patience is None
    assert SETTINGS.stop_patience is not None
    assert INVERSE_NETWORK.holds_out
    assert INVERSE_NETWORK.needs_forward == "network"


def test_a_few_steps_fall_below_the_error_of_the_mean_profile(fitted):
    generated = fitted.predict(learning(FEW).scaling.rating_up(FEW.rating))
    of_the_mean = np.mean((FEW.force_N - FEW.force_N.mean(axis=0)) ** 2)
    assert np.mean((generated - FEW.force_N) ** 2) < 0.7 * of_the_mean


def test_the_decoder_is_that_of_the_forward_network_after_training_too(fitted, forward):
    inner = fitted.network[1]
    assert isinstance(inner, PerceptionToForce)
    mine, theirs = inner.decoder.state_dict(), forward.network[1].decoder.state_dict()
    assert all(torch.equal(mine[name], theirs[name]) for name in theirs)


def test_two_fits_are_bit_equal(forward):
    two = data_of(SEEN[:2])
    one, other = (
        INVERSE_NETWORK.fit(learning(two, two, epochs=1, forward=forward)).network.state_dict() for _ in range(2)
    )
    assert all(torch.equal(one[name], other[name]) for name in one)


def test_it_starts_with_the_latents_that_the_frozen_decoder_was_trained_on(forward, monkeypatch):
    monkeypatch.setattr("palpate.modeling.doors.inverse_network.train", lambda *_args, **_kwargs: None)
    felt = forward.network
    inverse = INVERSE_NETWORK.fit(learning(FEW, forward=forward)).network
    with torch.no_grad():
        known = felt[1].encoder(felt[0](torch.from_numpy(FEW.force_N).float()).unsqueeze(1)).flatten(1)
        wishes = torch.from_numpy(learning(FEW).scaling.rating_up(FEW.rating)).float()
        mine = inverse[1].project(inverse[1].encoder(inverse[0](wishes).unsqueeze(1)))
    assert torch.allclose(mine.mean(dim=0), known.mean(dim=0), atol=1e-4)
    spread = [(latent - latent.mean(dim=0)).pow(2).mean().sqrt().item() for latent in (mine, known)]
    assert spread[0] == pytest.approx(spread[1], rel=1e-3)


def test_numpy_alone_makes_the_same_profiles(fitted):
    wishes = np.vstack([np.random.default_rng(3).uniform(0, 100, (3, 7)), CORNERS])
    low, high = fitted.scaling.force_N
    off = np.abs(run_by_numpy(fitted.exported(), 7, 621).run(wishes) - fitted.predict(wishes)).max()
    assert off / (high - low) * 100 < 1e-4


def test_every_profile_is_within_what_may_be_played(fitted):
    generated = fitted.predict(CORNERS)
    assert generated.shape == (4, 621)
    assert np.abs(generated).max() <= LIMIT_N
    assert np.abs(np.diff(generated)).max() * 10 <= STEEPEST_N_DEG * (1 + 1e-12)
    assert [refusal(force) for force in generated] == [None] * 4


@pytest.mark.parametrize("wish", [np.zeros(6), np.full(7, np.nan), np.full(7, 1e6), np.zeros((2, 8))])
def test_ratings_that_are_none_are_refused(fitted, wish):
    with pytest.raises(ModelDataError, match="ratings"):
        fitted.predict(wish)


def test_it_needs_a_trained_forward_network():
    for other in (None, MLP.fit(learning(FEW, epochs=1))):
        with pytest.raises(ModelDataError, match="decoder of a trained forward network"):
            INVERSE_NETWORK.fit(learning(FEW, epochs=1, forward=other))


def test_a_study_with_other_than_seven_attributes_is_refused(forward):
    six = replace(FEW, attributes=FEW.attributes[:6], rating=FEW.rating[:, :6])
    learned = replace(learning(FEW, epochs=1, forward=forward), train=six, measured=six, held=six)
    with pytest.raises(ModelDataError, match="takes 7 ratings, this study has 6"):
        INVERSE_NETWORK.fit(learned)
