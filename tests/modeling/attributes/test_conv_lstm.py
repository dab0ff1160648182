"""A ConvLSTM layer against a plain one in NumPy, and against torch's own LSTM where the two are the same."""

import numpy as np
import pytest
import torch

from palpate.modeling.attributes.conv_lstm import ConvLSTM1D
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.training.threads import limited

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(autouse=True)
def one_thread():
    with limited(1):
        yield


def along(rows, weight):
    """Rows (channels, places) under a filter (filters, channels, kernel), zeros beyond the ends: sums, one by one."""
    filters, _, kernel = weight.shape
    places = rows.shape[1]
    found = np.zeros((filters, places))
    for place in range(places):
        for tap in range(kernel):
            source = place + tap - kernel // 2
            if 0 <= source < places:
                found[:, place] += weight[:, :, tap] @ rows[:, source]
    return found


def reference(x, given, bias, kept):
    """Hidden states (steps, filters, places) of (steps, channels, places): Shi et al. 2015 without peepholes."""
    filters = kept.shape[1]
    hidden = cell = np.zeros((filters, x.shape[2]))
    found = []
    for step in x:
        gates = along(step, given) + bias[:, None] + along(hidden, kept)
        i, f, o = (1 / (1 + np.exp(-gates[n * filters : (n + 1) * filters])) for n in (0, 1, 3))
        cell = f * cell + i * np.tanh(gates[2 * filters : 3 * filters])
        hidden = o * np.tanh(cell)
        found.append(hidden)
    return np.stack(found)


def numbers(layer):
    return (each.detach().numpy().astype(float) for each in (layer.given.weight, layer.given.bias, layer.kept.weight))


def layer_of(channels, filters, kernel, dtype=torch.float32):
    torch.manual_seed(3)
    layer = ConvLSTM1D(channels, filters, kernel).to(dtype)
    with torch.no_grad():
        for each in layer.parameters():
            each.copy_(0.4 * torch.randn(each.shape))
    return layer


@pytest.mark.parametrize(("kernel", "places"), [(1, 1), (3, 1), (3, 4), (3, 2), (5, 7), (5, 3)])
@pytest.mark.parametrize(("dtype", "near"), [(torch.float32, 1e-5), (torch.float64, 1e-12)])
def test_each_step_is_what_the_equations_say(kernel, places, dtype, near):
    layer = layer_of(3, 5, kernel, dtype)
    x = torch.randn(2, 6, 3, places, dtype=dtype)
    found = layer(x).detach().numpy()
    wanted = [reference(row.numpy().astype(float), *numbers(layer)) for row in x]
    assert found.shape == (2, 6, 5, places)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=near)


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
