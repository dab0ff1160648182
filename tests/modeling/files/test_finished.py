import json

import numpy as np
import pytest

from palpate.modeling.files.finished import put_down, taken_up

ARRAYS = {"wave": np.arange(500.0), "steps": np.arange(3)}


def both(told, arrays):
    return told, arrays


def test_what_is_put_down_is_taken_up_to_the_bit(tmp_path):
    place = tmp_path / "deep" / "job"
    put_down(place, ARRAYS, {"numbers": {"mae": 0.1, "gfc": None}})
    told, arrays = taken_up(place, both)
    assert told == {"numbers": {"mae": 0.1, "gfc": None}}
    for name, each in ARRAYS.items():
        assert arrays[name].dtype == each.dtype
        np.testing.assert_array_equal(arrays[name], each)
    assert {path.suffix for path in place.parent.iterdir()} == {".npz", ".json"}


def test_nothing_is_taken_up_where_nothing_lies_or_its_maker_has_no_use_for_it(tmp_path):
    assert taken_up(tmp_path / "job", both) is None
    put_down(tmp_path / "job", ARRAYS, {})
    assert taken_up(tmp_path / "job", lambda told, arrays: told["numbers"]) is None


def test_no_pickle_is_opened(tmp_path):
    put_down(tmp_path / "job", {"odd": np.array([{"a": 1}], dtype=object)}, {})
    assert taken_up(tmp_path / "job", both) is None


def test_numbers_that_json_has_no_word_for_are_refused(tmp_path):
    with pytest.raises(ValueError, match="is not a finite number"):
        put_down(tmp_path / "job", ARRAYS, {"mae": float("nan")})
    assert taken_up(tmp_path / "job", both) is None


@pytest.mark.parametrize("ending", [".npz", ".json"])
def test_any_damaged_byte_is_noticed_or_harmless(tmp_path, ending):
    place = tmp_path / "job"
    put_down(place, ARRAYS, {"numbers": {"mae": 0.25}})
    path = place.with_suffix(ending)
    whole = path.read_bytes()
    for at in range(0, len(whole), 3):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x41]) + whole[at + 1 :])
        found = taken_up(place, both)
        if found is not None and ending == ".npz":
            for name, each in found[1].items():
                np.testing.assert_array_equal(each, ARRAYS[name])
    path.write_bytes(whole[: len(whole) // 2])
    assert taken_up(place, both) is None


def test_a_half_written_job_is_none(tmp_path):
    place = tmp_path / "job"
    put_down(place, ARRAYS, {})
    place.with_suffix(".json").unlink()
    assert taken_up(place, both) is None
    place.with_suffix(".json").write_text(json.dumps([1]))
    assert taken_up(place, both)[0] == [1]
