"""FNN, DSTN and HapInf have the shapes that they promise, learn, and become files that answer the same."""

import numpy as np
import pytest
import torch

from palpate.modeling.files.model_files import write_model
from palpate.modeling.textures.dstn import DSTN, Dstn
from palpate.modeling.textures.exporting import exported_windows, pieces
from palpate.modeling.textures.fitting import for_length
from palpate.modeling.textures.fnn import FNN, Fnn, bands
from palpate.modeling.textures.hapinf import HAPINF, HapInf, asking, picked
from palpate.modeling.textures.informer_layers import Distilled, ProbSparse
from palpate.modeling.textures.methods import Learning
from palpate.modeling.textures.recording import Recording, Scale, TextureDataError
from palpate.modeling.textures.windows import windows
from palpate.modeling.training.seeding import seeded
from palpate.modeling.training.settings import Settings
from palpate.signals.models.card import Port
from palpate.signals.models.file import read_model
from tests.modeling.textures.recording_for_tests import parts, recording

pytestmark = pytest.mark.needs("torch")

SCALE = Scale(np.array([0.01, 75.0, 1.0]), np.array([2.2, 36.0, 0.5]))
NETWORKS = {"fnn": (Fnn, 30), "dstn": (Dstn, 40), "hapinf": (HapInf, 10)}
METHODS = {"fnn": FNN, "dstn": DSTN, "hapinf": HAPINF}


def network_of(name, window=None):
    """A network that has seen something: its batch normalisation is not that of a new one."""
    make, own = NETWORKS[name]
    network = seeded(lambda: make(window or own), 3)
    network.train()
    with torch.no_grad():
        network(torch.randn(64, 3, window or own, generator=torch.Generator().manual_seed(1)))
    return network.eval(), window or own


def learning(seconds=2.0, seed=0, window=None, **settings):
    whole = recording(seconds)
    return Learning(
        whole, parts(whole), window, seed=seed, settings={"epochs": 1, "threads": 1, "batch": 64} | settings
    )


def watched(network, *names):
    """The shapes that come out of these layers."""
    shapes = {}
    for name in names:
        network.get_submodule(name).register_forward_hook(
            lambda _layer, _given, output, name=name: shapes.update({name: tuple(torch.as_tensor(output).shape)})
        )
    return shapes


def test_the_shapes_are_those_that_are_promised():
    network, window = network_of("hapinf")
    shapes = watched(network, "embedded", "first", "distilled", "encoded", "wanted", "among", "across", "decoded")
    assert network(torch.randn(2, 3, window)).shape == (2, 1)
    assert [shapes[name][1:] for name in ("embedded", "first")] == [(10, 64)] * 2
    assert [shapes[name][1:] for name in ("distilled", "encoded")] == [(5, 64)] * 2
    assert [shapes[name][1:] for name in ("wanted", "among", "across", "decoded")] == [(6, 64)] * 4
    network, window = network_of("dstn")
    shapes = watched(network, "second", "norm", "across", "decoder")
    assert network(torch.randn(2, 3, window)).shape == (2, 1)
    assert [shape[1:] for shape in shapes.values()] == [(32, 40), (40, 32), (1, 64), (64,)]
    network, window = network_of("fnn")
    assert network(torch.randn(2, 3, window)).shape == (2, 1)
    assert network.split.shape == (90, 30)
    assert [band[0].weight.shape for band in network.bands] == [(32, 32)] * 3


@pytest.mark.parametrize("name", NETWORKS)
def test_a_window_of_another_length_is_refused(name):
    network, window = network_of(name)
    with pytest.raises(TextureDataError, match=rf"\(batch, 3, {window}\) is expected"):
        network(torch.zeros(1, 3, window - 1))


def test_a_window_that_cannot_be_halved_is_refused():
    assert HapInf(4)(torch.zeros(1, 3, 4)).shape == (1, 1)
    with pytest.raises(TextureDataError, match="at least 4"):
        HapInf(3)


@pytest.mark.parametrize(("name", "window"), [("fnn", 30), ("dstn", 40), ("hapinf", 10), ("hapinf", 25), ("dstn", 12)])
def test_the_file_answers_as_the_network_does_and_is_small(name, window, tmp_path):
    network, window = network_of(name, window)
    exported = exported_windows(network, SCALE, window)
    assert sum(tensor.size for tensor in exported.tensors.values()) * 2 < 1e6  # in float16
    card = write_model(
        tmp_path, "model", exported, title="a texture", method=name,
        takes=Port(kind="texture_window", size=3 * window, unit="m/s^2, mm/s, N"),
        gives=Port(kind="acceleration", size=1, unit="m/s^2"),
    )  # fmt: skip
    model, chance = read_model(card), np.random.Generator(np.random.PCG64(1))
    for size in (1.0, 0.01, 5.0):
        given = chance.standard_normal((40, 3, window)) * SCALE.sd[:, None] * size + SCALE.mean[:, None]
        with torch.no_grad():
            expected = network(torch.tensor(SCALE.down(given), dtype=torch.float32)).double().numpy()
        assert np.allclose(model.run(given.reshape(40, -1)), expected * SCALE.sd[0] + SCALE.mean[0], atol=1e-5)


def test_the_bands_are_the_window_again_and_each_has_its_own_frequencies():
    split = bands(30)
    assert np.allclose(sum(split.reshape(3, 30, 30)), np.eye(30))
    for band, frequency in enumerate((40.0, 175.0, 420.0)):
        tone = np.sin(2 * np.pi * frequency * np.arange(30) / 1000 + 0.3)
        power = ((split @ tone).reshape(3, 30)[:, 8:-8] ** 2).sum(axis=1)
        assert power.argmax() == band
        assert power[band] > 0.6 * power.sum()


@pytest.mark.parametrize("causal", [False, True])
def test_where_every_place_asks_it_is_plain_attention(causal):
    ours = seeded(lambda: ProbSparse(16, 4, causal=causal), 1)
    plain = torch.nn.MultiheadAttention(16, 4, batch_first=True)
    with torch.no_grad():
        for mine, theirs in (
            (ours.mix.weight, plain.in_proj_weight), (ours.mix.bias, plain.in_proj_bias),
            (ours.out.weight, plain.out_proj.weight), (ours.out.bias, plain.out_proj.bias),
        ):  # fmt: skip
            theirs.copy_(mine)
    x, memory = (torch.randn(3, 7, 16, generator=torch.Generator().manual_seed(seed)) for seed in (1, 2))
    mask = torch.ones(7, 7, dtype=torch.bool).triu(1) if causal else None
    for source in (x, memory):
        expected = plain(x, source, source, attn_mask=mask, need_weights=False)[0]
        assert torch.allclose(ours(x, source), expected, atol=1e-6)


@pytest.mark.parametrize("causal", [False, True])
def test_places_that_do_not_ask_answer_plainly(causal):
    """By hand, place by place; one head, and projections that change nothing."""
    layer = ProbSparse(4, 1, 2, causal)
    with torch.no_grad():
        layer.mix.weight.copy_(torch.eye(4).repeat(3, 1))
        layer.out.weight.copy_(torch.eye(4))
        layer.mix.bias.zero_()
        layer.out.bias.zero_()
    x = torch.randn(1, 5, 4, generator=torch.Generator().manual_seed(1))
    scores = (x[0] @ x[0].T / 2).numpy()
    first = np.argsort(-(scores.max(axis=1) - scores.mean(axis=1)))[:2]
    for place, answer in enumerate(layer(x)[0].detach().numpy()):
        seen = x[0, : place + 1].numpy() if causal else x[0].numpy()
        share = np.exp(scores[place, : len(seen)])
        plain = seen.sum(axis=0) if causal else seen.mean(axis=0)
        assert np.allclose(answer, share @ seen / share.sum() if place in first else plain, atol=1e-5)


def test_few_places_ask_where_there_are_many():
    assert [asking(length) for length in (2, 5, 6, 10, 40)] == [2, 4, 4, 5, 8]


def test_the_decoder_begins_with_the_newest_half_and_a_place_without_acceleration():
    signals = np.arange(30.0).reshape(3, 10)
    inputs = (picked(10).numpy() @ signals.ravel()).reshape(3, 6)
    assert (inputs[:, :5] == signals[:, 5:]).all()
    assert inputs[:, 5].tolist() == [0.0, 19.0, 29.0]


def test_a_short_recording_is_gone_through_more_often():
    settings = Settings(epochs=40, plateau_patience=None, stop_patience=6)
    settings_by_seconds = {seconds: for_length(settings, learning(seconds)) for seconds in (0.5, 5.0, 20.0, 30.0)}
    assert [scaled.epochs for scaled in settings_by_seconds.values()] == [400, 160, 40, 40]
    assert [scaled.stop_patience for scaled in settings_by_seconds.values()] == [60, 24, 6, 6]
    assert settings_by_seconds[5.0].plateau_patience is None


def test_distilling_halves_the_places():
    assert Distilled(8)(torch.randn(4, 11, 8)).shape == (4, 5, 8)


def test_a_recurrence_without_steps_is_refused():
    for layer in (torch.nn.LSTM(2, 2), torch.nn.LSTM(2, 2, 2, bidirectional=True)):
        with pytest.raises(TextureDataError, match="one layer in both directions"):
            list(pieces(layer, "inner."))


@pytest.mark.parametrize(("name", "window", "epochs"), [("fnn", None, 8), ("dstn", 12, 2), ("hapinf", None, 1)])
def test_a_few_epochs_predict_better_than_zero(name, window, epochs):
    given = learning(2.0, window=window, epochs=epochs, batch=16)
    fitted = METHODS[name].fit(given)
    whole = windows(given.recording, given.parts.test, fitted.window)
    error = np.abs(fitted.predict(whole.given) - whole.target).mean()
    assert error < 0.7 * np.abs(whole.target).mean()
    assert fitted.window == (window or METHODS[name].window)


@pytest.mark.parametrize("name", ["fnn", "dstn", "hapinf"])
def test_the_same_seed_gives_the_same_bits_and_another_another(name):
    one, same, other = (METHODS[name].fit(learning(0.5, seed=seed, window=10)).exported().tensors for seed in (1, 1, 2))
    assert all(np.array_equal(one[key], same[key]) for key in one)
    assert any(not np.array_equal(one[key], other[key]) for key in one)


@pytest.mark.parametrize("name", NETWORKS)
def test_a_silent_recording_is_refused(name):
    whole = recording(1.2)
    silent = Recording("silent", "silent", whole.signals * np.array([[0.0], [1.0], [1.0]]))
    with pytest.raises(TextureDataError, match="does not vary"):
        METHODS[name].fit(Learning(silent, parts(silent), settings={"quick": True}))


@pytest.mark.parametrize("name", NETWORKS)
def test_a_hand_that_never_varies_gives_a_model_that_answers(name):
    whole = recording(0.8)
    still = Recording("still", "still", np.stack([whole.signals[0], np.full(800, 60.0), np.full(800, 0.9)]))
    model = METHODS[name].fit(Learning(still, parts(still), settings={"epochs": 1, "batch": 128}))
    given = windows(still, parts(still).test, model.window).given
    assert np.isfinite(model.predict(given)).all()
