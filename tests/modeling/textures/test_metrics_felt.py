import math

import numpy as np
import pytest

from palpate.modeling.textures.metrics import BANDS_HZ, felt_distance, felt_levels, threshold_m_s2
from palpate.modeling.textures.recording import TextureDataError
from tests.modeling.textures.made_textures import vibration

T = np.arange(20_000) / 1000


def displacement_dB(hertz):
    """The threshold as papers print it: dB re 1 um, peak."""
    return 20 * math.log10(threshold_m_s2(hertz) * math.sqrt(2) / (2 * math.pi * hertz) ** 2 / 1e-6)


def test_the_threshold_is_that_of_the_papers():
    assert displacement_dB(250) == pytest.approx(-20)
    assert displacement_dB(280) == pytest.approx(-20)
    assert displacement_dB(62.5) - displacement_dB(125) == pytest.approx(12)
    assert displacement_dB(10) - displacement_dB(20) == pytest.approx(5)
    assert displacement_dB(500) > displacement_dB(300) + 8
    assert threshold_m_s2(125) == pytest.approx(0.174, abs=0.001)


def test_a_tone_has_its_level_in_its_own_third_octave():
    found = felt_levels(3.0 * np.sin(2 * np.pi * 100 * T))
    expected = 20 * math.log10(3 / math.sqrt(2) / threshold_m_s2(100))
    assert found[BANDS_HZ.index(100.0)] == pytest.approx(expected, abs=0.3)
    assert found[BANDS_HZ.index(50.0)] == 0
    assert found[BANDS_HZ.index(200.0)] == 0


def test_twice_as_loud_is_6_dB_off_where_every_band_is_felt():
    loud = 100 * np.random.default_rng(0).standard_normal(60_000)
    assert felt_distance(loud, 2 * loud) == pytest.approx(6.02, abs=0.01)
    assert felt_distance(loud, loud) == 0


def test_what_is_not_felt_makes_no_difference():
    faint = 0.01 * vibration(20_000)
    assert felt_levels(faint).max() == 0
    assert felt_distance(faint, np.zeros(20_000)) == 0


def test_the_distance_grows_with_the_spectrums_difference():
    truth = vibration(60_000, 1)
    assert felt_distance(truth, vibration(60_000, 2)) < 0.5
    assert felt_distance(truth, np.random.default_rng(3).standard_normal(60_000)) > 3


def test_too_short_a_signal_is_refused():
    with pytest.raises(TextureDataError):
        felt_levels(np.ones(100))
