"""What is written reads back bit for bit, what cannot be is refused, and a cut-off writing leaves a whole model."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest
from safetensors.numpy import load_file

from palpate.modeling.files import model_files
from palpate.modeling.files.model_files import Exported, ModelWritingError, write_model
from palpate.protocols import files
from palpate.signals.models.card import Affine, Dense, Interval, Port, Residual
from palpate.signals.models.file import ModelFileError, read_model
from tests.modeling.files.lost_power import only_numbers_are_placed

PORT = Port(kind="ratings", size=2, unit="0..100", names=("a", "b"))
RANDOM = np.random.Generator(np.random.PCG64(3))
WEIGHT, BIAS = RANDOM.normal(size=(2, 2)), RANDOM.normal(size=2)


def write(folder, weight=WEIGHT, bias=BIAS, name="m", **others):
    exported = Exported((Dense(weight="w", bias="b"),), {"w": weight, "b": bias})
    others = {"title": "A model", "method": "ridge", "takes": PORT, "gives": PORT, **others}
    return write_model(folder, name, exported, **others)


def test_a_model_reads_back_as_it_was_written(tmp_path):
    interval = Interval(method="split conformal", coverage=0.9, half_width=(1.0, 2.0))
    training = {"data": {"lab": "ab12"}, "seconds": 1.25, "folds": (1, 2), "torch": None}
    card = write(
        tmp_path / "new" / "models", interval=interval, metrics={"mae": 0.1 + 0.2}, training=training, notes=["one"]
    )
    assert card == tmp_path / "new" / "models" / "m.json"
    model = read_model(card)
    assert np.array_equal(model.tensors["w"], WEIGHT)
    assert (model.card.interval, model.card.metrics["mae"], model.card.notes) == (interval, 0.1 + 0.2, ("one",))
    assert model.card.training == {**training, "folds": [1, 2]}
    np.testing.assert_allclose(model.run(np.array([3.0, 4.0])), WEIGHT @ [3, 4] + BIAS, rtol=1e-15)
    assert sorted(path.name for path in card.parent.iterdir()) == ["m.json", "m.safetensors"]


def test_half_precision_takes_half_the_room_and_is_read_as_single(tmp_path):
    halves = WEIGHT.astype(np.float16), BIAS.astype(np.float16)
    card = write(tmp_path / "half", *halves)
    assert load_file(card.with_suffix(".safetensors"))["w"].dtype == np.float16
    model = read_model(card)
    assert model.tensors["w"].dtype == np.float32
    assert np.array_equal(model.tensors["w"], halves[0].astype(np.float32))
    with np.errstate(over="ignore"), pytest.raises(ModelWritingError, match="'w' holds values that are not finite"):
        write(tmp_path / "over", (WEIGHT * 1e6).astype(np.float16), halves[1])


def test_the_same_model_gives_the_same_bytes(tmp_path):
    first, second = write(tmp_path / "a"), write(tmp_path / "b")
    assert first.read_bytes() == second.read_bytes()
    assert first.with_suffix(".safetensors").read_bytes() == second.with_suffix(".safetensors").read_bytes()


@pytest.mark.parametrize(
    "weight",
    [WEIGHT.T, WEIGHT[::-1], np.asfortranarray(WEIGHT), np.repeat(WEIGHT, 2, axis=1)[:, ::2], WEIGHT.astype(">f8")],
)
def test_arrays_in_any_order_keep_their_numbers(tmp_path, weight):
    assert np.array_equal(read_model(write(tmp_path, weight)).tensors["w"], weight)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"weight": np.array([[1.0, np.nan], [0, 1]])}, "'w' holds values that are not finite"),
        ({"bias": np.array([np.inf, 0])}, "'b' holds values that are not finite"),
        ({"weight": WEIGHT.astype(complex)}, "'w' is complex128; float16, float32, float64"),
        ({"weight": np.array([["a", "b"], ["c", "d"]])}, "'w' is <U1"),
        ({"weight": np.array([[object(), 1], [2, 3]])}, "'w' is object"),
        ({"name": "../m"}, "cannot name a model"),
        ({"name": ""}, "cannot name a model"),
        ({"name": ".hidden"}, "cannot name a model"),
        ({"training": {"loss": float("nan")}}, "the run card cannot be saved"),
        ({"training": {"path": object()}}, "the run card cannot be saved"),
        ({"metrics": {"mae": float("nan")}}, r"metrics\.mae: Input should be a finite number"),
        ({"interval": Interval(method="x", coverage=0.9, half_width=(1.0,))}, "1 half widths for 2 numbers"),
    ],
)
def test_what_cannot_be_kept_is_refused_and_nothing_is_written(tmp_path, changes, words):
    with pytest.raises(ModelWritingError, match=words):
        write(tmp_path, **changes)
    assert list(tmp_path.iterdir()) == []


def test_arrays_that_no_step_uses_or_that_are_missing_are_named(tmp_path):
    steps = (Residual(steps=(Dense(weight="w", bias="b"),)), Affine(gain="g"))
    with pytest.raises(ModelWritingError, match=r"use 3 arrays and 3 are given; see 'g', 'x'"):
        exported = Exported(steps, {"w": WEIGHT, "b": BIAS, "x": BIAS})
        write_model(tmp_path, "m", exported, title="", method="", takes=PORT, gives=PORT)


def cut_off(monkeypatch, at):
    """Let writing a file fail from the one with this number on."""
    whole, done = model_files.write_bytes, []

    def write_bytes(path, *given):
        if len(done) == at:
            raise OSError(28, "No space left on device", str(path))
        done.append(path)
        whole(path, *given)

    monkeypatch.setattr(model_files, "write_bytes", write_bytes)


@pytest.mark.parametrize("at", range(4))
def test_a_replacement_that_cannot_be_written_leaves_the_earlier_model_and_nothing_else(tmp_path, monkeypatch, at):
    before = write(tmp_path, bias=np.zeros(2)).read_bytes()
    cut_off(monkeypatch, at)
    with pytest.raises(OSError, match="No space left"):
        write(tmp_path, bias=np.ones(2))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.json", "m.safetensors"]
    assert (tmp_path / "m.json").read_bytes() == before
    assert read_model(tmp_path / "m.json").tensors["b"].tolist() == [0.0, 0.0]


def test_a_new_model_whose_card_cannot_be_written_leaves_no_numbers(tmp_path, monkeypatch):
    cut_off(monkeypatch, 1)
    with pytest.raises(OSError, match="No space left"):
        write(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_power_lost_between_the_two_renames_leaves_the_earlier_model_which_is_replaced_again(tmp_path, monkeypatch):
    write(tmp_path, bias=np.zeros(2))
    with monkeypatch.context() as lost:
        only_numbers_are_placed(lost)
        with pytest.raises(KeyboardInterrupt):
            write(tmp_path, bias=np.ones(2))
    assert read_model(tmp_path / "m.json").tensors["b"].tolist() == [0.0, 0.0]
    assert load_file(tmp_path / "m.safetensors")["b"].tolist() == [1.0, 1.0]
    assert read_model(write(tmp_path, bias=np.full(2, 2.0))).tensors["b"].tolist() == [2.0, 2.0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.json", "m.safetensors"]


def test_a_card_whose_folder_cannot_be_synced_keeps_the_numbers_that_it_names(tmp_path, monkeypatch):
    write(tmp_path, bias=np.zeros(2))
    whole, placed = files.sync_folder, []

    def sync_folder(folder):
        placed.append(folder)
        if placed.count(tmp_path) == 2:  # the copy of the numbers is there, and the card has just been renamed
            raise OSError(5, "Input/output error", str(folder))
        whole(folder)

    monkeypatch.setattr(files, "sync_folder", sync_folder)
    with pytest.raises(OSError, match="Input/output"):
        write(tmp_path, bias=np.ones(2))
    assert read_model(tmp_path / "m.json").tensors["b"].tolist() == [0.0, 0.0]


def test_replacing_a_model_touches_no_other_whatever_its_name(tmp_path):
    other = write(tmp_path, name="m.replaced")
    write(tmp_path, bias=np.zeros(2))
    write(tmp_path, bias=np.ones(2))
    assert np.array_equal(read_model(other).tensors["b"], BIAS)


def test_a_disk_that_does_not_keep_what_it_was_given_is_noticed(tmp_path, monkeypatch):
    write(tmp_path, bias=np.zeros(2))
    monkeypatch.setattr("os.fsync", lambda handle: os.ftruncate(handle, 9))
    with pytest.raises(ModelWritingError, match="does not read back as it was written"):
        write(tmp_path, bias=np.ones(2))
    assert read_model(tmp_path / "m.json").tensors["b"].tolist() == [0.0, 0.0]


def test_a_broken_model_is_replaced_all_the_same(tmp_path):
    (tmp_path / "m.json").write_text("broken")
    assert read_model(write(tmp_path)).card.name == "m"


def test_the_files_hold_numbers_and_words_only(tmp_path):
    card = write(tmp_path)
    assert set(load_file(card.with_suffix(".safetensors"))) == {"w", "b"}
    assert json.loads(card.read_text())["format"] == "palpate-model/1"
    with pytest.raises(ModelFileError):
        read_model(card.with_suffix(".safetensors"))
