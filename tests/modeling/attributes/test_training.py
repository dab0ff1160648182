import json
from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.model_file import ModelFileError, read_model
from palpate.modeling.attributes.training import train_attributes
from palpate.modeling.training.history import Epoch
from tests.modeling.attributes import small_evaluation as small
from tests.modeling.attributes.material_for_tests import PAIRS


def trained(lab, method="ridge", material=None, methods=small.METHODS, **more):
    options = small.options(lab / "work", **more)
    return train_attributes(material or small.material(), method, options, lab / "models", methods, small.OWN)


def test_the_model_is_fitted_to_all_textures_and_its_card_tells_of_those_left_out(tmp_path):
    written = trained(tmp_path)
    model = read_model(written.card, small.METHODS)
    evaluation = small.evaluation(tmp_path / "work")
    off = np.abs(evaluation.predicted(evaluation.main("ridge")) - evaluation.rated())
    assert model.card.metrics["mae"] == written.metrics["mae"] == pytest.approx(off.mean())
    assert model.half_width.tolist() == pytest.approx(off.max(axis=0).tolist())  # 12 textures: the greatest
    assert written.half_width == tuple(model.half_width)
    assert model.card.learned == small.material().ids
    assert (model.card.simulated, model.card.touch, model.card.sight) == (True, ("mfcc", "hand"), ("glcm",))
    assert model.card.training["data"]["textures"] == evaluation.domain.digest
    assert model.card.training["configuration"]["seed"] == 0
    assert model.card.notes[0] == "Fitted to 12 textures; the metrics are those of leaving one out."
    assert model.card.training["configuration"]["watched"] == []
    assert "nothing about how a texture feels" in model.card.notes[1]
    whole = small.fit_linear(Learning(evaluation.material.textures, (), PAIRS, ("mfcc", "hand"), ("glcm",)))
    texture = evaluation.material.textures[3]
    np.testing.assert_allclose(model.predict(texture), whole.predict(texture))
    assert json.dumps(written.plain())


def test_the_card_says_that_its_numbers_rest_on_random_weights_of_resnet(tmp_path):
    material = replace(small.material(), weights="random (He normal, seed 0): no file was given")
    written = trained(tmp_path, "visuo_tactile", material)
    card = read_model(written.card, small.METHODS).card
    assert "random ResNet-50" in card.title and any("random weights: the metrics" in note for note in card.notes)
    assert written.plain()["resnet"] == "random" and trained(tmp_path, "ridge", material).resnet is None


def test_what_an_evaluation_finished_is_not_done_again(tmp_path):
    small.evaluation(tmp_path / "work")
    fits = []

    def counted(learning):
        fits.append(len(learning.train))
        return small.fit_linear(learning)

    counted.__module__ = small.__name__
    trained(tmp_path, methods={**small.METHODS, "ridge": Method("ridge", "Ridge", counted, restore=small.restored)})
    assert fits == [12]


def test_a_network_watches_a_share_of_the_textures_and_leaves_its_learning_curve(tmp_path):
    counts = []

    class Network(small.Linear):
        trained = type("Trained", (), {"seconds": 1.0, "history": (Epoch(1, 0.5, 1e-3, 2.0, 3.0),)})

    def fit(learning):
        counts.append((len(learning.train), len(learning.held)))
        linear = small.fit_linear(learning)
        return Network(linear.weights, linear.mean, linear.touch, linear.sight)

    fit.__module__ = small.__name__
    methods = {"ridge": Method("ridge", "Ridge", fit, holds_out=True, restore=small.restored)}
    written = trained(tmp_path, methods=methods)
    assert counts[-1] == (11, 1)
    card = json.loads(written.card.read_text())
    assert card["notes"][0].startswith("Fitted to 11 textures, 1 more are watched to stop early; the metrics are")
    (watched,) = card["training"]["configuration"]["watched"]
    assert watched in card["learned"] and len(card["learned"]) == 12
    assert {path.name for path in written.files} == {
        "texture-attributes.json", "texture-attributes.safetensors", "texture-attributes.history.csv",
        "texture-attributes.history.svg", "texture-attributes.history.png",
    }  # fmt: skip
    trained(tmp_path)
    assert not list((tmp_path / "models").glob("*history*"))


def test_too_few_textures_give_no_interval(tmp_path):
    written = trained(tmp_path, quick=True)
    assert written.half_width == ()
    card = read_model(written.card, small.METHODS).card
    assert card.interval is None
    assert any("quick" in note for note in card.notes)


def test_what_refuses_or_cannot_be_kept_is_reported(tmp_path):
    with pytest.raises(MaterialError, match="has had enough"):
        trained(tmp_path, methods={"ridge": Method("ridge", "Refusing", small.fit_refusing)})
    with pytest.raises(ModelFileError, match="cannot be saved"):
        trained(tmp_path, methods={"ridge": Method("ridge", "Not kept", small.fit_linear)})
    assert not (tmp_path / "models" / "texture-attributes.json").exists()
