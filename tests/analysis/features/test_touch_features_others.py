"""The other kinds of features of a segment: spectrum, wavelets, the hand's statistics."""

import numpy as np
import pytest
import pywt
from scipy.stats import entropy

from palpate.analysis.features.touch_features import hand, spectrum, wavelets
from tests.analysis.features.touch_specimens import noise

pytestmark = pytest.mark.needs("pywt")

SEGMENTS = noise(500, 4, seed=3).T
HANN = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(500) / 500)


def test_a_sine_stands_at_its_frequency_with_its_power():
    sine = 3 * np.sin(2 * np.pi * 100 * np.arange(500) / 1000 + 0.4)
    (result,) = spectrum(sine[None])
    assert result.shape == (250,)
    assert result.argmax() == 49  # 2, 4, ... Hz
    assert result.max() == pytest.approx(20 * np.log10(3 * 250 / 2), abs=1e-9)  # Hann's weights sum to 250


def test_the_spectrum_is_numpys():
    expected = 20 * np.log10(np.abs(np.fft.rfft(SEGMENTS * HANN)[:, 1:]))
    np.testing.assert_allclose(spectrum(SEGMENTS), expected, atol=1e-9)


def test_wavelets_are_those_of_pywavelets_segment_by_segment():
    result = wavelets(SEGMENTS)
    assert result.shape == (4, 24)
    for mine, segment in zip(result.reshape(4, 6, 4), SEGMENTS * HANN, strict=True):
        for row, band in zip(mine, pywt.wavedec(segment, "db4", level=5), strict=True):
            power = np.mean(band**2)
            expected = [np.abs(band).mean(), band.std(), 10 * np.log10(power), entropy(band**2)]
            np.testing.assert_allclose(row, expected, rtol=1e-9)


def test_wavelets_part_slow_from_fast():
    t = np.arange(500) / 1000
    result = wavelets(np.sin(2 * np.pi * np.array([[25.0], [95.0], [350.0]]) * t)).reshape(3, 6, 4)
    assert result[:, :, 2].argmax(axis=1).tolist() == [1, 3, 5]  # the bands of 16 to 31, 62 to 125, 250 to 500 Hz


def test_silence_is_finite():
    np.testing.assert_allclose(spectrum(np.zeros((1, 500))), -100)
    np.testing.assert_allclose(wavelets(np.zeros((1, 500))).reshape(6, 4), np.tile([0, 0, -100, 0], (6, 1)))


def test_the_hand_in_six_numbers():
    speed, force = np.array([[1.0, 5.0, 3.0], [2.0, 2.0, 2.0]]), np.array([[0.0, 1.0, 5.0], [-1.0, 0.0, 1.0]])
    np.testing.assert_array_equal(hand(speed, force), [[1, 5, 3, 0, 5, 2], [2, 2, 2, -1, 1, 0]])
