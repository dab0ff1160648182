"""HV-Net has the thesis' layers, and gives every stage the shape that is promised."""

import pytest
import torch
from torch.nn import functional

from palpate.modeling.attributes.hv_net import HVNet, shapes
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.training.threads import limited

pytestmark = pytest.mark.needs("torch")


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
    found = shapes(HVNet(2304), torch.randn(2, 2304))
    ends = {"rebuilt": (2304,), "hidden": (512,), "embedded": (128,)}
    assert found == {"code": (32, 72), "stretched": (256, 2304), **ends}


def test_to_the_letter_its_dense_layers_are_given_the_features_made_anew():
    net, rows = HVNet(64, after_reconstruction=True), torch.randn(2, 64)
    assert net.first.in_features == 64
    seen = net(rows)
    torch.testing.assert_close(seen.embedded, torch.relu(net.second(torch.relu(net.first(seen.rebuilt)))))
    torch.testing.assert_close(net.looked(rows), seen.embedded)


@pytest.mark.parametrize("length", [32, 33, 63, 250, 256, 2048])
def test_any_length_from_32_is_rebuilt_at_its_own(length):
    found = shapes(HVNet(length), torch.randn(2, length))
    assert found["code"] == (32, length // 32)
    assert found["rebuilt"] == (length,)


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
