"""The bench's other runtimes answer what the rig's own runtime answers, from the same card."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch
from safetensors.numpy import save_file

from benchmarks.synthesis import specimens
from benchmarks.synthesis.runtimes import MAKERS, other_runtimes, read_plainly
from palpate.modeling.textures.recording import TextureDataError

pytestmark = pytest.mark.needs("torch")


def test_each_runtime_that_is_installed_answers_as_numpy_does():
    threads = torch.get_num_threads()
    try:
        model, given = specimens.foten(), specimens.windows(3)
        runtimes, missing = other_runtimes(model.card, model.tensors)
    finally:
        torch.set_num_threads(threads)
    assert set(runtimes) | set(missing) == set(MAKERS)
    assert {"PyTorch eager, own layers", "PyTorch eager, stock layers"} <= set(runtimes)
    for name, step in runtimes.items():
        answers = np.array([step(row) for row in given])
        assert np.abs(answers - model.run(given)).max() <= 1e-6 * specimens.SPREAD[0], name


def test_a_card_with_other_steps_is_refused_by_name():
    model = specimens.foten()
    card = json.loads(model.card.model_dump_json())
    card["steps"].insert(0, {"do": "clip", "low": -1.0, "high": 1.0})
    with pytest.raises(TextureDataError, match="'clip'"):
        MAKERS["PyTorch eager, own layers"](type(model.card).model_validate_json(json.dumps(card)), model.tensors)


def test_a_cards_numbers_are_read_in_single_precision(tmp_path):
    model = specimens.foten()
    save_file(
        {name: tensor.astype(np.float16) for name, tensor in model.tensors.items()}, tmp_path / "specimen.safetensors"
    )
    (tmp_path / "x.json").write_text(model.card.model_dump_json())
    card, tensors = read_plainly(tmp_path / "x.json")
    assert card == model.card
    assert {tensor.dtype for tensor in tensors.values()} == {np.dtype(np.float32)}
