"""The encoder's layers are those of the thesis: positions, attention, and a dropout that takes the share it should."""

import math

import pytest
import torch
from torch import nn

from palpate.modeling.textures.foten_layers import Dropout, Embedding, Encoder, EncoderLayer, positions
from palpate.modeling.training.seeding import seeded

pytestmark = pytest.mark.needs("torch")


def test_positions_are_equations_4_2_and_4_3():
    found = positions(20, 64)
    assert found.shape == (20, 64)
    for place, dimension in ((0, 0), (7, 4), (19, 62)):
        turn = place / 10000 ** (dimension / 64)
        assert found[place, dimension].item() == pytest.approx(math.sin(turn), abs=1e-6)
        assert found[place, dimension + 1].item() == pytest.approx(math.cos(turn), abs=1e-6)


def test_a_layer_answers_as_the_stock_one_with_the_same_weights():
    ours = seeded(lambda: EncoderLayer(dropout=0.0), 1)
    stock = nn.TransformerEncoderLayer(64, 4, 128, dropout=0.0, batch_first=True)
    stock.load_state_dict({
        "self_attn.in_proj_weight": ours.mix.weight, "self_attn.in_proj_bias": ours.mix.bias,
        "self_attn.out_proj.weight": ours.out.weight, "self_attn.out_proj.bias": ours.out.bias,
        "linear1.weight": ours.wide.weight, "linear1.bias": ours.wide.bias,
        "linear2.weight": ours.narrow.weight, "linear2.bias": ours.narrow.bias,
        "norm1.weight": ours.after_attention.weight, "norm1.bias": ours.after_attention.bias,
        "norm2.weight": ours.after_forward.weight, "norm2.bias": ours.after_forward.bias,
    })  # fmt: skip
    x = torch.randn(3, 20, 64, generator=torch.Generator().manual_seed(2))
    assert torch.allclose(ours(x), stock.train()(x), atol=2e-6)


def test_three_layers_keep_the_shape():
    assert Encoder(3)(Embedding(15, 64)(torch.zeros(2, 15))).shape == (2, 15, 64)


def test_dropout_zeroes_a_fifth_and_keeps_the_mean():
    layer, x = Dropout(0.2), torch.ones(400, 1001)
    with torch.random.fork_rng():
        torch.manual_seed(5)
        found = layer(x)
        assert not torch.equal(found, layer(x))
    assert (found == 0).float().mean().item() == pytest.approx(51 / 256, abs=0.002)
    assert found.mean().item() == pytest.approx(1.0, abs=0.003)
    assert torch.equal(layer.eval()(x), x)


def test_dropout_leaves_something():
    with pytest.raises(ValueError, match="leaves nothing"):
        Dropout(1.0)
