"""ResNet-50: torchvision's names, shapes and numbers; folding changes nothing; the pool of patches is its mean."""

import hashlib
import json

import numpy as np
import pytest
import torch

from palpate.modeling.attributes.resnet import (
    ResNet50,
    colours,
    fold_batch_norms,
    load_network,
    pool_of_patches,
    random_state,
)
from palpate.modeling.training.threads import limited
from tests.modeling.attributes.weights_for_tests import drawn_input, drawn_state

pytestmark = pytest.mark.needs("torch")

TORCHVISION_NAMES = "218340f9d3037deac0e029064817e2434f9a638034693f6134277670d9fbfddf"
"""SHA-256 of JSON [[name, shape], ...] of torchvision 0.28.0's resnet50().state_dict(), in its order."""
TORCHVISION_POOL = {0: 15.51968765, 1: 41.56267548, 2: 5.98933601, 1000: 1.67821562, 2047: 57.76678467}
TORCHVISION_MEAN, TORCHVISION_SCORES = 34.43964005, [119.47966003, -98.81252289, 22.59855843]
"""What torchvision 0.28.0's resnet50, in evaluation, makes of `drawn_input()` with `drawn_state()`."""


@pytest.fixture(autouse=True)
def one_thread():
    """As in a job: rounding depends on how work is shared out."""
    with limited(1):
        yield


@pytest.fixture(scope="module")
def state():
    return drawn_state()


def test_names_and_shapes_are_torchvision_s():
    state_dict = ResNet50().state_dict()
    shapes = json.dumps([[name, list(tensor.shape)] for name, tensor in state_dict.items()])
    assert len(state_dict) == 320
    assert hashlib.sha256(shapes.encode()).hexdigest() == TORCHVISION_NAMES
    assert sum(parameter.numel() for parameter in ResNet50().parameters()) == 25_557_032
    assert state_dict["conv1.weight"].shape == (64, 3, 7, 7) and state_dict["fc.weight"].shape == (1000, 2048)
    assert state_dict["layer4.0.downsample.0.weight"].shape == (2048, 1024, 1, 1)


def test_numbers_are_torchvision_s(state):
    network = load_network(state)
    with torch.inference_mode():
        pool, scores = network.pooled(drawn_input())[0], network(drawn_input())[0]
    assert pool.shape == (2048,)
    np.testing.assert_allclose(pool[list(TORCHVISION_POOL)], list(TORCHVISION_POOL.values()), rtol=1e-4, atol=1e-3)
    assert float(pool.mean()) == pytest.approx(TORCHVISION_MEAN, rel=1e-5)
    np.testing.assert_allclose(scores[[0, 1, 999]], TORCHVISION_SCORES, rtol=1e-4, atol=1e-3)
    assert int(scores.argmax()) == 137


def test_folding_changes_nothing_that_32_bits_hold(state):
    with torch.inference_mode():
        exact = load_network(state).double().pooled(drawn_input(2).double()).numpy()
        plain = load_network(state).pooled(drawn_input(2)).numpy()
        quick = fold_batch_norms(load_network({name: tensor.clone() for name, tensor in state.items()}))
        pooled = quick.pooled(drawn_input(2)).numpy()
    assert not [name for name, _ in quick.named_buffers()]
    largest = np.abs(exact).max()
    assert np.abs(plain - exact).max() < 2e-6 * largest
    assert np.abs(pooled - exact).max() < 2e-6 * largest


def test_random_weights_are_decided_by_the_seed_and_of_he_s_size():
    one, again, other = random_state(1), random_state(1), random_state(2)
    torch.manual_seed(5)
    before = torch.rand(1)
    torch.manual_seed(5)
    random_state(1)
    assert torch.rand(1) == before
    assert all(torch.equal(one[name], again[name]) for name in one)
    assert not torch.equal(one["layer3.2.conv2.weight"], other["layer3.2.conv2.weight"])
    assert float(one["layer3.2.conv2.weight"].std()) == pytest.approx(np.sqrt(2 / (256 * 9)), rel=0.01)
    assert float(one["conv1.weight"].std()) == pytest.approx(np.sqrt(2 / (64 * 49)), rel=0.03)


def test_brightness_becomes_three_colours_as_imagenet_normalises_them():
    coloured = colours(np.array([[[0.0, 1.0]]], "f4"))
    assert coloured.shape == (1, 3, 1, 2)
    np.testing.assert_allclose(coloured[0, :, 0, 0], [-0.485 / 0.229, -0.456 / 0.224, -0.406 / 0.225], rtol=1e-6)
    np.testing.assert_allclose(coloured[0, :, 0, 1], [0.515 / 0.229, 0.544 / 0.224, 0.594 / 0.225], rtol=1e-6)


def test_the_pool_of_patches_is_the_mean_over_each_of_them(state):
    network = load_network(state)
    given = np.random.default_rng(0).random((8, 32, 32), dtype="f4")
    pools = np.stack([pool_of_patches(network, one[None]) for one in given])
    pool = pool_of_patches(network, given)
    assert pool.shape == (2048,) and pool.dtype == np.float32
    np.testing.assert_allclose(pool, pools.mean(axis=0), rtol=1e-4, atol=1e-3)
    np.testing.assert_array_equal(pool, pool_of_patches(network, given))


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_black_and_white_patches_have_finite_features_of_random_weights(level):
    network = fold_batch_norms(load_network(random_state(0)))
    pool = pool_of_patches(network, np.full((1, 224, 224), level, "f4"))
    assert np.isfinite(pool).all() and pool.min() >= 0 and pool.max() > 0
