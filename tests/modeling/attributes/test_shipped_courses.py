"""What a method is trained with by default: the numbers of docs/reference/attribute-models.md.

They are taken where a training begins, on features as wide as real ones: nothing between a constant and the trainer
can change one unseen.
"""

import numpy as np
import pytest
import torch

from palpate.modeling.attributes import network_training, row_networks, tactile_svm, whole_textures
from palpate.modeling.attributes.methods import Learning
from palpate.modeling.attributes.registry import METHODS, OWN_FEATURES
from palpate.modeling.training.loop import adam
from palpate.modeling.training.optimisers import share_of
from tests.modeling.attributes.material_for_tests import PAIRS, simulated_material

pytestmark = pytest.mark.needs("torch")

TEXTURES = 6
OURS = ("visuo_tactile", "hv_net", "ht_net")


class TrainingStarted(Exception):
    """A training that ends where it begins."""


@pytest.fixture
def start_training(monkeypatch):
    """What a method's training starts with: network, data, held, settings, optimiser of the first of its weights."""
    textures = simulated_material(textures=TEXTURES + 1, segments=6, pictures=2).textures
    arguments = {}

    def train(network, data, held, _loss, settings, *, optimiser=adam, **_others):
        first_optimiser = optimiser(list(network.parameters())[:1], settings.learning_rate)
        arguments.update(network=network, data=data, held=held, settings=settings, optimiser=first_optimiser)
        raise TrainingStarted

    def of(name, **options):
        watched = textures[TEXTURES:] if METHODS[name].holds(options) else ()
        touch, sight = OWN_FEATURES[name]
        given = Learning(textures[:TEXTURES], watched, PAIRS, touch=touch, sight=sight, settings=options)
        with pytest.raises(TrainingStarted):
            METHODS[name].fit(given)
        return dict(arguments)

    for place in (network_training, row_networks):
        monkeypatch.setattr(place, "train", train)
    return of


@pytest.mark.parametrize("name", OURS)
def test_the_thesis_network_and_its_halves_have_thirty_epochs_to_the_end(start_training, name):
    started = start_training(name)
    settings, optimiser = started["settings"], started["optimiser"]
    assert (settings.epochs, settings.batch, settings.learning_rate) == (30, 2, 0.0005)
    assert (started["held"], settings.keep_last, settings.plateau_patience) == (None, True, None)
    assert isinstance(optimiser, torch.optim.Adam)
    assert optimiser.steps == 30 * TEXTURES // 2
    assert start_training(name, quick=True)["settings"].epochs == 2


@pytest.mark.parametrize("name", OURS)
def test_with_early_stopping_the_thesis_patience_ends_it(start_training, name):
    started = start_training(name, early_stopping=True)
    settings = started["settings"]
    assert (settings.epochs, settings.stop_patience, settings.keep_last) == (30, 10, False)
    assert started["held"] is not None
    thesis = start_training(name, early_stopping=True, epochs=200)["settings"]
    assert (thesis.epochs, thesis.stop_patience) == (200, 10)


def test_the_rate_rises_over_the_first_twentieth_and_falls_along_a_cosine():
    shares = [share_of(done, 1000) for done in range(1000)]
    assert np.argmax(shares) == 50
    assert shares[:50] == pytest.approx([(done + 1) / 51 for done in range(50)])
    assert shares[525] == pytest.approx(0.5)
    assert shares[-1] == pytest.approx(0.01)


def test_an_epoch_shows_each_texture_once_with_one_picture_and_two_segments(start_training):
    data = start_training("visuo_tactile")["data"]
    assert len(data) == TEXTURES
    (sight, touch), target = data.batch(torch.arange(2), torch.Generator().manual_seed(0))
    assert sight.shape == (2, 2304)
    assert touch.shape == (2, 2, 10, 19, 4)
    assert target.shape == (2, 4)


def test_the_thesis_network_has_so_many_weights(start_training):
    """The page says 6,282,221, of 2304 numbers of a picture and 526 of a segment."""
    assert sum(parameter.numel() for parameter in start_training("visuo_tactile")["network"].parameters()) == 6_282_221


@pytest.mark.parametrize(
    ("name", "epochs", "batch", "rate", "shows"),
    [
        ("ann", 200, 32, 0.001, 20),
        ("vision_cnn", 100, 16, 0.0003, 10),
        ("haptic_cnn", 100, 16, 0.0003, 10),
        ("tactile_cnn_lstm", 100, 16, 0.0003, 4),
    ],
)
def test_baseline_networks_have_the_course_that_their_page_tells(start_training, name, epochs, batch, rate, shows):
    started = start_training(name)
    settings = started["settings"]
    assert (settings.epochs, settings.batch, settings.learning_rate) == (epochs, batch, rate)
    assert (settings.stop_patience, settings.keep_last, settings.plateau_patience) == (10, False, None)
    assert type(started["optimiser"]) is torch.optim.Adam
    assert len(started["data"]) == shows * TEXTURES
    assert started["held"] is not None


def test_the_cnn_lstm_takes_five_successive_segments(start_training):
    inputs, _ = start_training("tactile_cnn_lstm")["data"].batch(torch.arange(3), torch.Generator().manual_seed(0))
    (runs,) = inputs if isinstance(inputs, tuple) else (inputs,)
    assert runs.shape[:2] == (3, 5)


def test_boosting_grows_two_hundred_trees_of_depth_two_for_each_attribute(monkeypatch):
    from sklearn import ensemble

    grown = []

    def boosting(**options):
        grown.append(options)
        return sklearn_boosting(**options)

    sklearn_boosting = ensemble.GradientBoostingRegressor
    monkeypatch.setattr(ensemble, "GradientBoostingRegressor", boosting)
    textures = simulated_material(textures=TEXTURES, segments=3, pictures=2).textures
    model = METHODS["boosting"].fit(Learning(textures, (), PAIRS, *OWN_FEATURES["boosting"]))
    expected = {"n_estimators": 200, "max_depth": 2, "learning_rate": 0.05, "max_features": 0.1, "random_state": 0}
    assert grown == [expected] * 4
    assert np.diff(model.first).tolist() == [200] * 4
    assert whole_textures.RATE == 0.05  # with which its answers are summed


def test_what_ridge_and_the_svm_choose_from():
    assert whole_textures.SHARES == (0.0, 0.2, 0.5, 0.8, 1.0)
    assert (tactile_svm.SEGMENTS, tactile_svm.COSTS, tactile_svm.WIDTHS) == (15, (0.3, 3.0, 30.0), (0.1, 0.3, 1.0))
