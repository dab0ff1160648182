"""The two branches joined: shapes, what is asked of whom, and the loss."""

import math

import pytest
import torch

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.visuo_tactile import OWN, REBUILDING, REBUILT, Answer, VisuoTactile, rmse
from palpate.modeling.training.threads import limited

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(autouse=True)
def one_thread():
    with limited(1):
        yield


def made(sight=64, touch=3):
    torch.manual_seed(1)
    return VisuoTactile(sight, touch)


def given(rows=2, segments=3):
    return torch.randn(rows, 64), torch.randn(rows, segments, 10, 3, 4)


def test_its_head_is_that_of_thesis_3_5_3():
    net = made()
    assert [(each.in_features, each.out_features) for each in net.joined] == [(256, 128), (128, 128)]
    assert (net.last.in_features, net.last.out_features) == (64, 32)
    assert (net.out.in_features, net.out.out_features) == (32, 4)
    assert made(touch=None).joined[0].in_features == 128
    assert [(each.in_features, each.out_features) for each in net.own] == [(128, 4), (128, 4)]


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
    net = made()
    parts = [torch.randn(2, 1, 128), torch.randn(2, 3, 128)]
    x = torch.cat([parts[0].expand(-1, 3, -1), parts[1]], dim=2)
    for layer in net.joined:
        x = torch.relu(layer(x))
    greater = torch.maximum(x[..., 0::2], x[..., 1::2])
    torch.testing.assert_close(net.head(parts), net.out(torch.relu(net.last(greater))))


def test_every_segment_is_answered_in_training_and_their_mean_otherwise():
    net, (sight, touch) = made(), given()
    each = net(sight, touch)
    assert each.attributes.shape == (2, 3, 4)
    found = net.eval()(sight, touch)
    torch.testing.assert_close(found.attributes[:, 0], each.attributes.mean(dim=1))
    assert found.wrong.tolist() == [0.0]
    assert found.own == ()


def test_in_half_of_the_batches_one_picture_is_made_anew():
    net, (sight, _) = made(touch=None), given()
    wrong = torch.cat([net(sight).wrong for _ in range(60)])
    assert REBUILT == 0.5
    assert 20 <= int((wrong > 0).sum()) <= 40
    rebuilt = net.sight(sight).rebuilt
    torch.testing.assert_close(wrong.max(), (rebuilt - sight).square().mean(dim=1)[0])


def test_each_of_two_branches_has_a_head_of_its_own_which_hears_nothing_of_the_other():
    net, (sight, touch) = made(), given()
    seen, felt = net(sight, touch).own
    assert seen.shape == (2, 1, 4)
    assert felt.shape == (2, 3, 4)
    torch.testing.assert_close(net(sight, torch.randn_like(touch)).own[0], seen)
    torch.testing.assert_close(net(torch.randn_like(sight), touch).own[1], felt)
    assert made(touch=None)(sight).own == ()


def test_a_picture_shared_by_segments_answers_as_if_shown_with_each():
    net, (sight, touch) = made(), given(1, 3)
    alone = torch.cat([net(sight, touch[:, place : place + 1]).attributes for place in range(3)], dim=1)
    torch.testing.assert_close(net(sight, touch).attributes, alone, rtol=1e-4, atol=1e-5)


def test_either_branch_by_itself():
    sight, touch = given()
    assert made(touch=None)(sight).attributes.shape == (2, 1, 4)
    felt = made(sight=None)(touch)
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
        made(touch=None)(sight, touch)
    with pytest.raises(MaterialError, match="was given"):
        made()(sight)
    with pytest.raises(MaterialError, match="was given"):
        made()(sight, touch[:1])
    with pytest.raises(MaterialError, match="neither sees nor feels"):
        VisuoTactile(None, None)
