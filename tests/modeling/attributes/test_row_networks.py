"""The baseline networks' sizes, and what they are shown."""

from dataclasses import replace

import pytest
import torch

from palpate.modeling.attributes import row_networks as sizes
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.methods import RowPlan
from palpate.modeling.attributes.network_methods import ANN
from palpate.modeling.attributes.registry import METHODS
from palpate.modeling.attributes.row_networks import (
    NETWORKS,
    Ann,
    CnnLstm,
    all_rows,
    examples,
    pooled,
    random_rows,
    restore_rows,
    stack_of,
)
from tests.modeling.attributes.learning_for_tests import learning, unseen_textures

pytestmark = pytest.mark.needs("torch")


def linear(module):
    return [(layer.in_features, layer.out_features) for layer in module.modules() if isinstance(layer, torch.nn.Linear)]


def test_the_ann_has_the_sizes_of_thesis_3_6_6():
    network = Ann([526, 2304], 4)
    assert linear(network.touch) == [(526, 128), (128, 256), (256, 256), (256, 128)]
    assert linear(network.sight) == [(2304, 128), (128, 256), (256, 256), (256, 128)]
    assert linear(network.fused) == [(256, 64), (64, 64), (64, 4)]
    assert network(torch.zeros(3, 526), torch.zeros(3, 2304)).shape == (3, 4)


@pytest.mark.parametrize(
    ("name", "width", "filters", "layers"),
    [
        ("vision_cnn", 2048, [(1, 16, 5), (16, 32, 5)], [(32 * 128, 64), (64, 4)]),
        ("haptic_cnn", 256, [(1, 16, 3), (16, 32, 3), (32, 64, 3)], [(64 * 4, 64), (64, 64), (64, 4)]),
        ("tactile_cnn_lstm", 250, [(1, 32, 5), (32, 64, 5)], [(64 * 16, 64), (64, 32), (32, 4)]),
    ],
)
def test_the_other_networks_have_the_sizes_that_their_page_tells(name, width, filters, layers):
    """docs/reference/attribute-models.md; the greatest of every four after each convolution."""
    network = NETWORKS[name]([width], 4)
    convolutions = [module for module in network.modules() if isinstance(module, torch.nn.Conv1d)]
    assert [
        (convolution.in_channels, convolution.out_channels, *convolution.kernel_size) for convolution in convolutions
    ] == filters
    assert linear(network) == layers
    pools = [module.kernel_size for module in network.modules() if isinstance(module, torch.nn.MaxPool1d)]
    assert pools == [4] * len(filters)
    assert [module.p for module in network.modules() if isinstance(module, torch.nn.Dropout)] == [0.3]
    memories = [module for module in network.modules() if isinstance(module, torch.nn.LSTM)]
    assert [(memory.input_size, memory.hidden_size) for memory in memories] == [(64, 64)] * (name == "tactile_cnn_lstm")


@pytest.mark.parametrize("name", ["vision_cnn", "haptic_cnn"])
@pytest.mark.parametrize("width", [1, 6, 24, 256, 2304])
def test_a_convolutional_network_takes_rows_of_any_width(name, width):
    assert NETWORKS[name]([width], 4)(torch.zeros(2, width)).shape == (2, 4)


@pytest.mark.parametrize("width", [1, 6, 24, 250, 526])
def test_the_cnn_lstm_takes_any_number_of_segments_of_any_width(width):
    for segments in (1, 5):
        assert CnnLstm([width], 4)(torch.zeros(2, segments, width)).shape == (2, 4)


def test_the_lstm_hears_the_order_of_segments():
    network = CnnLstm([20], 4).eval()
    rows = torch.randn(1, 5, 20, generator=torch.Generator().manual_seed(1))
    assert not torch.allclose(network(rows), network(rows.flip(1)))


def test_no_number_is_left_out_by_pooling():
    assert [pooled(length, 1) for length in (1, 4, 5, 16, 17)] == [1, 1, 2, 4, 5]
    along = sizes.convolutions((2,), 3).eval()
    torch.nn.init.ones_(along[0].weight)
    one = torch.zeros(1, 1, 9)
    other = one.clone()
    other[0, 0, 8] = 50.0
    assert not torch.equal(along(one), along(other))


def stack():
    """Three textures of 7, 2 and 12 rows; a row holds its texture and its place."""
    return stack_of([torch.stack([torch.full((count,), float(t)), torch.arange(count).float()], 1)
                     for t, count in enumerate((7, 2, 12))])  # fmt: skip


def test_an_epoch_shows_every_texture_as_often_and_runs_of_one_texture():
    source = random_rows([stack()], torch.arange(3.0)[:, None], shows=200, steps=3)
    (rows,), targets = source.batch(torch.arange(len(source)), torch.Generator().manual_seed(0))
    assert rows.shape == (600, 3, 2)
    assert torch.equal(rows[:, :, 0], targets.expand(-1, 3))
    assert torch.bincount(targets[:, 0].long()).tolist() == [200, 200, 200]
    starts = rows[:, 0, 1]
    long = targets[:, 0] != 1
    assert torch.equal(rows[long][:, :, 1], starts[long][:, None] + torch.arange(3.0))
    assert set(starts[targets[:, 0] == 0].tolist()) == set(range(5))
    assert set(starts[targets[:, 0] == 2].tolist()) == set(range(10))
    assert rows[~long][0, :, 1].tolist() == [0, 1, 0]


def test_everything_is_each_row_or_run_once_and_pairs_in_turn():
    places, starts = examples([stack()], 3)
    assert list(zip(places.tolist(), starts.tolist(), strict=True)) == [
        (0, 0), (0, 3), (1, 0), (2, 0), (2, 3), (2, 6), (2, 9)
    ]  # fmt: skip
    other = stack_of([torch.zeros(4, 1), torch.arange(5.0)[:, None], torch.zeros(1, 1)])
    source = all_rows([stack(), other], torch.zeros(3, 1), 1)
    (one, two), _ = source.batch(torch.arange(len(source)), torch.Generator())
    assert len(source) == 7 + 5 + 12
    assert one[7:12, 1].tolist() == [0, 1, 0, 1, 0]
    assert two[7:12, 0].tolist() == [0, 1, 2, 3, 4]


def test_what_is_shown_is_part_of_a_sources_digest():
    target = torch.zeros(3, 1)
    digests = {random_rows([stack()], target, shows, steps).digest for shows, steps in ((4, 1), (5, 1), (4, 2))}
    assert len(digests | {all_rows([stack()], target, 1).digest}) == 4


def test_variants_are_learned_from_and_are_no_part_of_an_answer():
    given = learning(METHODS["vision_cnn"], settings={"epochs": 2})
    bare = replace(given, train=tuple(replace(texture, variants={}) for texture in given.train))
    with_variants, without = (METHODS["vision_cnn"].fit(data) for data in (given, bare))
    texture = unseen_textures()[0]
    assert not (with_variants.predict(texture) == without.predict(texture)).all()
    assert len(with_variants.predict(texture)) == 3
    assert (with_variants.predict(texture) == with_variants.predict(replace(texture, variants={}))).all()


def test_a_training_resumes_from_its_checkpoint(tmp_path):
    settings = {"epochs": 10, "checkpoint": tmp_path}
    first = ANN.fit(learning(ANN, settings={**settings, "stop_patience": 50}))
    again = ANN.fit(learning(ANN, settings={**settings, "epochs": 12, "stop_patience": 50}))
    straight = ANN.fit(learning(ANN, settings={"epochs": 12, "stop_patience": 50}))
    assert len(first.trained.history) == 10
    assert again.trained.continued_from == 10
    assert again.predict(unseen_textures()[0]).tobytes() == straight.predict(unseen_textures()[0]).tobytes()


def test_wishes_reach_the_training():
    quick = ANN.fit(learning(ANN, settings={"quick": True, "learning_rate": 1e-4}))
    assert [epoch.learning_rate for epoch in quick.trained.history] == [1e-4] * 5


def test_another_methods_file_is_refused():
    fitted = ANN.fit(learning(ANN, settings={"epochs": 1}))
    with pytest.raises(MaterialError, match="'ann' was given to 'vision_cnn'"):
        restore_rows(RowPlan("vision_cnn", ("sight",), 1), *fitted.saved())
