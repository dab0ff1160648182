"""What is kept: taken up as it was written, never where it is damaged, of another key, code or version."""

import json

import numpy as np
import pytest

from palpate.modeling.attributes.features_kept import keep, kept, key_of
from palpate.modeling.attributes.material import MaterialError

ROWS = {"mfcc": np.arange(12, dtype="f4").reshape(3, 4), "hand": np.zeros((3, 6), "f4")}
TOLD = {"notes": ["odd"]}
KEY = key_of({"sha256": "ab"}, ("code",), ("numpy",))


def test_an_entry_comes_back_as_it_was_written(tmp_path):
    keep(tmp_path / "features", KEY, ROWS, TOLD)
    rows, told = kept(tmp_path / "features", KEY)
    assert told == TOLD and rows.keys() == ROWS.keys()
    for kind, each in ROWS.items():
        np.testing.assert_array_equal(rows[kind], each)
        assert rows[kind].dtype == np.float32


def test_rows_that_there_are_none_of_come_back_as_none(tmp_path):
    keep(tmp_path, KEY, {}, TOLD)
    assert kept(tmp_path, KEY) == ({}, TOLD)


def test_without_a_folder_nothing_is_kept(tmp_path):
    keep(None, KEY, ROWS, TOLD)
    assert kept(None, KEY) is None
    assert kept(tmp_path, KEY) is None


def test_a_key_changes_with_source_settings_code_and_packages():
    others = [
        key_of({"sha256": "ac"}, ("code",), ("numpy",)),
        key_of({"sha256": "ab", "grid": 2}, ("code",), ("numpy",)),
        key_of({"sha256": "ab"}, ("other",), ("numpy",)),
        key_of({"sha256": "ab"}, ("code",), ("numpy", "nowhere")),
    ]
    assert len({KEY, *others}) == 5
    assert key_of({"sha256": "ab"}, ("code",), ("numpy",)) == KEY and len(KEY) == 32


@pytest.mark.parametrize("suffix", [".npz", ".json"])
@pytest.mark.parametrize("damage", [lambda data: data[:-20], lambda _: b"", lambda data: data[:30] + b"?" + data[31:]])
def test_a_damaged_entry_is_none(tmp_path, suffix, damage):
    keep(tmp_path, KEY, ROWS, TOLD)
    path = (tmp_path / KEY).with_suffix(suffix)
    path.write_bytes(damage(path.read_bytes()))
    assert kept(tmp_path, KEY) is None


def test_an_entry_of_another_key_or_with_other_numbers_is_none(tmp_path):
    keep(tmp_path, KEY, ROWS, TOLD)
    other = key_of({"sha256": "zz"}, (), ())
    for suffix in (".npz", ".json"):
        (tmp_path / other).with_suffix(suffix).write_bytes((tmp_path / KEY).with_suffix(suffix).read_bytes())
    assert kept(tmp_path, other) is None
    keep(tmp_path, other, {**ROWS, "hand": ROWS["hand"] + 1}, TOLD)
    (tmp_path / KEY).with_suffix(".npz").write_bytes((tmp_path / other).with_suffix(".npz").read_bytes())
    assert kept(tmp_path, KEY) is None
    assert json.loads((tmp_path / KEY).with_suffix(".json").read_text())["key"] == KEY


def test_a_folder_that_takes_nothing_is_refused(tmp_path):
    (tmp_path / "features").write_text("a file")
    with pytest.raises(MaterialError, match="features cannot be kept there"):
        keep(tmp_path / "features", KEY, ROWS, TOLD)
