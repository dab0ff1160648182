"""The search finds profiles that the forward network feels as wished, that stay near the measured ones, every time."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from palpate.modeling.doors.forward_network import MLP
from palpate.modeling.doors.gradient_search import RATING_SD, SEARCH, codes_of
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG, refusal
from tests.modeling.doors.network_learning import SEEN, data_of, learning, profiles

pytestmark = pytest.mark.needs("torch")

CORNERS = np.array([[0.0] * 7, [100.0] * 7, [0.0, 100.0] * 3 + [0.0], [100.0, 0.0] * 3 + [100.0]])


@pytest.fixture(scope="module")
def forward():
    """The dense network: the search asks for gradients only, and this one gives them in no time."""
    return MLP.fit(learning(epochs=60))


@pytest.fixture(scope="module")
def fitted(forward):
    return SEARCH.fit(learning(forward=forward))


def wishes(forward):
    """What the forward network says of profiles between the measured ones: they can be met."""
    rows = profiles(SEEN)
    return forward.predict((rows[:6] + rows[6:12]) / 2)


def cost(fitted, force_N, wish):
    off = (fitted.network(torch.from_numpy(force_N).float()).detach().numpy() - wish) / RATING_SD
    return ((off**2).sum(axis=1) + (fitted.codes.of(force_N) ** 2).sum(axis=1)) / 2


def test_wishes_that_are_possible_are_fulfilled(fitted, forward):
    wish = wishes(forward)
    off = np.abs(forward.predict(fitted.predict(wish)) - wish)
    assert off.mean() < 1.0
    assert off.mean() < 0.3 * np.abs(forward.predict(profiles(SEEN)).mean(axis=0) - wish).mean()


def test_what_is_found_costs_less_than_every_rated_profile(fitted, forward):
    wish = wishes(forward)
    rated = np.array([cost(fitted, profiles(SEEN), one).min() for one in wish])
    assert (cost(fitted, fitted.predict(wish), wish) < rated).all()


def test_impossible_wishes_give_playable_profiles_no_farther_out_than_the_measured_ones(fitted):
    generated = fitted.predict(CORNERS)
    assert [refusal(force) for force in generated] == [None] * 4
    assert np.abs(generated).max() <= LIMIT_N
    assert np.abs(np.diff(generated)).max() * 10 <= STEEPEST_N_DEG * (1 + 1e-12)
    farthest = np.linalg.norm(fitted.codes.of(profiles(SEEN)), axis=1).max()
    assert (
        np.linalg.norm(fitted.codes.of(generated), axis=1).max() <= 1.25 * farthest
    )  # a limited slope moves it a little


def test_it_is_decided_by_the_seed_and_not_by_the_order_of_wishes_or_rows(fitted, forward):
    wish = wishes(forward)
    assert np.array_equal(SEARCH.fit(learning(forward=forward)).predict(wish), fitted.predict(wish))
    assert np.abs(fitted.predict(wish[::-1])[::-1] - fitted.predict(wish)).max() < 1e-2
    turned = data_of(SEEN).rows(np.arange(len(SEEN))[::-1])
    other = SEARCH.fit(replace(learning(forward=forward), train=turned, measured=turned))
    assert np.array_equal(other.predict(wish), fitted.predict(wish))


def test_codes_are_uncorrelated_with_an_sd_of_one_and_lead_back():
    rows = profiles(SEEN)
    codes = codes_of(rows)
    coded = codes.of(rows)
    assert np.allclose(coded.T @ coded / len(rows), np.eye(coded.shape[1]), atol=1e-8)
    assert np.abs(codes.decoded(coded) - rows).max() < 1e-6


def test_searching_leaves_torch_and_the_network_as_they_were(fitted, forward):
    threads, weights = torch.get_num_threads(), [value.clone() for value in forward.network.state_dict().values()]
    fitted.predict(CORNERS[:1])
    assert torch.get_num_threads() == threads
    assert all(torch.equal(*pair) for pair in zip(weights, forward.network.state_dict().values(), strict=True))
    assert all(value.grad is None for value in forward.network.parameters())


def test_it_cannot_be_exported_and_says_what_can(fitted):
    with pytest.raises(ModelDataError, match="needs torch whenever it makes a profile"):
        fitted.exported()


@pytest.mark.parametrize("wish", [np.zeros(6), np.full(7, np.nan), np.full(7, 1e6)])
def test_ratings_that_are_none_are_refused(fitted, wish):
    with pytest.raises(ModelDataError, match="ratings"):
        fitted.predict(wish)


def test_it_needs_a_forward_network_and_profiles_that_differ(forward):
    with pytest.raises(ModelDataError, match="gradient of a trained forward network"):
        SEARCH.fit(learning())
    same = data_of(SEEN[:3], np.ones((3, 621)), data_of(SEEN[:3]).rating)
    with pytest.raises(ModelDataError, match="no directions"):
        SEARCH.fit(replace(learning(forward=forward), measured=same))


def test_two_profiles_are_enough(forward):
    two = data_of(SEEN[:2])
    generated = SEARCH.fit(replace(learning(forward=forward), measured=two)).predict(CORNERS[:2])
    assert np.isfinite(generated).all()
