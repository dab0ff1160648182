"""Features on disk: loaded as they were saved, under a key of all that decides them. See also test_result_store."""

import numpy as np
import pytest

from palpate.modeling.attributes.feature_cache import feature_key, load_features, save_features
from palpate.modeling.attributes.material import MaterialError

ROWS = {"mfcc": np.arange(12, dtype="f4").reshape(3, 4), "hand": np.zeros((3, 6), "f4")}
METADATA = {"notes": ["odd"]}
KEY = feature_key({"sha256": "ab"}, ("code",), ("numpy",))


def test_an_entry_comes_back_as_it_was_saved(tmp_path):
    save_features(tmp_path / "features", KEY, ROWS, METADATA)
    rows, metadata = load_features(tmp_path / "features", KEY)
    assert metadata == METADATA and rows.keys() == ROWS.keys()
    for kind, values in ROWS.items():
        np.testing.assert_array_equal(rows[kind], values)
        assert rows[kind].dtype == np.float32


def test_without_a_folder_nothing_is_saved(tmp_path):
    save_features(None, KEY, ROWS, METADATA)
    assert load_features(None, KEY) is None
    assert load_features(tmp_path, KEY) is None


def test_a_key_changes_with_source_settings_code_and_packages():
    others = [
        feature_key({"sha256": "ac"}, ("code",), ("numpy",)),
        feature_key({"sha256": "ab", "grid": 2}, ("code",), ("numpy",)),
        feature_key({"sha256": "ab"}, ("other",), ("numpy",)),
        feature_key({"sha256": "ab"}, ("code",), ("numpy", "nowhere")),
    ]
    assert len({KEY, *others}) == 5
    assert feature_key({"sha256": "ab"}, ("code",), ("numpy",)) == KEY


def test_a_folder_that_takes_nothing_is_refused(tmp_path):
    (tmp_path / "features").write_text("a file")
    with pytest.raises(MaterialError, match="features cannot be stored there"):
        save_features(tmp_path / "features", KEY, ROWS, METADATA)
