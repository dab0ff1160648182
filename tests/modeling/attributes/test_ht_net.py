"""HT-Net has the thesis' six layers and poolings, and gives every stage the shape that is promised."""

import pytest
import torch

from palpate.modeling.attributes.ht_net import HTNet, halved, shapes
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.training.threads import limited

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(autouse=True)
def one_thread():
    with limited(1):
        yield


def test_the_shapes_of_a_segment_of_cepstra_and_hand():
    assert shapes(HTNet(19), torch.randn(2, 10, 19, 4)) == {
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
    assert shapes(HTNet(3), torch.randn(1, steps, 3, 2))["layer 6"] == (left, 128, 2)


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
def test_another_shape_is_refused(shape):
    with pytest.raises(MaterialError, match=r"\(batch, steps, 3, places\)"):
        HTNet(3)(torch.zeros(shape))
