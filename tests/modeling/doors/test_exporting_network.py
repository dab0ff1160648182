"""A network as steps and tensors: everything in it is named, and the rig's runtime answers as torch does."""

import numpy as np
import pytest
import torch
from torch import nn

from palpate.modeling.doors.data import ModelDataError
from palpate.modeling.doors.exporting_network import exported_network
from palpate.modeling.doors.network_parts import Rescale, answers
from palpate.modeling.doors.networks import ForceToPerception, PerceptionToForce
from palpate.signals.models.card import Affine, Clip, tensors_named
from tests.modeling.doors.network_learning import SEEN, profiles, run_by_numpy

pytestmark = pytest.mark.needs("torch")


def forward_network():
    torch.manual_seed(2)
    rows = profiles(SEEN)
    ratings = np.random.default_rng(0).uniform(0, 100, (len(rows), 7))
    return nn.Sequential(Rescale.down(rows), ForceToPerception(), Rescale.up(ratings)), rows


def test_the_forward_network_answers_in_numpy_as_in_torch():
    network, rows = forward_network()
    found = run_by_numpy(exported_network(network), 621, 7).run(rows)
    assert np.abs(found - answers(network, rows)).max() < 1e-4


def test_the_inverse_network_answers_in_numpy_as_in_torch():
    torch.manual_seed(4)
    wishes = np.random.default_rng(1).uniform(0, 100, (3, 7))
    scaled = (profiles(SEEN) + 20.0) / 70.0 * 100.0
    network = nn.Sequential(Rescale.down(wishes), PerceptionToForce(), Rescale.up(scaled))
    found = run_by_numpy(exported_network(network), 7, 621).run(wishes)
    assert np.abs(found - answers(network, wishes)).max() < 1e-4


def test_every_tensor_that_the_steps_name_is_there_in_float32_and_no_other():
    exported = exported_network(forward_network()[0], Affine(gain=2.0), Clip(low=0.0, high=100.0))
    named = list(tensors_named(exported.steps))
    assert sorted(named) == sorted(exported.tensors)
    assert len(set(named)) == len(named)
    assert {array.dtype for array in exported.tensors.values()} == {np.dtype(np.float32)}
    assert [step.do for step in exported.steps[-2:]] == ["affine", "clip"]


def test_what_is_exported_does_not_change_when_the_network_is_trained_further():
    network, _ = forward_network()
    exported = exported_network(network)
    before = exported.tensors["1.head.4.bias"].copy()
    with torch.no_grad():
        network[1].head[4].bias += 1
    assert np.array_equal(exported.tensors["1.head.4.bias"], before)


@pytest.mark.parametrize(
    "layer",
    [
        nn.BatchNorm1d(3), nn.Tanh(), nn.Conv1d(1, 1, 3, stride=2), nn.Conv1d(1, 1, 3, padding="same"),
        nn.Conv1d(1, 1, 3, bias=False), nn.Linear(2, 2, bias=False), nn.MaxPool1d(2, stride=1),
        nn.MaxPool1d(2, ceil_mode=True), nn.Upsample(scale_factor=2, mode="linear"), nn.Upsample(scale_factor=1.5),
    ],
)  # fmt: skip
def test_a_layer_that_cards_have_no_step_for_is_refused_by_its_place(layer):
    with pytest.raises(ModelDataError, match=r"^1\.: model cards"):
        exported_network(nn.Sequential(nn.ReLU(), layer))


def test_weights_that_are_not_finite_are_refused():
    layer = nn.Linear(2, 1)
    with torch.no_grad():
        layer.weight[0, 1] = torch.nan
    with pytest.raises(ModelDataError, match=r"0\.weight: holds values that are not finite"):
        exported_network(nn.Sequential(layer))


def test_centring_and_its_way_back_are_inverse_and_equal_rows_stay_finite():
    rows = profiles(SEEN[:5])
    there = Rescale.down(rows)(torch.from_numpy(rows).float())
    assert abs(there.mean().item()) < 1e-5
    assert there.pow(2).mean().item() == pytest.approx(1.0, rel=1e-5)
    assert np.allclose(Rescale.up(rows)(there).numpy(), rows, atol=1e-4)
    same = np.full((3, 4), 7.0)
    assert np.array_equal(Rescale.down(same)(torch.from_numpy(same).float()).numpy(), np.zeros((3, 4)))
