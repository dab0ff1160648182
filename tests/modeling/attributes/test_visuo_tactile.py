"""The two branches joined: shapes, which branch sees what, and the loss."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from torch.nn import functional

from palpate.modeling.attributes.ht_net import ConvLSTM1D, HTNet
from palpate.modeling.attributes.hv_net import HVNet
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.row_layers import RowConv, halved
from palpate.modeling.attributes.visuo_tactile import OWN, REBUILDING, REBUILT, Answer, VisuoTactile, rmse
from palpate.modeling.training.threads import limited

pytestmark = pytest.mark.needs("torch")


def hv_net_shapes(network, rows):
    """Return the shape of every stage for rows (batch, length), by name; channels before length."""
    code, answer = network.encode(rows), network(rows)
    stages = {"code": code, "stretched": network.stretch(code), "rebuilt": answer.rebuilt,
              "hidden": network.hidden(code), "embedded": answer.embedded}  # fmt: skip
    return {name: tuple(stage.shape[1:]) for name, stage in stages.items()}


def ht_net_shapes(network, segments):
    """Return the shape after every layer for segments (batch, steps, channels, places), and of the answer, by name."""
    shapes = {f"layer {place}": tuple(stage.shape[1:]) for place, stage in enumerate(network.stages(segments), 1)}
    return {**shapes, "embedded": tuple(network(segments).shape[1:])}


@pytest.mark.parametrize("filters", [1, 6])
@pytest.mark.parametrize("bias", [True, False])
@pytest.mark.parametrize(("kernel", "places"), [(1, 4), (3, 1), (3, 7), (4, 2), (4, 9)])
def test_it_is_a_convolution_with_zeros_beyond_the_ends(filters, bias, kernel, places):
    torch.manual_seed(1)
    layer = RowConv(5, filters, kernel, bias=bias).double()
    x = torch.randn(2, 3, places, 5, dtype=torch.float64, requires_grad=True)
    padded = functional.pad(x.flatten(0, 1).transpose(1, 2), (kernel // 2, (kernel - 1) // 2))
    plain = functional.conv1d(padded, layer.weight, layer.bias).transpose(1, 2).unflatten(0, (2, 3))
    output = layer(x)
    torch.testing.assert_close(output, plain, rtol=0, atol=1e-14)
    slope = torch.randn_like(output)
    expected = torch.autograd.grad(plain, (x, *layer.parameters()), slope)
    for one, other in zip(torch.autograd.grad(output, (x, *layer.parameters()), slope), expected, strict=True):
        torch.testing.assert_close(one, other, rtol=0, atol=1e-13)


@pytest.fixture(autouse=True)
def one_thread():
    with limited(1):
        yield


def test_its_layers_are_those_of_thesis_3_5_1():
    net = HVNet(2304)
    assert [layer.filters for layer in net.encoder] == [256, 256, 128, 64, 32]
    assert [layer.kernel for layer in net.encoder] == [4, 4, 3, 3, 3]
    assert [layer.filters for layer in net.decoder] == [32, 64, 128, 256, 256]
    assert [layer.kernel for layer in net.decoder] == [3, 3, 3, 4, 4]
    assert (net.first.out_features, net.second.out_features) == (512, 128)


def test_the_shapes_of_2304_features():
    shapes = hv_net_shapes(HVNet(2304), torch.randn(2, 2304))
    ends = {"rebuilt": (2304,), "hidden": (512,), "embedded": (128,)}
    assert shapes == {"code": (32, 72), "stretched": (256, 2304), **ends}


def test_to_the_letter_its_dense_layers_are_given_the_features_made_anew():
    net, rows = HVNet(64, after_reconstruction=True), torch.randn(2, 64)
    assert net.first.in_features == 64
    seen = net(rows)
    torch.testing.assert_close(seen.embedded, torch.relu(net.second(torch.relu(net.first(seen.rebuilt)))))
    torch.testing.assert_close(net.embed_rows(rows), seen.embedded)


@pytest.mark.parametrize("length", [32, 33, 63, 250, 256, 2048])
def test_any_length_from_32_is_rebuilt_at_its_own(length):
    shapes = hv_net_shapes(HVNet(length), torch.randn(2, length))
    assert shapes["code"] == (32, length // 32)
    assert shapes["rebuilt"] == (length,)


def test_every_stage_is_what_plain_one_dimensional_layers_give():
    """torch's own conv1d, relu, max_pool1d in the order of the thesis: convolution, ReLU, pooling."""
    net, rows = HVNet(64), torch.randn(3, 64)
    x = rows[:, None]
    for layer in net.encoder:
        kernel = layer.kernel
        padded = functional.pad(x, (kernel // 2, (kernel - 1) // 2))
        x = functional.max_pool1d(torch.relu(functional.conv1d(padded, layer.weight, layer.bias)), 2)
    torch.testing.assert_close(net.encode(rows), x, rtol=1e-4, atol=1e-5)
    for layer in net.decoder:
        kernel = layer.kernel
        padded = functional.pad(x, (kernel // 2, (kernel - 1) // 2))
        x = torch.relu(functional.conv1d(padded, layer.weight, layer.bias)).repeat_interleave(2, dim=2)
    joined = functional.conv1d(functional.pad(x, (2, 1)), net.join.weight, net.join.bias)[:, 0]
    torch.testing.assert_close(net.decode(net.encode(rows)), joined, rtol=1e-4, atol=1e-5)


def test_two_rows_stay_apart_through_its_first_weights():
    torch.manual_seed(0)
    embedded = HVNet(256)(torch.randn(8, 256)).embedded
    assert embedded.std(dim=0).square().mean().sqrt() > 0.3 * embedded.square().mean().sqrt()


def test_it_can_learn_to_rebuild_what_it_is_shown():
    torch.manual_seed(0)
    net = HVNet(32)
    rows = torch.randn(4, 4) @ torch.randn(4, 32)
    adam = torch.optim.Adam(net.parameters(), lr=5e-4)
    for _ in range(60):
        adam.zero_grad()
        wrong = (net(rows).rebuilt - rows).square().mean()
        wrong.backward()
        adam.step()
    assert wrong < 0.2 * rows.square().mean()


@pytest.mark.parametrize("shape", [(2, 255), (2, 1, 256), (256,)])
def test_rows_of_another_length_are_refused(shape):
    with pytest.raises(MaterialError, match=r"\(batch, 256\)"):
        HVNet(256)(torch.zeros(shape))


def test_too_short_a_row_is_refused():
    with pytest.raises(MaterialError, match="31 features, 32"):
        HVNet(31)


def along(rows, weight):
    """Rows (channels, places) under a filter (filters, channels, kernel), zeros beyond the ends: sums, one by one."""
    filters, _, kernel = weight.shape
    places = rows.shape[1]
    output = np.zeros((filters, places))
    for place in range(places):
        for tap in range(kernel):
            source = place + tap - kernel // 2
            if 0 <= source < places:
                output[:, place] += weight[:, :, tap] @ rows[:, source]
    return output


def reference(x, given, bias, recurrent):
    """Hidden states (steps, filters, places) of (steps, channels, places): Shi et al. 2015 without peepholes."""
    filters = recurrent.shape[1]
    hidden = cell = np.zeros((filters, x.shape[2]))
    states = []
    for step in x:
        gates = along(step, given) + bias[:, None] + along(hidden, recurrent)
        i, f, o = (1 / (1 + np.exp(-gates[n * filters : (n + 1) * filters])) for n in (0, 1, 3))
        cell = f * cell + i * np.tanh(gates[2 * filters : 3 * filters])
        hidden = o * np.tanh(cell)
        states.append(hidden)
    return np.stack(states)


def numbers(layer):
    return (
        tensor.detach().numpy().astype(float) for tensor in (layer.given.weight, layer.given.bias, layer.kept.weight)
    )


def layer_of(channels, filters, kernel, dtype=torch.float32):
    torch.manual_seed(3)
    layer = ConvLSTM1D(channels, filters, kernel).to(dtype)
    with torch.no_grad():
        for parameter in layer.parameters():
            parameter.copy_(0.4 * torch.randn(parameter.shape))
    return layer


@pytest.mark.parametrize(("kernel", "places"), [(1, 1), (3, 1), (3, 4), (3, 2), (5, 7), (5, 3)])
@pytest.mark.parametrize(("dtype", "near"), [(torch.float32, 1e-5), (torch.float64, 1e-12)])
def test_each_step_is_what_the_equations_say(kernel, places, dtype, near):
    layer = layer_of(3, 5, kernel, dtype)
    x = torch.randn(2, 6, 3, places, dtype=dtype)
    output = layer(x).detach().numpy()
    expected = [reference(row.numpy().astype(float), *numbers(layer)) for row in x]
    assert output.shape == (2, 6, 5, places)
    np.testing.assert_allclose(output, expected, rtol=0, atol=near)


def test_with_one_place_and_a_kernel_of_one_it_is_an_lstm():
    layer, plain = layer_of(4, 6, 1), torch.nn.LSTM(4, 6, batch_first=True)
    with torch.no_grad():
        plain.weight_ih_l0.copy_(layer.given.weight[:, :, 0])
        plain.weight_hh_l0.copy_(layer.kept.weight[:, :, 0])
        plain.bias_ih_l0.copy_(layer.given.bias)
        plain.bias_hh_l0.zero_()
    x = torch.randn(3, 9, 4)
    np.testing.assert_allclose(layer(x[..., None])[..., 0].detach(), plain(x)[0].detach(), rtol=0, atol=1e-6)


def test_gradients_are_those_of_finite_differences():
    layer = layer_of(2, 2, 3, torch.float64)
    x = torch.randn(1, 3, 2, 3, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(layer, (x,))


def test_the_past_reaches_the_present_and_the_future_does_not():
    layer = layer_of(2, 3, 3)
    x = torch.randn(1, 5, 2, 4)
    later, earlier = x.clone(), x.clone()
    later[:, 4] += 1
    earlier[:, 0] += 1
    assert torch.equal(layer(later)[:, :4], layer(x)[:, :4])
    assert not torch.equal(layer(earlier)[:, 4], layer(x)[:, 4])


def test_a_huge_input_saturates_and_stays_finite():
    assert layer_of(2, 3, 3)(torch.full((1, 40, 2, 4), 1e30)).abs().max() <= 1


@pytest.mark.parametrize("shape", [(2, 5, 4, 4), (2, 5, 3), (2, 0, 3, 4)])
def test_another_shape_is_refused(shape):
    with pytest.raises(MaterialError, match=r"\(batch, steps, 3, places\)"):
        ConvLSTM1D(3, 5)(torch.zeros(shape))


def test_a_kernel_without_a_middle_is_refused():
    with pytest.raises(MaterialError, match="kernel of 4"):
        ConvLSTM1D(3, 5, 4)


def test_the_shapes_of_a_segment_of_cepstra_and_hand():
    assert ht_net_shapes(HTNet(19), torch.randn(2, 10, 19, 4)) == {
        "layer 1": (10, 128, 4),
        "layer 2": (5, 256, 4),
        "layer 3": (5, 128, 4),
        "layer 4": (3, 128, 4),
        "layer 5": (2, 256, 4),
        "layer 6": (2, 128, 4),
        "embedded": (128,),
    }


@pytest.mark.parametrize(("steps", "left"), [(1, 1), (2, 1), (8, 1), (9, 2), (40, 5)])
def test_any_number_of_steps_is_halved_three_times(steps, left):
    assert ht_net_shapes(HTNet(3), torch.randn(1, steps, 3, 2))["layer 6"] == (left, 128, 2)


def test_the_answer_is_the_last_hidden_state_of_the_last_layer():
    net, x = HTNet(3), torch.randn(2, 10, 3, 4)
    torch.testing.assert_close(net(x), net.stages(x)[-1][:, -1].mean(dim=2))


def test_halving_takes_the_greater_of_two_and_keeps_an_odd_one():
    x = torch.tensor([[1.0, 5.0, 2.0, -1.0, 7.0]])[..., None]
    assert halved(x)[0, :, 0].tolist() == [5.0, 2.0, 7.0]


def test_a_signal_gets_through_six_layers_of_its_first_weights():
    torch.manual_seed(0)
    embedded = HTNet(19)(torch.randn(16, 10, 19, 4))
    assert embedded.std(dim=0).mean() > 0.03


@pytest.mark.parametrize("shape", [(2, 10, 4, 4), (2, 10, 3), (2, 0, 3, 4), (2, 10, 3, 0)])
def test_another_shape_is_refused_of_ht_net(shape):
    with pytest.raises(MaterialError, match=r"\(batch, steps, 3, places\)"):
        HTNet(3)(torch.zeros(shape))


def network(sight=64, touch=3):
    torch.manual_seed(1)
    return VisuoTactile(sight, touch)


def given(rows=2, segments=3):
    return torch.randn(rows, 64), torch.randn(rows, segments, 10, 3, 4)


def test_its_head_is_that_of_thesis_3_5_3():
    net = network()
    assert [(layer.in_features, layer.out_features) for layer in net.joined] == [(256, 128), (128, 128)]
    assert (net.last.in_features, net.last.out_features) == (64, 32)
    assert (net.out.in_features, net.out.out_features) == (32, 4)
    assert network(touch=None).joined[0].in_features == 128
    assert [(layer.in_features, layer.out_features) for layer in net.own] == [(128, 4), (128, 4)]


def test_to_the_letter_the_loss_is_the_rmse_of_the_attributes_alone():
    torch.manual_seed(1)
    net, (sight, touch) = VisuoTactile(64, 3, literal=True), given()
    assert net.sight.after_reconstruction and len(net.own) == 0
    answer, target = net(sight, touch), torch.randn(2, 4)
    assert answer.own == () and answer.wrong.tolist() == [0.0]
    assert rmse(answer, target).item() == pytest.approx(
        (answer.attributes - target[:, None]).square().mean().sqrt().item()
    )


def test_the_head_takes_the_greater_of_every_two():
    net = network()
    parts = [torch.randn(2, 1, 128), torch.randn(2, 3, 128)]
    x = torch.cat([parts[0].expand(-1, 3, -1), parts[1]], dim=2)
    for layer in net.joined:
        x = torch.relu(layer(x))
    greater = torch.maximum(x[..., 0::2], x[..., 1::2])
    torch.testing.assert_close(net.head(parts), net.out(torch.relu(net.last(greater))))


def test_every_segment_is_answered_in_training_and_their_mean_otherwise():
    net, (sight, touch) = network(), given()
    segments = net(sight, touch)
    assert segments.attributes.shape == (2, 3, 4)
    mean = net.eval()(sight, touch)
    torch.testing.assert_close(mean.attributes[:, 0], segments.attributes.mean(dim=1))
    assert mean.wrong.tolist() == [0.0]
    assert mean.own == ()


def test_in_half_of_the_batches_one_picture_is_made_anew():
    net, (sight, _) = network(touch=None), given()
    wrong = torch.cat([net(sight).wrong for _ in range(60)])
    assert REBUILT == 0.5
    assert 20 <= int((wrong > 0).sum()) <= 40
    rebuilt = net.sight(sight).rebuilt
    torch.testing.assert_close(wrong.max(), (rebuilt - sight).square().mean(dim=1)[0])


def test_each_of_two_branches_has_a_head_of_its_own_which_hears_nothing_of_the_other():
    net, (sight, touch) = network(), given()
    seen, felt = net(sight, touch).own
    assert seen.shape == (2, 1, 4)
    assert felt.shape == (2, 3, 4)
    torch.testing.assert_close(net(sight, torch.randn_like(touch)).own[0], seen)
    torch.testing.assert_close(net(torch.randn_like(sight), touch).own[1], felt)
    assert network(touch=None)(sight).own == ()


def test_a_picture_shared_by_segments_answers_as_if_shown_with_each():
    net, (sight, touch) = network(), given(1, 3)
    alone = torch.cat([net(sight, touch[:, place : place + 1]).attributes for place in range(3)], dim=1)
    torch.testing.assert_close(net(sight, touch).attributes, alone, rtol=1e-4, atol=1e-5)


def test_either_branch_by_itself():
    sight, touch = given()
    assert network(touch=None)(sight).attributes.shape == (2, 1, 4)
    felt = network(sight=None)(touch)
    assert felt.attributes.shape == (2, 3, 4)
    assert felt.wrong.tolist() == [0.0]


def test_the_loss_is_the_rmse_a_tenth_of_the_reconstruction_and_half_of_each_branch_s_own():
    answer = Answer(torch.tensor([[[1.0, 2.0], [3.0, 2.0]]]), torch.tensor([0.5]))
    assert REBUILDING == 0.1
    target = torch.tensor([[0.0, 2.0]])
    assert rmse(answer, target).item() == pytest.approx(math.sqrt(10 / 4) + 0.05, rel=1e-6)
    assert OWN == 0.5
    own = (torch.tensor([[[3.0, 2.0]]]), torch.tensor([[[0.0, 3.0], [0.0, 1.0]]]))
    more = 0.5 * (math.sqrt(9 / 2) + math.sqrt(2 / 4))
    assert rmse(answer._replace(own=own), target).item() == pytest.approx(math.sqrt(10 / 4) + 0.05 + more, rel=1e-6)


def test_a_perfect_answer_has_a_slope():
    attributes = torch.zeros(2, 1, 4, requires_grad=True)
    rmse(Answer(attributes, torch.zeros(2)), torch.zeros(2, 4)).backward()
    assert torch.isfinite(attributes.grad).all()


def test_what_it_does_not_look_at_is_refused():
    sight, touch = given()
    with pytest.raises(MaterialError, match="was given"):
        network(touch=None)(sight, touch)
    with pytest.raises(MaterialError, match="was given"):
        network()(sight)
    with pytest.raises(MaterialError, match="was given"):
        network()(sight, touch[:1])
    with pytest.raises(MaterialError, match="neither sees nor feels"):
        VisuoTactile(None, None)
