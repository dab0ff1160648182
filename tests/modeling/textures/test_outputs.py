import re

import numpy as np
import pytest

from palpate.modeling.textures import outputs
from palpate.modeling.textures.outputs import model_name, texture_of, write_texture
from palpate.modeling.textures.recording import Parts, TextureDataError
from palpate.signals.models.file import read_model
from palpate.signals.textures.voice import open_voice
from tests.modeling.textures import small_evaluation as small
from tests.modeling.textures.recording_for_tests import parts, recording


@pytest.fixture(scope="module")
def whole():
    return recording(6.0, 1, "smooth")


def fitted(whole, method):
    from palpate.modeling.textures.methods import Learning

    return method.fit(Learning(whole, parts(whole)))


def test_the_file_plays_and_holds_what_a_touch_begins_with(whole, tmp_path):
    model = fitted(whole, small.SAMPLED)
    card = write_texture(tmp_path, whole, parts(whole), model, small.SAMPLED, with_start=True, metrics={"mae": 1.0})
    read = read_model(card)
    start = read.tensors[read.card.texture.start]
    assert card.name == "texture-smooth-foten_generative.json"
    assert start.shape == (model.window,)
    assert np.abs(start).max() > 0.1 * read.card.texture.rms_m_s2
    assert open_voice(read, seed=0).card.metrics == {"mae": 1.0}
    alone = write_texture(tmp_path, whole, parts(whole), model, small.SAMPLED)
    assert read_model(alone).card.texture.start is None


def test_the_start_is_the_models_own_at_45_mm_s_and_0_8_N_and_the_same_each_time(whole, tmp_path, monkeypatch):
    runs = []

    def play(_card, speed_mm_s, force_N, _seed):
        runs.append((set(speed_mm_s), set(force_N), len(speed_mm_s)))
        return np.arange(float(len(speed_mm_s)))

    monkeypatch.setattr(outputs, "play", play)
    model = fitted(whole, small.PLAIN)
    card = write_texture(tmp_path, whole, parts(whole), model, small.PLAIN, with_start=True)
    assert runs == [({45.0}, {0.8}, 1000 + model.window)]
    read = read_model(card)
    np.testing.assert_array_equal(read.tensors[read.card.texture.start], np.arange(1000.0, 1000.0 + model.window))


def test_one_number_or_two_as_the_method_gives(whole, tmp_path):
    for method, size in ((small.PLAIN, 1), (small.SAMPLED, 2)):
        card = read_model(write_texture(tmp_path, whole, parts(whole), fitted(whole, method), method)).card
        assert (card.takes.size, card.gives.size) == (3 * small.ORDER, size)


def test_the_cards_texture_is_that_of_the_training_part_alone(whole):
    train = Parts(((0, 3000),), ((3000, 5000),), ((5000, 6000),))
    texture = texture_of(whole, train, fitted(whole, small.PLAIN), small.PLAIN)
    acceleration, speed, force = whole.signals[:, :3000]
    assert texture.rms_m_s2 == pytest.approx(np.sqrt(np.mean(acceleration**2)))
    assert texture.peak_m_s2 == pytest.approx(1.25 * np.abs(acceleration).max())
    assert texture.speed_mm_s == (pytest.approx(speed.min()), pytest.approx(speed.max()))
    assert texture.force_N == (pytest.approx(force.min()), pytest.approx(force.max()))
    with pytest.raises(TextureDataError, match="empty"):
        texture_of(whole, Parts((), (), ()), fitted(whole, small.PLAIN), small.PLAIN)


def test_a_name_that_no_file_may_have_becomes_one_that_it_may():
    assert re.fullmatch("texture-rough-wet-wood-[0-9a-f]{6}-ar", model_name("rough / wet wood", "ar"))
    assert model_name("steel_mesh", "ar") == "texture-steel_mesh-ar"


def test_textures_have_names_of_their_own_however_long_or_strange():
    textures = ["Ünter", "Änter", "-nter", "x" * 200, "x" * 201, "x" * 50, "素材", "材料"]
    names = {model_name(texture, "foten_generative") for texture in textures}
    assert len(names) == len(textures)
    assert all(len(name) <= 64 and name.endswith("-foten_generative") for name in names)
