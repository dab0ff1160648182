"""A model file that is damaged, foreign, newer, truncated or tampered with is refused with words that help."""

from __future__ import annotations

import hashlib
import json
import shutil

import numpy as np
import pytest
from safetensors.numpy import save

from palpate.signals.models.card import (
    Affine,
    Clip,
    Conv,
    Dense,
    DoorFeatures,
    Forest,
    Kernel,
    MaxPool,
    Mean,
    Nearest,
    Playable,
    Reshape,
    Residual,
    Upsample,
)
from palpate.signals.models.errors import ModelFileError
from palpate.signals.models.file import read_model
from tests.signals.models.cards import FORCE, edited, feeling, port, saved
from tests.signals.models.test_runtime import FOREST, FOREST_STEP


def replaced(card, content: bytes) -> None:
    """Other numbers, and a card that says they are the right ones."""
    weights = card.with_suffix(".safetensors")
    weights.write_bytes(content)
    weights_entry = {"file": weights.name, "sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}
    edited(card, weights=weights_entry)


def test_a_card_and_its_numbers_are_read(tmp_path):
    model = read_model(str(feeling(tmp_path)))
    assert model.card.name == "feeling"
    assert model.tensors["w"].tolist() == [[1.0, 0.0], [0.0, 2.0]]
    with pytest.raises(ValueError, match="read-only"):
        model.tensors["w"][0, 0] = 3.0


def raw(shape: list[int], size: int) -> bytes:
    """A safetensors file with b of 2 numbers and w of this shape, in so many bytes."""
    card_data = {
        "b": {"dtype": "F64", "shape": [2], "data_offsets": [0, 16]},
        "w": {"dtype": "F64", "shape": shape, "data_offsets": [16, 16 + size]},
    }
    header = json.dumps(card_data).encode()
    return len(header).to_bytes(8, "little") + header + bytes(16 + size)


def test_every_changed_bit_is_detected(tmp_path):
    card = feeling(tmp_path)
    weights = card.with_suffix(".safetensors")
    whole = weights.read_bytes()
    for place in (0, len(whole) // 2, len(whole) - 1):
        weights.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(ModelFileError, match=r"SHA-256 .* expected by feeling\.json: the numbers were changed"):
            read_model(card)


def test_truncated_and_missing_numbers(tmp_path):
    card = feeling(tmp_path)
    weights = card.with_suffix(".safetensors")
    whole = weights.read_bytes()
    weights.write_bytes(whole[:-1])
    with pytest.raises(ModelFileError, match=f"{len(whole) - 1} bytes found, {len(whole)} expected"):
        read_model(card)
    weights.unlink()
    with pytest.raises(ModelFileError, match=r"feeling\.safetensors: missing; it belongs to feeling\.json"):
        read_model(card)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not a safetensors file"),
        (b"PK\x03\x04 a zip file of pickles", "not a safetensors file"),
        ((2**60).to_bytes(8, "little") + b"{}", "not a safetensors file"),
        (save({"w": np.ones((2, 2))}), "need 'b', which is not in the file"),
        (save({"w": np.ones((2, 2)), "b": np.ones(2), "c": np.ones(1)}), "no step uses 'c'"),
        (save({"w": np.ones((2, 2)), "b": np.array([1.0, np.nan])}), "'b' holds a value that is not finite"),
        (save({"w": np.ones((2, 2)), "b": np.ones(2, dtype=np.complex64)}), "'b' is C64; F16, F32, F64"),
        (save({"w": np.ones((2, 2)), "b": np.ones(2, dtype=bool)}), "'b' is BOOL"),
        (save({"w": np.ones((2, 2)), "b": np.ones(2, dtype=np.int64)}), "'b' is int64; float32 or float64"),
        (save({"w": np.ones((2, 3)), "b": np.ones(2)}), r"step 2 \(dense\): 'w' has shape \(2, 3\); \(any, 2\)"),
        (save({"w": np.ones((3, 2)), "b": np.ones(3)}), r"end with shape \(3,\), the card gives 2 numbers"),
        (save({"w": np.ones((0, 2)), "b": np.ones(0)}), r"'w' has shape \(0, 2\)"),
        (raw([1] * 70 + [4], 32), "'w' cannot be held: maximum supported dimension"),
        (raw([0, 2**62], 0), "'w' cannot be held: array is too big"),
        (raw([2**40, 2**40], 32), "not a safetensors file"),
    ],
)  # fmt: skip
def test_numbers_that_are_not_this_models(tmp_path, content, words):
    card = feeling(tmp_path)
    replaced(card, content)
    with pytest.raises(ModelFileError, match=words):
        read_model(card)


@pytest.mark.parametrize(
    "name", ["../feeling.safetensors", "/etc/passwd", "a/b.safetensors", "..", "", "a\\b.safetensors", "feeling.pt"]
)
def test_a_card_never_points_elsewhere(tmp_path, name):
    card = feeling(tmp_path)
    weights_entry = json.loads(card.read_text())["weights"]
    shutil.copy(card.with_suffix(".safetensors"), tmp_path.parent / "feeling.safetensors")
    with pytest.raises(ModelFileError, match=r"weights\.file is .* in the card's folder is expected"):
        read_model(edited(card, weights={**weights_entry, "file": name}))


def test_a_name_that_the_system_cannot_look_up_is_no_traceback(tmp_path):
    card = feeling(tmp_path)
    weights_entry = json.loads(card.read_text())["weights"]
    with pytest.raises(ModelFileError, match=r"cannot be read \(File name too long\)"):
        read_model(edited(card, weights={**weights_entry, "file": "a" * 300 + ".safetensors"}))


@pytest.mark.parametrize("makes", ["symlink", "folder"])
def test_numbers_that_are_no_file_are_not_read(tmp_path, makes):
    card = feeling(tmp_path)
    weights = card.with_suffix(".safetensors")
    weights.unlink()
    if makes == "symlink":
        weights.symlink_to("/dev/zero")
    else:
        weights.mkdir()
    with pytest.raises(ModelFileError, match="missing; it belongs to"):
        read_model(card)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "palpate-model/2"}, "format 'palpate-model/2'; this version reads 'palpate-model/1'. Update"),
        ({"format": "onnx"}, "not a model's card: format 'onnx'"),
        ({"format": None}, "no format is named"),
        ({"more": 1}, "more: Extra inputs are not permitted"),
        ({"title": 3}, "title: Input should be a valid string"),
        (
            {"gives": {"kind": "ratings", "size": "2", "unit": "0..100"}},
            r"gives\.size: Input should be a valid integer",
        ),
        ({"gives": {"kind": "ratings", "size": 2, "unit": "", "names": ["a"]}}, "1 name for 2 numbers"),
        ({"steps": [{"do": "run_python", "code": "1"}]}, "steps.0"),
        ({"interval": {"method": "x", "coverage": 0.9, "half_width": [1]}}, "1 half widths for 2 numbers"),
        ({"weights": {"file": "feeling.safetensors", "sha256": "xyz", "bytes": 1}}, r"weights\.sha256"),
    ],
)
def test_a_card_that_is_none(tmp_path, changes, words):
    with pytest.raises(ModelFileError, match=words):
        read_model(edited(feeling(tmp_path), **changes))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("model.json", b"", "not a model's card: .* A card is a JSON text file"),
        ("model.json", b"\x80\x04\x95 a pickle", "not a model's card"),
        ("model.json", b"[1, 2]", "no format is named"),
        ("model.json", b'{"format": "palpate-model/1", "metrics": {"mae": NaN}}', "not a model's card"),
        ("model.json", b'{"format": "palpate-model/1", "training": {"a": 1e999}}', r"training\.a: inf is not a finite"),
        ("model.json", b'{"a": 1, "a": 2}', "not a model's card"),
        ("model.json", b"[" * 100_000, "not a model's card"),
        ("model.json", b" " * (9 * 1024**2), "a model's card has at most"),
        ("model.pt", b"x", r"\.pt files are not opened: they may run code"),
        ("model.pkl", b"x", r"\.pkl files are not opened"),
        ("model.h5", b"x", r"\.h5 files are not opened"),
        ("model.onnx", b"x", r"\.onnx files are not opened"),
        ("model.safetensors", b"x", r"give its card, model\.json"),
        ("nothing.json", None, r"there is no such file\. .* NAME\.json; `palpate models list`"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_card(tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ModelFileError, match=words):
        read_model(tmp_path / name)


@pytest.mark.parametrize("depth", [300, 30_000])
def test_steps_within_steps_without_end_are_refused(tmp_path, depth):
    card = feeling(tmp_path)
    inner = '{"do": "residual", "steps": [' * depth + "]}" * depth
    card.write_text(json.dumps({**json.loads(card.read_text()), "steps": ["HERE"]}).replace('"HERE"', inner))
    with pytest.raises(ModelFileError):
        read_model(card)


def test_steps_as_deep_as_a_card_can_hold_them_run(tmp_path):
    steps = ()
    for _ in range(90):
        steps = (Residual(steps=steps),)
    card = saved(tmp_path, steps, {}, port(2), port(2))
    assert read_model(card).run(np.array([1.0, -1.0])) == pytest.approx([91.0, 0.0])


ONE = np.ones(1)
TREE = {name: FOREST[name] for name in FOREST}


@pytest.mark.parametrize(
    ("steps", "tensors", "words"),
    [
        ([Conv(weight="w", bias="b")], {"w": np.ones((1, 1, 3)), "b": ONE}, r"step 1 \(conv\): shape \(6,\) comes"),
        ([Reshape(shape=(2, 4))], {}, r"6 numbers of shape \(6,\) do not fit shape \(2, 4\)"),
        ([Reshape(shape=(-2, -3))], {}, "do not fit"),
        ([Reshape(shape=(1, 2, 3)), Reshape(shape=(6,))], {}, "do not fit"),
        ([Reshape(shape=(1, 6)), Conv(weight="w", bias="b")], {"w": np.ones((1, 1, 7)), "b": ONE}, "a width of 7"),
        ([Reshape(shape=(1, 6)), Conv(weight="w", bias="b", pad=10**12)], {"w": np.ones((1, 1, 3)), "b": ONE}, "zeros"),
        ([Reshape(shape=(1, 6)), Upsample(times=10**12)], {}, "6 numbers 1000000000000 times"),
        ([Reshape(shape=(1, 6)), Upsample(times=10**9), Dense(weight="w", bias="b")], {"w": ONE, "b": ONE}, "times"),
        ([Reshape(shape=(1, 6)), MaxPool(size=7)], {}, "a length of 6 has no 7 neighbours"),
        ([Residual(steps=(Reshape(shape=(2, 3)),))], {}, "the same shape is expected"),
        ([Residual(steps=(Dense(weight="w", bias="b"),))], {"w": np.ones((6, 5)), "b": np.ones(6)},
         r"step 1 \(residual\), step 1 \(dense\): 'w' has shape"),
        ([Mean(members=())], {}, "no members"),
        ([Mean(members=((), (Dense(weight="w", bias="b"),)))], {"w": np.ones((1, 6)), "b": ONE}, "one and the same"),
        ([Clip(low=1, high=0)], {}, "low 1 is above high 0"),
        ([Affine(gain="g")], {"g": np.ones((2, 6))}, "one that fits"),
        ([DoorFeatures(names=("max_force_N",))], {}, "621 forces of a profile"),
        ([Playable(force_N=1, slope_N_deg=1)], {}, "621 forces of a profile"),
        ([Kernel(points="p", weights="w", length=1)], {"p": np.ones((2, 6)), "w": np.ones((3, 1))}, r"\(2, any\)"),
        ([Kernel(points="p", weights="w", length=1e-200)], {"p": np.ones((2, 6)), "w": np.ones((2, 1))}, "too short"),
        ([Nearest(points="p", values="v")], {"p": np.ones((2, 5)), "v": np.ones((2, 1))}, r"\(any, 6\)"),
        ([FOREST_STEP], {**TREE, "left": np.array([0, 2, -1, -1, -1, -1])}, "leads back"),
        ([FOREST_STEP], {**TREE, "right": np.array([9, 3, -1, -1, -1, -1])}, "a node that does not exist"),
        ([FOREST_STEP], {**TREE, "feature": np.array([6, 1, -1, -1, -1, -1])}, "asks for an input"),
        ([FOREST_STEP], {**TREE, "roots": np.array([0, 6])}, "names a node that is not there"),
        ([FOREST_STEP], {**TREE, "feature": np.zeros(6)}, "int32 or int64"),
        ([FOREST_STEP], {**TREE, "roots": np.zeros(4096, dtype=int), "value": np.ones((6, 4096))}, "4096 trees"),
    ],
)  # fmt: skip
def test_steps_that_do_not_fit_are_refused_before_the_model_runs(tmp_path, steps, tensors, words):
    card = saved(tmp_path, steps, tensors, port(6), port(1))
    with pytest.raises(ModelFileError, match=words) as refused:
        read_model(card)
    assert str(refused.value).startswith(str(card))


def test_a_feature_that_is_unknown_here_is_named_with_the_nearest(tmp_path):
    card = saved(tmp_path, [DoorFeatures(names=("max_force",))], {}, FORCE, port(1))
    with pytest.raises(ModelFileError, match="no feature 'max_force' here; did you mean 'max_force_N'"):
        read_model(card)


def test_a_forest_with_two_numbers_for_one_name_is_still_checked(tmp_path):
    step = Forest(**{**{name: name for name in FOREST}, "right": "left"})
    tensors = {name: value for name, value in FOREST.items() if name != "right"}
    assert read_model(saved(tmp_path, [step], tensors, port(2), port(1))).run(np.array([1.0, 1.0])) == 5.5
