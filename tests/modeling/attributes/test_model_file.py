import hashlib
import json
import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.model_file import FORMAT, NAME, ModelFileError, read_model, write_model
from palpate.protocols.canonical import digest
from tests.modeling.attributes import small_evaluation as small
from tests.modeling.attributes.material_for_tests import PAIRS, simulated_material
from tests.modeling.files.lost_power import only_numbers_are_placed

T01 = simulated_material(1).textures[0]
FITTED = small.Linear(np.ones((526, 4)), np.arange(4.0), ("mfcc", "hand"), ())
CARD = {
    "name": NAME, "title": "A test", "method": "ridge", "touch": ("mfcc", "hand"), "metrics": {"mae": 5.0},
    "attributes": tuple((pair.low, pair.high) for pair in PAIRS), "learned": ("T01",),
    "interval": {"method": "of a test", "coverage": 0.9, "half_width": (1.0, 2.0, 3.0, 4.0)},
}  # fmt: skip


@pytest.fixture
def path(tmp_path):
    return write_model(tmp_path, FITTED, CARD, small.METHODS)


def edited(path, sign=True, **more):
    """The card with other words, signed or not."""
    content = {**json.loads(path.read_text()), **more}
    content.pop("digest")
    path.write_text(json.dumps({**content, "digest": digest(content) if sign else "0" * 64}))


def test_a_model_reads_back_and_answers_bit_for_bit(path):
    model = read_model(path, small.METHODS)
    assert (path.name, model.card.tensors.file) == (f"{NAME}.json", f"{NAME}.safetensors")
    np.testing.assert_array_equal(model.predict(T01), FITTED.predict(T01))
    assert model.attributes == PAIRS
    assert model.half_width.tolist() == [1, 2, 3, 4]
    assert (model.card.learned, model.card.metrics) == (("T01",), {"mae": 5.0})
    assert read_model(path.parent, small.METHODS).card == model.card
    with pytest.raises(MaterialError, match="no mfcc"):
        model.predict(small.changed(simulated_material(1), "T01", touch={}).textures[0])


def test_it_is_replaced_as_a_whole_and_leaves_nothing_behind(path):
    other = small.Linear(np.zeros((526, 4)), np.full(4, 50.0), ("mfcc", "hand"), ())
    write_model(path.parent, other, CARD, small.METHODS)
    assert read_model(path, small.METHODS).predict(T01).tolist() == [[50.0] * 4]
    assert sorted(file.name for file in path.parent.iterdir()) == [f"{NAME}.json", f"{NAME}.safetensors"]


def test_power_lost_between_the_two_renames_leaves_the_earlier_model(path, monkeypatch):
    before = read_model(path, small.METHODS).predict(T01)
    other = small.Linear(np.zeros((526, 4)), np.full(4, 50.0), ("mfcc", "hand"), ())
    with monkeypatch.context() as lost:
        only_numbers_are_placed(lost)
        with pytest.raises(KeyboardInterrupt):
            write_model(path.parent, other, CARD, small.METHODS)
    np.testing.assert_array_equal(read_model(path, small.METHODS).predict(T01), before)
    write_model(path.parent, other, CARD, small.METHODS)
    assert read_model(path, small.METHODS).predict(T01).tolist() == [[50.0] * 4]
    assert len(list(path.parent.iterdir())) == 2


def cut_short(path):
    path.write_bytes(path.read_bytes()[:200])


def another_bit(path):
    file = path.with_suffix(".safetensors")
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda path: path.unlink(), "there is no model of attributes"),
        (cut_short, "cut short or damaged"),
        (lambda path: path.write_text("[1]"), "not a model of attributes"),
        (lambda path: path.write_text('{"format": "palpate-model/1"}'), "'palpate-attributes/1' is expected"),
        (lambda path: edited(path, format="palpate-attributes/2"), "a later version wrote it"),
        (lambda path: edited(path, sign=False), "edited or damaged"),
        (lambda path: edited(path, surprise=1), "surprise"),
        (lambda path: edited(path, method="os.system"), "'os.system' is not known here"),
        (lambda path: edited(path, told={}), "ridge cannot be made from it"),
        (lambda path: path.with_suffix(".safetensors").unlink(), "are not there"),
        (another_bit, "damaged"),
    ],
)
def test_what_is_damaged_newer_or_foreign_is_refused(path, harm, words):
    harm(path)
    with pytest.raises(ModelFileError, match=words):
        read_model(path, small.METHODS)


def test_numbers_elsewhere_are_not_read(path):
    tensors = json.loads(path.read_text())["tensors"]
    edited(path, tensors={**tensors, "file": f"../{NAME}.safetensors"})
    with pytest.raises(ModelFileError, match="bare file name"):
        read_model(path, small.METHODS)


def test_a_pickle_in_place_of_the_numbers_is_not_opened(path):
    file, content = path.with_suffix(".safetensors"), pickle.dumps({"weights": 1})
    file.write_bytes(content)
    tensors = json.loads(path.read_text())["tensors"]
    edited(path, tensors={**tensors, "sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)})
    with pytest.raises(ModelFileError, match="not tensors"):
        read_model(path, small.METHODS)


@dataclass(frozen=True)
class Odd:
    """A model that cannot be stored."""

    arrays: dict
    metadata: dict

    def predict(self, _texture):
        return np.zeros((1, 4))

    def saved(self):
        return self.arrays, self.metadata


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        (Odd({"weights": np.array([np.nan])}, {}), "not finite"),
        (Odd({"weights": np.ones(1)}, {"x": float("inf")}), "finite"),
        (Odd({"weights": np.ones(1)}, {"x": object()}), "object"),
        (Odd({}, {}), "cannot be made from it"),
    ],
)
def test_what_does_not_come_back_from_a_file_is_not_written(tmp_path, odd, words):
    with pytest.raises(ModelFileError, match=words):
        write_model(tmp_path / "models", odd, CARD, small.METHODS)
    assert not (tmp_path / "models").exists()


def test_the_format_is_in_the_card(path):
    assert json.loads(path.read_text())["format"] == FORMAT
