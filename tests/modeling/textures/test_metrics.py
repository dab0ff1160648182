"""Spectral errors as the thesis has them, levels as they are felt, and what is compared while a model runs."""

import math

import numpy as np
import pytest

from palpate.modeling.textures.metrics import (
    BANDS_HZ,
    correlation,
    cycle,
    density,
    envelope,
    explained,
    felt_distance,
    felt_levels,
    gfc,
    goodness,
    greatest_ratio,
    level_ratio,
    mae,
    mean_of,
    raw_gfc,
    slow,
    smoothed_gfc,
    threshold_m_s2,
)
from palpate.modeling.textures.recording import TextureDataError
from tests.modeling.textures.textures_for_tests import vibration


def test_the_criterion_is_equation_4_11_of_the_thesis():
    assert goodness(np.array([3.0, 4.0]), np.array([4.0, 3.0])) == pytest.approx(24 / 25)
    one, other = vibration(1000, 1), vibration(1000, 2)
    a, b = np.abs(np.fft.rfft(one)), np.abs(np.fft.rfft(other))
    assert gfc(one, other) == pytest.approx(np.sum(a * b) / np.sqrt(np.sum(a**2) * np.sum(b**2)))


def test_the_criterion_is_blind_to_level_and_the_level_is_not():
    signal = vibration(4000)
    for measure in (gfc, raw_gfc, smoothed_gfc):
        assert measure(signal, 0.1 * signal) == pytest.approx(1.0)
    assert level_ratio(0.1 * signal, signal) == pytest.approx(0.1)


def test_two_realisations_of_one_noise_agree_in_smoothed_spectra_and_not_in_raw_ones():
    one, other = vibration(60_000, 1), vibration(60_000, 2)
    assert smoothed_gfc(one, other) > 0.995
    assert 0.7 < raw_gfc(one, other) < 0.85


def test_smoothed_spectra_compare_signals_of_different_lengths():
    assert smoothed_gfc(vibration(60_000, 1), vibration(9000, 2)) > 0.98


def test_other_colours_are_distinguished():
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
    for measure in (mae, gfc, explained, raw_gfc):
        with pytest.raises(TextureDataError):
            measure(one, other)


def test_too_short_a_signal_has_no_smoothed_spectrum():
    with pytest.raises(TextureDataError, match="256"):
        smoothed_gfc(np.ones(255), np.ones(1000))


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
    levels = felt_levels(3.0 * np.sin(2 * np.pi * 100 * T))
    expected = 20 * math.log10(3 / math.sqrt(2) / threshold_m_s2(100))
    assert levels[BANDS_HZ.index(100.0)] == pytest.approx(expected, abs=0.3)
    assert levels[BANDS_HZ.index(50.0)] == 0
    assert levels[BANDS_HZ.index(200.0)] == 0


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


def test_an_envelope_follows_what_a_vibration_is_multiplied_by():
    shape = 1 + 0.8 * np.sin(2 * np.pi * 0.4 * T)
    curve = envelope(vibration(len(T)) * shape)
    assert len(curve) == 80  # of 250 ms
    assert correlation(curve, slow(shape)) > 0.95


def test_a_correlation_with_what_does_not_vary_is_none():
    rising = np.arange(10.0)
    assert correlation(rising, rising) == pytest.approx(1.0)
    assert correlation(rising, np.full(10, 1e9)) is None
    assert correlation(rising, 1e9 + 1e-3 * np.sin(rising)) is None
    assert correlation(rising[:2], rising[:2]) is None
    with pytest.raises(TextureDataError):
        correlation(rising, rising[1:])


def test_noise_does_not_repeat_itself_and_a_limit_cycle_does():
    assert cycle(vibration(len(T))) < 0.3
    assert cycle(np.sin(2 * np.pi * 93 * T)) == pytest.approx(1.0, abs=0.01)


def test_a_limit_cycle_is_seen_where_its_frequency_moves_and_under_noise():
    moving = np.sin(2 * np.pi * (90 * T + 0.3 * np.sin(2 * np.pi * 0.1 * T)))
    assert cycle(moving) > 0.9
    assert cycle(moving + 0.3 * np.random.default_rng(0).standard_normal(len(T))) > 0.7


def test_a_cycle_between_rests_is_one():
    sounding = (T % 6) < 3
    assert cycle(np.where(sounding, np.sin(2 * np.pi * 93 * T), 0.0)) > 0.9


def test_silence_and_short_signals_have_no_cycle():
    assert cycle(np.zeros(5000)) is None
    assert cycle(vibration(800)) is None
    assert cycle(np.empty(0)) is None
    assert cycle(vibration(1000)) is not None


def test_what_is_no_number_is_infinitely_great():
    assert greatest_ratio(np.array([1.0, -4.0]), np.array([2.0, 1.0])) == 2
    assert greatest_ratio(np.array([np.nan]), np.ones(1)) == float("inf")
    assert greatest_ratio(np.ones(1), np.zeros(1)) is None
