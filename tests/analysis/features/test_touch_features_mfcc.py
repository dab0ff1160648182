"""Cepstral coefficients against librosa 0.11, called on each segment by itself, from its waveform on."""

import librosa
import numpy as np
import pytest
from scipy.signal.windows import hann

from palpate.analysis.features.touch_features import COEFFICIENTS, FLOOR, FRAME, FRAMES, frames, mfcc, starts
from tests.analysis.features.touch_specimens import noise

pytestmark = pytest.mark.needs("librosa")

SEGMENTS = noise(500, 6).T * np.array([1e-3, 0.1, 1.0, 10.0, 300.0, 1.0])[:, None]
OPTIONS = {"sr": 1000, "n_fft": 25, "hop_length": 25, "window": "boxcar", "center": False, "n_mels": 13}


def waveform(segment):
    """The segment's frames one after another: with a hop of a frame, librosa cuts it into just these."""
    padded = np.r_[np.zeros(12), segment * hann(500, sym=False), np.zeros(12)]
    return np.concatenate([padded[round(12.5 * i) : round(12.5 * i) + 25] for i in range(40)])


def by_librosa(segment):
    bands = librosa.feature.melspectrogram(y=waveform(segment), **OPTIONS)
    return librosa.feature.mfcc(S=librosa.power_to_db(bands, top_db=None), n_mfcc=13).T


def test_forty_frames_of_thirteen():
    assert (FRAME, FRAMES, COEFFICIENTS) == (25, 40, 13)
    assert starts().tolist() == [round(12.5 * i) for i in range(40)]
    assert set(np.diff(starts())) == {12, 13}
    assert frames(SEGMENTS).shape == (6, 40, 25)
    assert mfcc(SEGMENTS).shape == (6, 40, 13)


def test_they_are_librosas_own():
    result = mfcc(SEGMENTS)
    for mine, segment in zip(result, SEGMENTS, strict=True):
        np.testing.assert_allclose(mine, by_librosa(segment), rtol=0, atol=1e-6)


def test_they_are_those_of_librosa_in_one_call_where_its_range_of_80_dB_clips_nothing():
    bands = librosa.feature.melspectrogram(y=waveform(SEGMENTS[2]), **OPTIONS)
    within = bands.min(axis=0) > 1e-8 * bands.max()
    whole = librosa.feature.mfcc(y=waveform(SEGMENTS[2]), n_mfcc=13, **OPTIONS).T
    assert within.sum() >= 38
    np.testing.assert_allclose(mfcc(SEGMENTS[2:3])[0][within], whole[within], rtol=0, atol=1e-6)


def test_no_mel_band_is_empty():
    assert (librosa.filters.mel(sr=1000, n_fft=25, n_mels=13).sum(axis=1) > 0).all()


def test_a_segment_knows_nothing_of_another():
    np.testing.assert_array_equal(mfcc(SEGMENTS)[3], mfcc(SEGMENTS[3:4])[0])


def test_silence_is_the_floor():
    result = mfcc(np.zeros((1, 500)))[0]
    np.testing.assert_allclose(result[:, 0], 10 * np.log10(FLOOR) * np.sqrt(13), rtol=1e-12)
    np.testing.assert_allclose(result[:, 1:], 0, atol=1e-9)


def test_twice_as_loud_moves_the_first_coefficient_only():
    quiet, loud = mfcc(SEGMENTS[2:3])[0], mfcc(2 * SEGMENTS[2:3])[0]
    np.testing.assert_allclose((loud - quiet)[1:-1, 0], 20 * np.log10(2) * np.sqrt(13), rtol=1e-9)
    np.testing.assert_allclose((loud - quiet)[1:-1, 1:], 0, atol=1e-9)


@pytest.mark.parametrize("segment", [np.full(500, 3.0), np.eye(500)[250], np.clip(SEGMENTS[4], -20, 20)])
def test_constant_single_and_clipped_samples_are_finite_and_librosas_own(segment):
    result = mfcc(segment[None])[0]
    assert np.isfinite(result).all()
    np.testing.assert_allclose(result, by_librosa(segment), rtol=0, atol=1e-6)
