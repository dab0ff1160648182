"""The GAN's spectrograms, its file, and what the renderer makes of it."""

import numpy as np
import pytest
import torch

from palpate.modeling.textures.gan import GAN, NOISE, Critic, Frames, Generator, magnitudes, spectra, watched
from palpate.modeling.textures.methods import Learning
from palpate.modeling.textures.outputs import write_texture
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.training.adversarial import energy_distance
from palpate.modeling.training.seeding import seeded
from palpate.signals.models.file import read_model
from palpate.signals.textures import block_voice
from palpate.signals.textures.voice import play
from tests.modeling.textures.recording_for_tests import parts, recording

pytestmark = pytest.mark.needs("torch")


def learning(whole=None, seed=0, **settings):
    whole = whole or recording(4.0)
    return Learning(whole, parts(whole), None, seed=seed, settings={"epochs": 1, "threads": 1, "batch": 64} | settings)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """(what was learned from, the fitted GAN, its card's path)."""
    given = learning(recording(3.5), epochs=8, batch=32, learning_rate=1e-3)
    gan = GAN.fit(given)
    return given, gan, write_texture(tmp_path_factory.mktemp("gan"), given.recording, given.parts, gan, GAN)


@pytest.mark.parametrize("size", [8, 10, 56, 64, 128])
def test_generator_and_critic_fit_frames_of_any_even_size(size):
    frames = Frames(size, size // 2, 3)
    hand, noise = torch.zeros(2, 2), torch.zeros(2, NOISE)
    spectrum = Generator(frames)(hand, noise)
    assert spectrum.shape == (2, 3, size // 2 + 1)
    assert Critic(frames)(hand, spectrum).shape == (2, 1)


@pytest.mark.parametrize("given", [(55, 14, 4), (6, 1, 4), (56, 29, 4), (56, 0, 4), (56, 14, 0)])
def test_frames_that_cannot_be_played_are_refused(given):
    with pytest.raises(TextureDataError, match="an even size"):
        Frames(*given)


def test_magnitudes_hold_the_level_of_a_signal():
    """By Parseval: the mean square of the analysed signal, 3/8 of which passes the window."""
    frames = Frames(56, 14, 4)
    noise = 2.5 * np.random.Generator(np.random.PCG64(1)).standard_normal((4000, frames.span))
    power = magnitudes(noise, frames) ** 2
    assert power.shape == (4000, 4, 29)
    both_sides = np.r_[1, np.full(27, 2), 1]
    assert (power.mean(axis=(0, 1)) @ both_sides) / 56**2 == pytest.approx(0.375 * 2.5**2, rel=0.02)


def test_blocks_stay_within_their_stretches_and_begin_with_their_own_hand():
    whole = recording(1.0)
    frames = Frames(56, 14, 4)
    frames_of_signal = spectra(whole, ((0, 98), (100, 197), (300, 500)), frames, 50, 1e-6)
    assert len(frames_of_signal.drive) == 1 + 0 + 3
    assert frames_of_signal.drive.tolist() == whole.signals[1:, [0, 300, 350, 400]].T.tolist()
    expected = np.log(magnitudes(whole.signals[0][None, 350:448], frames))[0]
    assert np.allclose(frames_of_signal.log_magnitude[2], expected)
    assert len(spectra(whole, ((0, 97),), frames, 1, 1e-6).drive) == 0


def test_the_file_answers_as_the_network_does_in_the_renderers_layout(fitted):
    _given, gan, path = fitted
    model = read_model(path)
    assert block_voice.shape(model.card, model.card.texture) == (56, 14, 29, 4)
    assert model.card.takes.size == 2 + NOISE
    chance = np.random.Generator(np.random.PCG64(1))
    drive = np.c_[chance.uniform(20, 140, 30), chance.uniform(0.4, 1.6, 30), chance.standard_normal((30, NOISE))]
    hand = gan.scale.hand_down(drive[:, :2])
    with torch.no_grad():
        spectrum = gan.network(*(torch.tensor(array, dtype=torch.float32) for array in (hand, drive[:, 2:])))
    expected = gan.scale.up(spectrum.double().numpy()).transpose(0, 2, 1)  # (bins, frames)
    assert np.allclose(model.run(drive).reshape(30, 29, 4), expected, atol=1e-5)
    assert sum(tensor.size for tensor in model.tensors.values()) * 2 < 1e6  # in float16


def test_what_is_played_has_the_level_and_the_spectrum_of_the_texture(fitted):
    given, _gan, path = fitted
    speed, force = np.tile(given.recording.signals[1:], 3)
    signal = play(path, speed, force, seed=1)
    level = signal[200:].std() / given.recording.signals[0].std()
    assert 0.75 < level < 1.3
    truth, other = (
        np.abs(np.fft.rfft(signal_compared)) ** 2 for signal_compared in (given.recording.signals[0], signal[:3500])
    )
    centroid = [float(np.arange(len(power)) @ power / power.sum()) for power in (truth, other)]
    assert centroid[1] == pytest.approx(centroid[0], rel=0.25)
    assert np.array_equal(signal, play(path, speed, force, seed=1))


def test_it_learns(fitted):
    given, gan, _path = fitted
    rows = watched(spectra(given.recording, given.parts.validation, gan.cut, 14, 1e-3), gan.scale, 0)
    fresh = seeded(lambda: Generator(gan.cut), 5)
    with torch.no_grad():
        before = float(energy_distance(fresh(*rows.inputs), rows.targets))
    assert gan.trained.best_loss < 0.7 * before


def test_the_same_seed_gives_the_same_bits_and_another_another():
    one, same, other = (GAN.fit(learning(recording(1.2), seed)).exported().tensors for seed in (1, 1, 2))
    assert all(np.array_equal(one[name], same[name]) for name in one)
    assert not np.array_equal(one["first.weight"], other["first.weight"])


def test_every_epoch_is_watched_with_the_same_noise(fitted):
    given, gan, _path = fitted
    rows = spectra(given.recording, given.parts.validation, gan.cut, 14, 1e-3)
    one, same = (watched(rows, gan.scale, 3).inputs[1] for _ in range(2))
    assert torch.equal(one, same)


def test_it_does_not_continue_windows(fitted):
    with pytest.raises(TextureDataError, match="does not continue windows"):
        fitted[1].predict(np.zeros((1, 3, 56)))


def test_silence_is_refused_and_a_recording_too_short_for_blocks():
    whole = recording(1.2)
    silent = Recording("silent", "silent", whole.signals * np.array([[0.0], [1.0], [1.0]]))
    with pytest.raises(TextureDataError, match="does not vary"):
        GAN.fit(learning(silent))
    with pytest.raises(TextureDataError, match="0 blocks of 98 samples.*record longer"):
        GAN.fit(learning(recording(0.9)))


def test_a_hand_that_never_varies_and_a_spike_give_a_model_that_answers(tmp_path):
    whole = recording(2.0)
    signals = np.stack([whole.signals[0], np.full(2000, 60.0), np.full(2000, 0.9)])
    signals[0, 700] = 1e6
    still = Recording("still", "still", signals)
    given = learning(still)
    card = write_texture(tmp_path, still, given.parts, GAN.fit(given), GAN)
    assert np.isfinite(play(card, signals[1], signals[2], seed=1)).all()
