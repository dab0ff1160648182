"""The small dense network learns, runs without torch, and has the layers that it says."""

import numpy as np
import pytest
import torch
from torch import nn

from palpate.modeling.doors.mlp import MLP
from tests.modeling.doors.network_learning import UNSEEN, learning, of_the_mean, profiles, run_by_numpy

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(scope="module")
def fitted():
    return MLP.fit(learning(epochs=60))


def test_its_layers_are_621_64_32_7(fitted):
    dense = [(layer.in_features, layer.out_features) for layer in fitted.network[1] if isinstance(layer, nn.Linear)]
    assert dense == [(621, 64), (64, 32), (32, 7)]


def test_it_falls_below_half_the_error_of_the_mean(fitted):
    wanted = learning()
    off = np.abs(fitted.predict(profiles(UNSEEN)) - wanted.scaling.rating_up(wanted.held.rating)).mean()
    assert off < 0.5 * of_the_mean(wanted, lambda off: np.abs(off).mean())


def test_numpy_alone_answers_the_same(fitted):
    rows = profiles(UNSEEN)
    assert np.abs(run_by_numpy(fitted.exported(), 621, 7).run(rows) - fitted.predict(rows)).max() < 1e-4


def test_two_fits_are_bit_equal():
    one, two = (MLP.fit(learning(epochs=3)).network.state_dict() for _ in range(2))
    assert all(torch.equal(one[name], two[name]) for name in one)
