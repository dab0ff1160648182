"""`palpate models` for models of textures: listed, described, and compared on windows of the texture."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from palpate.devices.models import lookup
from palpate.devices.models.commands import models, predict
from palpate.signals.models.card import Affine, Dense, Port, Reshape, Texture
from palpate.signals.models.card_steps import Attention, Autoregression, Join, Keep, Lstm, Norm, Part, Recall, Turn
from tests.devices.models.commands_for_tests import run, text
from tests.signals.models.cards import feeling, saved
from tests.signals.models.make_hatt import FILE

NEXT = Port(kind="acceleration", size=2, unit="m/s^2")


def texture(window, **others):
    texture_entry = {
        "id": "cloth",
        "label": "Cloth",
        "speed_mm_s": (10.0, 150.0),
        "force_N": (0.2, 2.0),
        "rms_m_s2": 1.5,
    }
    return Texture(**{**texture_entry, "peak_m_s2": 9.0, "window": window, **others})


def window_port(window):
    return Port(kind="texture_window", size=3 * window, unit="m/s^2, mm/s, N")


def autoregressive(folder, name="texture-cloth-ar", pull=0.9, window=4, **others):
    """The next acceleration is `pull` times the last one, at any speed and force, with an SD of 1 m/s^2."""
    step = Autoregression(points="p", frequencies="f", log_sd="s", triangles="t")
    frequency = np.arccos((1 + 1) / 2 - (1 - pull)) if pull else np.pi / 2
    tensors = {
        "p": np.zeros((1, 2)), "f": np.array([[frequency]]), "s": np.zeros(1), "t": np.zeros((1, 3), dtype=int),
        "start": np.zeros(window),
    }  # fmt: skip
    steps = (Reshape(shape=(3, window)), step)
    others = {"texture": texture(window, start="start", **others)}
    return saved(folder, steps, tensors, window_port(window), NEXT, name, **others)


def plain(folder, name="texture-cloth-fnn", weight=0.5, window=7):
    tensors = {"w": np.zeros((1, 3 * window)), "b": np.zeros(1)}
    tensors["w"][0, window - 1] = weight
    gives = NEXT.model_copy(update={"size": 1})
    steps = (Dense(weight="w", bias="b"),)
    return saved(folder, steps, tensors, window_port(window), gives, name, texture=texture(window))


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.setattr(lookup, "SHIPPED", tmp_path / "shipped")
    monkeypatch.setattr(lookup, "TEXTURES", tmp_path / "textures")
    monkeypatch.chdir(tmp_path)
    autoregressive(tmp_path / "textures")
    plain(tmp_path / "models")
    return tmp_path


def test_models_of_textures_are_listed_with_the_others(lab):
    feeling(lab / "models")
    printed = text(run(models, "list"))
    assert "texture-cloth-fnn lab by hand texture's last samples -> the next acceleration" in printed
    assert "texture-cloth-ar shipped by hand" in printed
    assert "feeling lab by hand force profile -> ratings" in printed


def test_a_textures_card_is_described_in_words(lab):
    printed = text(run(models, "card", "texture-cloth-ar"))
    for words in (
        "takes a texture's last samples: 12 numbers, m/s^2, mm/s, N", "gives the next acceleration: 2 numbers, m/s^2",
        "texture Cloth (cloth): 1000 Hz, 4 samples looked back at",
        "from recordings at 10 to 150 mm/s and 0.2 to 2 N", "1.5 m/s^2 RMS; nothing beyond 9 m/s^2 is played",
        "begins with 4 samples of its own at 45 mm/s and 0.8 N",
        "2. autoregression of order 1 between 1 points over speed and force, 1 triangles",
    ):  # fmt: skip
        assert words in printed


def test_every_kind_of_step_has_words(lab):
    ones = {name: np.ones(shape) / 9 for name, shape in {
        "n": 3, "b": 3, "w": (9, 3), "wb": 9, "o": (3, 3), "ob": 3, "l": (8, 3), "s": (8, 2), "lb": 8, "d": (1, 6),
        "db": 1}.items()}  # fmt: skip
    steps = (
        Reshape(shape=(3, 3)), Keep(kept="x"), Norm(weight="n", bias="b"),
        Attention(heads=1, weight="w", bias="wb", out="o", out_bias="ob", memory="x", causal=True, sparse=2),
        Lstm(weight="l", state="s", bias="lb", reverse=True), Turn(), Turn(), Recall(kept="x"), Join(kept=("x",)),
        Part(start=1, stop=3), Affine(gain=2.0), Dense(weight="d", bias="db"),
    )  # fmt: skip
    saved(lab / "models", steps, ones, window_port(3), NEXT.model_copy(update={"size": 1}), "all", texture=texture(3))
    printed = text(run(models, "card", "all"))
    for words in (
        "2. keep it as x", "3. layer normalisation of 3 numbers",
        "4. attention: 1 heads over 3 channels to x, none after itself, 2 places ask",
        "5. long short-term memory: 3 to 2, from the last place to the first", "6. channels and places change places",
        "8. go on with x", "9. join x below it", "10. channels 2 to 3",
    ):  # fmt: skip
        assert words in printed


def test_models_of_one_texture_are_compared_whatever_they_look_back(lab):
    comparison = json.loads(run(models, "compare", "texture-cloth-ar", "texture-cloth-fnn", "--json").stdout)
    assert comparison["inputs"] == 25
    assert comparison["apart"][0]["mean"] > 0
    assert comparison["metrics"]["texture-cloth-fnn"]["ms"] > 0
    autoregressive(lab / "models", "same", window=9)
    comparison = json.loads(run(models, "compare", "texture-cloth-ar", "same", "--json").stdout)
    assert comparison["apart"][0]["greatest"] == pytest.approx(0, abs=1e-12)
    printed = text(run(models, "compare", "same", "texture-cloth-fnn"))
    assert "answers to the same 25 windows, for the mean of the next acceleration, are apart by (m/s^2)" in printed
    assert "mm/s," in printed


def test_models_of_a_spectrum_are_compared_on_the_same_noise(lab):
    takes, gives = Port(kind="texture_drive", size=5, unit=""), Port(kind="spectrum", size=3, unit="log m/s^2")
    for name, bias in (("one", 0.0), ("two", 1.0)):
        tensors = {"w": np.ones((3, 5)), "b": np.full(3, bias)}
        saved(lab / "models", (Dense(weight="w", bias="b"),), tensors, takes, gives, name, texture=texture(5, hop=2))
    comparison = json.loads(run(models, "compare", "one", "two", "--json").stdout)
    assert (comparison["inputs"], comparison["apart"][0]["mean"]) == (25, pytest.approx(1))
    assert "2 samples between spectra" in text(run(models, "card", "one"))
    with pytest.raises(ValueError, match="one takes 5 numbers of texture_drive, texture-cloth-ar 12 .*texture_window"):
        run(models, "compare", "one", "texture-cloth-ar")
    tensors = {"w": np.ones((3, 5)), "b": np.zeros(3)}
    other = texture(5, hop=2, id="steel_mesh")
    saved(lab / "models", (Dense(weight="w", bias="b"),), tensors, takes, gives, "two", texture=other)
    with pytest.raises(ValueError, match="one makes cloth, two does not"):
        run(models, "compare", "one", "two")


def test_models_of_other_textures_are_not_compared(lab):
    autoregressive(lab / "models", "other", id="steel_mesh")
    with pytest.raises(ValueError, match="texture-cloth-ar makes cloth, other does not"):
        run(models, "compare", "texture-cloth-ar", "other")
    feeling(lab / "models")
    with pytest.raises(ValueError, match="texture-cloth-ar makes cloth, feeling does not"):
        run(models, "compare", "texture-cloth-ar", "feeling")
    result = run(models, "compare", "texture-cloth-ar", "texture-cloth-fnn", "--on", lab / "models" / "feeling.json")
    assert result.exit_code == 2
    assert "these make a texture" in result.stderr


def test_a_window_that_the_card_contradicts_is_not_compared(lab):
    tensors = {"w": np.zeros((1, 8)), "b": np.zeros(1)}
    port, gives = Port(kind="texture_window", size=8, unit=""), NEXT.model_copy(update={"size": 1})
    saved(lab / "models", (Dense(weight="w", bias="b"),), tensors, port, gives, "odd", texture=texture(4))
    with pytest.raises(ValueError, match="odd: it takes 8 numbers, and its window is 4 samples"):
        run(models, "compare", "texture-cloth-ar", "odd")


def test_a_range_whose_ends_are_turned_is_refused():
    with pytest.raises(ValueError, match="force_N goes from 2 to 1; the least comes first"):
        texture(4, force_N=(2.0, 1.0))


def test_a_texture_is_not_predicted_but_rendered(lab):
    result = run(predict, "texture-cloth-ar", "x.csv")
    assert result.exit_code == 2
    assert "palpate render cloth plays it" in re.sub(r"\s+", " ", result.stderr)


def test_a_texture_of_the_toolkit_has_a_card_too(lab):
    printed = text(run(models, "card", FILE))
    assert "hatt-small_sample: Small Sample (HaTT)" in printed
    assert "Models_Small.xml, 5.1 kB, intact" in printed
    comparison = json.loads(run(models, "compare", FILE, FILE, "--json").stdout)
    assert comparison["apart"][0]["greatest"] == 0
