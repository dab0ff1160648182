"""All kinds of features of a touch: their sizes, that they are the same again, and that extremes are finite."""

import numpy as np
import pytest

from palpate.analysis.features.touch import FeatureError, Stretch, Touch, contact, segments
from palpate.analysis.features.touch_features import SIZES, mfcc, touch_features
from tests.analysis.features.touch_specimens import noise, touch


@pytest.mark.needs("librosa", "pywt")
def test_the_documented_sizes_in_single_precision():
    features = touch_features(touch(2700, 500))
    assert {kind: rows.shape for kind, rows in features.items()} == {
        "mfcc": (6, 520), "hand": (6, 6), "dft": (6, 250), "dwt": (6, 24)
    }  # fmt: skip
    assert {kind: rows.shape[1] for kind, rows in features.items()} == SIZES
    assert SIZES["mfcc"] + SIZES["hand"] == 526
    assert all(rows.dtype == np.float32 for rows in features.values())


@pytest.mark.needs("librosa", "pywt")
def test_a_row_of_cepstra_is_time_by_coefficient():
    recording = touch(1000)
    rows = touch_features(recording)["mfcc"].reshape(2, 40, 13)
    np.testing.assert_array_equal(rows, mfcc(segments(recording).vibration).astype(np.float32))


@pytest.mark.needs("librosa", "pywt")
def test_the_same_again_bit_for_bit():
    first, second = touch_features(touch(3000)), touch_features(touch(3000))
    assert all(np.array_equal(first[kind], second[kind]) for kind in SIZES)


@pytest.mark.needs("librosa", "pywt")
@pytest.mark.parametrize(
    "axes",
    [np.zeros((1000, 3)), np.full((1000, 3), 2.5), np.clip(noise(1000), -0.1, 0.1), 1e-9 * noise(1000),
     2000 * noise(1000), np.zeros((1000, 3)) + (np.arange(1000) == 700)[:, None]],
    ids=["silent", "constant", "clipped", "faint", "loud", "one sample"],
)  # fmt: skip
def test_extremes_are_finite(axes):
    recording = Touch("made", (Stretch(axes, np.zeros(1000), np.ones(1000)),))
    assert all(np.isfinite(rows).all() for rows in touch_features(recording).values())


@pytest.mark.needs("librosa", "pywt")
def test_segments_without_contact_have_no_row():
    force = np.repeat([1.0, 0.14, 0.16, 0.0], 500)
    recording = Touch("made", (Stretch(noise(2000), np.full(2000, 50.0), force),))
    whole = touch_features(Touch("made", (Stretch(noise(2000), np.full(2000, 50.0), np.ones(2000)),)))
    features = touch_features(recording)
    np.testing.assert_array_equal(features["mfcc"], whole["mfcc"][[0, 2]])
    assert features["hand"][:, 5].tolist() == pytest.approx([1.0, 0.16])
    assert contact(recording).tolist() == [True, False, True, False]


@pytest.mark.parametrize("force_N", [0.0, 0.149, -1.0])
def test_a_touch_without_any_contact_is_refused(force_N):
    recording = Touch("made", (Stretch(noise(1000), np.full(1000, 50.0), np.full(1000, force_N)),))
    with pytest.raises(FeatureError, match=rf"made: no contact in any of 2 segments: .* is {force_N:.2g} N at most"):
        touch_features(recording)


def test_too_little_is_refused():
    with pytest.raises(FeatureError, match=r"made: the longest stretch is 0\.001 s"):
        touch_features(touch(1))
