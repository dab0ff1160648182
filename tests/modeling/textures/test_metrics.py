import numpy as np
import pytest

from palpate.modeling.textures.metrics import (
    density,
    explained,
    gfc,
    goodness,
    level_ratio,
    mae,
    mean_of,
    raw_gfc,
    smoothed_gfc,
)
from palpate.modeling.textures.recording import TextureDataError
from tests.modeling.textures.made_textures import vibration


def test_the_criterion_is_equation_4_11_of_the_thesis():
    assert goodness(np.array([3.0, 4.0]), np.array([4.0, 3.0])) == pytest.approx(24 / 25)
    one, other = vibration(1000, 1), vibration(1000, 2)
    a, b = np.abs(np.fft.rfft(one)), np.abs(np.fft.rfft(other))
    assert gfc(one, other) == pytest.approx(np.sum(a * b) / np.sqrt(np.sum(a**2) * np.sum(b**2)))


def test_the_criterion_is_blind_to_level_and_the_level_is_not():
    signal = vibration(4000)
    for each in (gfc, raw_gfc, smoothed_gfc):
        assert each(signal, 0.1 * signal) == pytest.approx(1.0)
    assert level_ratio(0.1 * signal, signal) == pytest.approx(0.1)


def test_two_realisations_of_one_noise_agree_in_smoothed_spectra_and_not_in_raw_ones():
    one, other = vibration(60_000, 1), vibration(60_000, 2)
    assert smoothed_gfc(one, other) > 0.995
    assert 0.7 < raw_gfc(one, other) < 0.85


def test_smoothed_spectra_compare_signals_of_different_lengths():
    assert smoothed_gfc(vibration(60_000, 1), vibration(9000, 2)) > 0.98


def test_other_colours_are_told_from_each_other():
    white = np.random.default_rng(0).standard_normal(20_000)
    assert smoothed_gfc(vibration(20_000), white) < 0.9


def test_a_density_integrates_to_the_power():
    signal = vibration(60_000)
    hertz, power = density(signal)
    assert hertz[1] == pytest.approx(1000 / 256)
    assert np.sum(power) * hertz[1] == pytest.approx(np.mean(signal**2), rel=0.02)


def test_silence_has_no_spectrum_and_no_level_to_compare():
    silent, signal = np.zeros(2000), vibration(2000)
    assert gfc(signal, silent) is None
    assert raw_gfc(signal, silent) is None
    assert smoothed_gfc(silent, signal) is None
    assert level_ratio(silent, signal) == 0
    assert level_ratio(signal, silent) is None


def test_errors_and_the_share_explained_are_those_of_the_definitions():
    actual = np.array([0.0, 1.0, 2.0, 3.0])
    assert mae(actual, actual + 0.5) == 0.5
    assert explained(actual, np.full(4, 1.5)) == pytest.approx(0.0)
    assert explained(actual, actual) == 1.0
    assert explained(np.ones(4), actual) is None
    assert mean_of([1.0, None, 3.0]) == 2.0
    assert mean_of([None]) is None


@pytest.mark.parametrize(
    ("one", "other"), [(np.ones(3), np.ones(4)), (np.ones(0), np.ones(0)), (np.array([1.0, np.nan]), np.ones(2))]
)
def test_signals_that_do_not_belong_together_are_refused(one, other):
    for each in (mae, gfc, explained, raw_gfc):
        with pytest.raises(TextureDataError):
            each(one, other)


def test_too_short_a_signal_has_no_smoothed_spectrum():
    with pytest.raises(TextureDataError, match="256"):
        smoothed_gfc(np.ones(255), np.ones(1000))
