"""FoTEN has the thesis' shapes, learns with either loss, and becomes a file that answers the same."""

import numpy as np
import pytest
import torch

from palpate.modeling.files.model_files import write_model
from palpate.modeling.textures.exporting import exported_windows, pieces
from palpate.modeling.textures.fitting import FittedWindows
from palpate.modeling.textures.foten import (
    FOTEN,
    FOTEN_GENERATIVE,
    FOTEN_THESIS,
    TEN,
    TEN_MFCC,
    TEN_WAVELET,
    epochs_for,
    generative,
    literal,
)
from palpate.modeling.textures.foten_network import LEAST_LOG_SD, LOSSES, EncoderLayer, Foten, nll
from palpate.modeling.textures.matching import Matched
from palpate.modeling.textures.methods import Learning
from palpate.modeling.textures.recording import Recording, Scale, TextureDataError
from palpate.modeling.textures.spectral_features import MelBlock, WaveletBlock
from palpate.modeling.textures.windows import windows
from palpate.modeling.training.seeding import seeded
from palpate.signals.models.card import Port
from palpate.signals.models.file import read_model
from tests.modeling.textures.recording_for_tests import parts, recording

pytestmark = pytest.mark.needs("torch")

SCALE = Scale(np.array([0.01, 75.0, 1.0]), np.array([2.2, 36.0, 0.5]))


def learning(seconds=2.0, seed=0, window=None, **settings):
    whole = recording(seconds)
    wished = {"epochs": 1, "threads": 1, "batch": 64} | settings
    return Learning(whole, parts(whole), window, seed=seed, settings=wished)


def test_shapes_and_weights_are_those_of_the_thesis():
    network = Foten(20)
    assert sum(parameter.numel() for parameter in network.parameters()) == 471_235
    x = torch.randn(5, 3, 20)
    assert network.embedding(x[:, 0]).shape == (5, 20, 64)
    assert network.spectral(x[:, 0]).shape == (5, 20)
    assert network.head[0].weight.shape == (256, 20 * (64 + 3))
    assert network.head[2].weight.shape == (64, 256)
    assert network(x).shape == (5, 1)
    assert generative(20)(x).shape == (5, 2)


def test_to_the_letter_five_layers_normalise_first_and_dropout_is_everywhere():
    network = literal(20)
    first = [layer.first for layer in network.modules() if isinstance(layer, EncoderLayer)]
    assert [type(layer).__name__ for layer in first] == ["LayerNorm"] * 5
    assert sum(parameter.numel() for parameter in network.parameters()) == 471_235 + 3 * 128 + 2 * 32
    x = seeded(lambda: torch.randn(400, 3, 20), 1)
    for part in (network.embedded, network.head[2], network.head[5]):
        zeros = (part(torch.ones(10_000)) == 0).float().mean().item()
        assert zeros == pytest.approx(0.2, abs=0.02)
    with torch.no_grad():
        assert not torch.equal(network(x), network(x))
        network.eval()
        assert torch.equal(network(x), network(x))


def test_a_window_of_another_length_is_refused():
    with pytest.raises(TextureDataError, match=r"\(batch, 3, 20\) is expected"):
        Foten(20)(torch.zeros(1, 3, 19))


@pytest.mark.parametrize(("spectral", "window"), [(None, 25), (MelBlock, 30), (WaveletBlock, 30), (MelBlock, 10)])
def test_the_variants_answer_one_number(spectral, window):
    assert Foten(window, spectral)(torch.randn(4, 3, window)).shape == (4, 1)


def corrected():
    matched = Matched(generative(20), 20)
    matched.weight.copy_(torch.linspace(-0.1, 0.2, 20))
    matched.log_gain.fill_(0.15)
    return matched


CASES = {
    "foten": lambda: (Foten(20), 20), "foten 15": lambda: (Foten(15), 15), "generative": lambda: (generative(20), 20),
    "ten": lambda: (Foten(25, None), 25), "mfcc": lambda: (Foten(30, MelBlock), 30),
    "wavelet": lambda: (Foten(25, WaveletBlock), 25), "matched": lambda: (corrected(), 20),
    "literal": lambda: (literal(20), 20),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_file_answers_as_the_network_does(case, tmp_path):
    network, window = seeded(CASES[case], 4)
    network.eval()
    exported = exported_windows(network, SCALE, window)
    answers = network(torch.zeros(1, 3, window)).shape[1]
    card = write_model(
        tmp_path, "model", exported, title="a texture", method="foten",
        takes=Port(kind="texture_window", size=3 * window, unit="m/s^2, mm/s, N"),
        gives=Port(kind="acceleration", size=answers, unit="m/s^2"),
    )  # fmt: skip
    model, chance = read_model(card), np.random.Generator(np.random.PCG64(1))
    for size in (1.0, 0.01, 5.0):
        given = chance.standard_normal((3, window)) * SCALE.sd[:, None] * size + SCALE.mean[:, None]
        with torch.no_grad():
            expected = network(torch.tensor(SCALE.down(given)[None], dtype=torch.float32)).double().numpy()[0]
        expected[0] = expected[0] * SCALE.sd[0] + SCALE.mean[0]
        expected[1:] += np.log(SCALE.sd[0])
        assert np.allclose(model.run(given.reshape(-1)), expected, atol=1e-5)


def test_a_layer_without_a_step_is_refused():
    with pytest.raises(TextureDataError, match="no step for a layer of kind GRU"):
        list(pieces(torch.nn.GRU(2, 2), "inner."))


@pytest.mark.parametrize(
    "method", [FOTEN, FOTEN_THESIS, TEN, TEN_MFCC, TEN_WAVELET, FOTEN_GENERATIVE], ids=lambda method: method.name
)
def test_every_method_learns_and_answers_in_units(method):
    given = learning(0.4, batch=128)
    fitted = method.fit(given)
    assert isinstance(fitted, FittedWindows)
    assert fitted.window == method.window
    whole = windows(given.recording, given.parts.validation, fitted.window)
    assert fitted.predict(whole.given).shape == whole.target.shape
    assert fitted.exported().steps


def test_a_few_epochs_predict_better_than_zero():
    given = learning(1.6, window=10, epochs=3, batch=32)
    fitted = FOTEN_GENERATIVE.fit(given)
    whole = windows(given.recording, given.parts.test, 10)
    error = np.abs(fitted.predict(whole.given) - whole.target).mean()
    assert error < 0.7 * np.abs(whole.target).mean()


def test_the_same_seed_gives_the_same_bits_and_another_another():
    one, same, other = (
        FOTEN_GENERATIVE.fit(learning(0.4, window=10, seed=seed)).exported().tensors for seed in (1, 1, 2)
    )
    assert all(np.array_equal(one[name], same[name]) for name in one)
    assert not np.array_equal(one["network.head.0.weight"], other["network.head.0.weight"])


def test_a_short_recording_is_gone_through_more_often():
    long, short, tiny = (learning(seconds) for seconds in (20.0, 4.0, 0.5))
    assert epochs_for(long) == 14
    assert epochs_for(short) * 22 == pytest.approx(1550, rel=0.02)
    assert epochs_for(tiny) == 120


@pytest.mark.parametrize("loss", sorted(LOSSES))
def test_window_and_loss_are_settings(loss):
    fitted = FOTEN.fit(learning(0.4, window=10, loss=loss, batch=256))
    assert fitted.window == 10


def test_an_unknown_loss_is_refused_by_name():
    with pytest.raises(TextureDataError, match=r"no loss 'hubber'.*huber-1\.6"):
        FOTEN.fit(learning(1.2, loss="hubber"))


def test_a_silent_recording_is_refused():
    whole = recording(1.2)
    silent = Recording("silent", "silent", whole.signals * np.array([[0.0], [1.0], [1.0]]))
    with pytest.raises(TextureDataError, match="does not vary"):
        FOTEN.fit(Learning(silent, parts(silent), settings={"quick": True}))


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_windows_that_no_answer_belongs_to_are_refused(bad):
    fitted = FittedWindows(seeded(lambda: Foten(10), 1), SCALE, 10, None)
    given = np.zeros((2, 3, 10))
    given[1, 0, 4] = bad
    with pytest.raises(TextureDataError, match="not finite"):
        fitted.predict(given)
    with pytest.raises(TextureDataError, match=r"\(n, 3, 10\) is expected"):
        fitted.predict(np.zeros((2, 3, 9)))


def test_a_spike_in_the_past_gives_a_bounded_answer():
    fitted = FittedWindows(seeded(lambda: generative(20), 1), SCALE, 20, None)
    given = np.zeros((1, 3, 20))
    given[0, 0, 7] = 1e6
    assert abs(fitted.predict(given)[0]) < 10 * SCALE.sd[0]


def test_the_likelihood_is_that_of_the_normal_distribution():
    answer, target = torch.tensor([[0.3, -1.0], [2.0, 0.5]]), torch.tensor([[0.1], [2.5]])
    expected = -torch.distributions.Normal(answer[:, :1], answer[:, 1:].exp()).log_prob(target).mean()
    assert nll(answer, target).item() == pytest.approx(expected.item() - 0.5 * np.log(2 * np.pi), abs=1e-6)


def test_a_generative_head_has_a_least_sd_and_a_gradient_there():
    network = seeded(lambda: generative(20), 1)
    with torch.no_grad():
        network.head[4].bias[1] = -30.0
    assert network(torch.zeros(1, 3, 20))[0, 1].item() == pytest.approx(LEAST_LOG_SD, abs=1e-3)
    assert seeded(lambda: generative(20), 1)(torch.zeros(1, 3, 20))[0, 1].item() == pytest.approx(0.0, abs=0.3)
