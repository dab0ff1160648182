import numpy as np
import pytest
from safetensors.numpy import load_file

from palpate.modeling.files.model_files import Exported, ModelWritingError, write_model
from palpate.signals.models.card import Card, Dense, Port
from tools.half_precision import NOTE, halve


def written(folder, weight):
    tensors = {"w": np.asarray(weight), "b": np.zeros(1)}
    port = Port(kind="ratings", size=2, unit="1")
    exported = Exported((Dense(weight="w", bias="b"),), tensors)
    return write_model(
        folder, "m", exported, title="M", method="x", takes=port, gives=port.model_copy(update={"size": 1})
    )


def test_single_precision_is_halved_and_double_stays(tmp_path):
    card = halve(written(tmp_path, np.array([[0.1, 2.0]], dtype=np.float32)), tmp_path / "to")
    tensors = load_file(card.with_suffix(".safetensors"))
    assert tensors["w"].dtype == np.float16 and tensors["b"].dtype == np.float64
    assert np.allclose(tensors["w"], [[0.1, 2.0]], rtol=1e-3)
    assert Card.model_validate_json(card.read_bytes()).notes == (NOTE,)


def test_a_number_beyond_half_precision_is_refused(tmp_path):
    card = written(tmp_path, np.array([[1e9, 2.0]], dtype=np.float32))
    with np.errstate(over="ignore"), pytest.raises(ModelWritingError):
        halve(card, tmp_path / "to")
