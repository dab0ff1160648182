"""The two networks have exactly the shapes of thesis 5.4 and 5.6, right gradients, and a decoder that stays frozen."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import nn
from torch.nn import functional

from palpate.modeling.doors.networks import (
    ForceToPerception,
    PerceptionToForce,
    Rescale,
    ResidualBlock,
    answers,
    exported_network,
)
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.models.card import Affine, Clip, tensors_named
from tests.modeling.doors.network_learning import SEEN, profiles, run_by_numpy

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(autouse=True)
def _one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.manual_seed(3)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def _inverse_network():
    return PerceptionToForce(ForceToPerception().decoder)


@pytest.fixture
def inverse(_inverse_network):
    """One network for all tests: its 56 million weights take a second to draw."""
    _inverse_network.zero_grad(set_to_none=True)
    return _inverse_network.float()


def convolutions(module):
    return [
        (layer.in_channels, layer.out_channels, layer.kernel_size[0])
        for layer in module.modules()
        if isinstance(layer, nn.Conv1d)
    ]


def test_the_forward_network_has_the_shapes_of_the_thesis():
    network, layer_shapes = ForceToPerception(), {}
    stages = {
        "latent": network.encoder,
        "restored": network.decoder,
        "hidden": network.head[1],
        "ratings": network.head,
    }
    for name, stage in stages.items():
        stage.register_forward_hook(
            lambda _layer, _given, out, name=name: layer_shapes.update({name: tuple(out.shape[1:])})
        )
    network(torch.randn(2, 621))
    assert layer_shapes == {"latent": (128, 155), "restored": (64, 620), "hidden": (128,), "ratings": (7,)}


def test_the_encoder_halves_twice_and_the_decoder_doubles_twice():
    network, lengths = ForceToPerception(), []
    for layer in (*network.encoder, *network.decoder):
        layer.register_forward_hook(lambda _layer, _given, out: lengths.append(tuple(out.shape[1:])))
    network(torch.randn(1, 621))
    encoded = [(64, 621)] * 3 + [(64, 310)] + [(128, 310)] * 3 + [(128, 155)]
    decoded = [(128, 155)] * 3 + [(128, 310)] + [(64, 310)] * 3 + [(64, 620)]
    assert lengths == encoded + decoded


def test_every_convolution_of_the_forward_network_has_width_three_and_the_filters_of_the_thesis():
    network = ForceToPerception()
    assert convolutions(network.encoder) == [(1, 64, 3), (64, 64, 3), (64, 64, 3), (64, 128, 3)] + [(128, 128, 3)] * 2
    assert convolutions(network.decoder) == [(128, 128, 3)] * 3 + [(128, 64, 3)] + [(64, 64, 3)] * 2
    dense = [(layer.in_features, layer.out_features) for layer in network.modules() if isinstance(layer, nn.Linear)]
    assert dense == [(64 * 620, 128), (128, 7)]
    assert [layer.p for layer in network.modules() if isinstance(layer, nn.Dropout)] == [0.1]


def test_the_inverse_network_has_the_shapes_of_the_thesis(inverse):
    network = inverse
    assert convolutions(network.encoder) == [(1, 64, 2), (64, 128, 3), (128, 256, 3), (256, 512, 3)]
    assert (network.project.in_features, network.project.out_features) == (3 * 512, 155 * 128)
    assert (network.out[1].in_features, network.out[1].out_features) == (620 * 64, 621)
    seen = {}
    network.decoder.register_forward_hook(lambda _layer, given, out: seen.update(latent=given[0].shape, out=out.shape))
    assert network(torch.randn(2, 7)).shape == (2, 621)
    assert seen == {"latent": (2, 128, 155), "out": (2, 64, 620)}


def test_the_two_decoders_are_one_and_the_same():
    forward = ForceToPerception()
    inverse = PerceptionToForce(forward.decoder)
    mine, theirs = inverse.decoder.state_dict(), forward.decoder.state_dict()
    assert mine.keys() == theirs.keys()
    assert all(torch.equal(mine[name], theirs[name]) and mine[name] is not theirs[name] for name in mine)


def test_a_frozen_decoder_gets_no_gradient_and_is_not_changed_by_training(inverse):
    before = {name: value.clone() for name, value in inverse.state_dict().items()}
    optimiser = torch.optim.SGD(inverse.parameters(), 0.1)
    functional.mse_loss(inverse(torch.randn(2, 7)), torch.randn(2, 621)).backward()
    optimiser.step()
    assert all(value.grad is None for value in inverse.decoder.parameters())
    after = inverse.state_dict()
    changed = {name for name, value in before.items() if not torch.equal(value, after[name])}
    assert changed == {name for name in before if not name.startswith("decoder.")}


def test_huber_with_delta_two_is_equation_5_4():
    off = torch.linspace(-7, 7, 57, dtype=torch.float64)
    expected = torch.where(off.abs() <= 2, off**2 / 2, 2 * (off.abs() - 1))
    loss = functional.huber_loss(off, torch.zeros_like(off), delta=2.0, reduction="none")
    assert torch.allclose(loss, expected, atol=0, rtol=1e-15)


def test_dropout_acts_only_while_training():
    network, force = ForceToPerception(), torch.randn(1, 621)
    torch.manual_seed(0)
    assert not torch.equal(network(force), network(force))
    network.eval()
    assert torch.equal(network(force), network(force))


def test_a_residual_block_adds_its_input_before_the_last_relu():
    block = ResidualBlock(2)
    x = torch.randn(1, 2, 5)
    inner = functional.conv1d(x, block.first.weight, block.first.bias, padding=1).clamp(min=0)
    inner = functional.conv1d(inner, block.second.weight, block.second.bias, padding=1)
    assert torch.allclose(block(x), (x + inner).clamp(min=0))


def difference(loss, value, place, step):
    """The central finite difference of a loss over one number of a tensor."""
    flat = value.data.view(-1)
    before = flat[place].item()
    flat[place] = before + step
    above = loss().item()
    flat[place] = before - step
    below = loss().item()
    flat[place] = before
    return (above - below) / (2 * step)


def off(loss, value, place):
    """The relative error of one number's gradient; a smaller step where the first one crossed a kink of some ReLU."""
    exact = value.grad.view(-1)[place].item()
    with torch.no_grad():
        errors = (abs(difference(loss, value, place, step) - exact) / abs(exact) for step in (1e-6, 1e-7))
        return next((error for error in errors if error < 1e-4), 1.0)


def worst_gradient(network, given, measure):
    """The largest relative error of backpropagation against finite differences, over every trained tensor."""
    network.double().eval()

    def loss():
        return measure(network(given))

    loss().backward()
    trained = [value for value in network.parameters() if value.requires_grad]
    return max(off(loss, value, int(value.grad.abs().argmax())) for value in trained)


def test_gradients_of_the_forward_network_agree_with_finite_differences():
    force, ratings = torch.randn(1, 621, dtype=torch.float64), torch.randn(1, 7, dtype=torch.float64)
    worst = worst_gradient(ForceToPerception(), force, lambda y: functional.huber_loss(y, ratings, delta=2.0))
    assert worst < 1e-4


def test_gradients_of_the_inverse_network_agree_with_finite_differences(inverse):
    ratings, force = torch.randn(1, 7, dtype=torch.float64), torch.randn(1, 621, dtype=torch.float64)
    assert worst_gradient(inverse, ratings, lambda y: functional.mse_loss(y, force)) < 1e-4


def test_the_slope_of_the_answer_over_the_force_agrees_with_finite_differences():
    network = ForceToPerception().double().eval()
    force = torch.randn(1, 621, dtype=torch.float64, requires_grad=True)
    network(force).sum().backward()
    assert max(off(lambda: network(force).sum(), force, place) for place in np.linspace(0, 620, 7).astype(int)) < 1e-4


def forward_network():
    torch.manual_seed(2)
    rows = profiles(SEEN)
    ratings = np.random.default_rng(0).uniform(0, 100, (len(rows), 7))
    return nn.Sequential(Rescale.down(rows), ForceToPerception(), Rescale.up(ratings)), rows


def test_the_forward_network_answers_in_numpy_as_in_torch():
    network, rows = forward_network()
    by_numpy = run_by_numpy(exported_network(network), 621, 7).run(rows)
    assert np.abs(by_numpy - answers(network, rows)).max() < 1e-4


def test_the_inverse_network_answers_in_numpy_as_in_torch():
    torch.manual_seed(4)
    wishes = np.random.default_rng(1).uniform(0, 100, (3, 7))
    scaled = (profiles(SEEN) + 20.0) / 70.0 * 100.0
    network = nn.Sequential(Rescale.down(wishes), PerceptionToForce(), Rescale.up(scaled))
    by_numpy = run_by_numpy(exported_network(network), 7, 621).run(wishes)
    assert np.abs(by_numpy - answers(network, wishes)).max() < 1e-4


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
