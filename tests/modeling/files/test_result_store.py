import json

import numpy as np
import pytest

from palpate.modeling.files.result_store import ResultStore, content_key
from palpate.protocols.canonical import NotCanonical

ARRAYS = {"wave": np.arange(500.0), "steps": np.arange(3), "one": np.array(2.5)}
METADATA = {"numbers": {"mae": 0.25, "gfc": None}, "parts": (1, 2)}
KEY = content_key(data="ab")


@pytest.fixture
def store(tmp_path):
    store = ResultStore(tmp_path / "deep" / "jobs")
    store.save(KEY, ARRAYS, METADATA)
    return store


def test_a_result_is_loaded_as_it_was_saved_to_the_bit(store):
    arrays, metadata = store.load(KEY)
    assert metadata == {"numbers": {"mae": 0.25, "gfc": None}, "parts": [1, 2]}
    for name, array in ARRAYS.items():
        assert (arrays[name].dtype, arrays[name].shape) == (array.dtype, array.shape)
        np.testing.assert_array_equal(arrays[name], array)
    assert {path.name for path in store.folder.iterdir()} == {f"{KEY}.npz", f"{KEY}.json"}


def test_nothing_is_loaded_where_nothing_was_saved(store, tmp_path):
    assert store.load(content_key(data="ac")) is None
    ResultStore(None).save(KEY, ARRAYS, METADATA)
    assert ResultStore(None).load(KEY) is None


def test_a_result_without_arrays_comes_back(tmp_path):
    ResultStore(tmp_path).save(KEY, {}, {"notes": ["odd"]})
    assert ResultStore(tmp_path).load(KEY) == ({}, {"notes": ["odd"]})


def test_a_key_changes_with_all_that_decides_and_with_its_name():
    keys = {content_key(data="ab"), content_key(data="ac"), content_key(code="ab"), content_key(data="ab", grid=2)}
    assert len(keys) == 4 and content_key(data="ab") == KEY and len(KEY) == 32
    assert content_key(a=1, b=(2,)) == content_key(b=[2], a=1)
    with pytest.raises(NotCanonical):
        content_key(data=object())


def test_objects_of_python_are_neither_saved_nor_loaded(store):
    odd = {"odd": np.array([{"a": 1}], dtype=object)}
    with pytest.raises(ValueError, match="Python objects"):
        store.save("odd", odd, {})
    assert store.load("odd") is None
    with (store.folder / f"{KEY}.npz").open("wb") as file:
        np.savez(file, **odd)
    assert store.load(KEY) is None


def test_numbers_that_json_has_no_word_for_are_refused(tmp_path):
    with pytest.raises(ValueError, match="not a finite number"):
        ResultStore(tmp_path).save(KEY, ARRAYS, {"mae": float("nan")})
    assert ResultStore(tmp_path).load(KEY) is None


@pytest.mark.parametrize("ending", [".npz", ".json"])
def test_any_damaged_byte_is_noticed_or_harmless(store, ending):
    path = store.folder / f"{KEY}{ending}"
    whole = path.read_bytes()
    for at in range(0, len(whole), 3):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x41]) + whole[at + 1 :])
        stored = store.load(KEY)
        if stored is not None:
            assert stored.metadata == {"numbers": {"mae": 0.25, "gfc": None}, "parts": [1, 2]}
            for name, array in ARRAYS.items():
                np.testing.assert_array_equal(stored.arrays[name], array)
    for damaged in (whole[: len(whole) // 2], b"", b"{}", b"[1]"):
        path.write_bytes(damaged)
        assert store.load(KEY) is None


def test_a_half_written_result_is_none(store):
    (store.folder / f"{KEY}.json").unlink()
    assert store.load(KEY) is None


def test_files_of_another_key_or_with_other_numbers_are_not_taken(store):
    other = content_key(data="zz")
    for ending in (".npz", ".json"):
        (store.folder / f"{other}{ending}").write_bytes((store.folder / f"{KEY}{ending}").read_bytes())
    assert store.load(other) is None
    store.save(other, {**ARRAYS, "steps": np.arange(3) + 1}, METADATA)
    (store.folder / f"{KEY}.npz").write_bytes((store.folder / f"{other}.npz").read_bytes())
    assert store.load(KEY) is None
    entry = json.loads((store.folder / f"{other}.json").read_text())
    entry["metadata"]["numbers"]["mae"] = 0.5
    (store.folder / f"{other}.json").write_text(json.dumps(entry))
    assert store.load(other) is None
