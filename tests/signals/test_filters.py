"""Filters without delay: where their edges lie, what they leave, what they refuse."""

import numpy as np
import pytest

from palpate.signals.filters import SignalError, band_pass, has_upper_edge, low_pass

RATE_HZ = 1000.0
T = np.arange(8000) / RATE_HZ
MIDDLE = slice(2000, 6000)


def gain(passed, hz, rate_hz=RATE_HZ):
    t = np.arange(8000) / rate_hz
    wave = np.sin(2 * np.pi * hz * t)
    middle = passed(wave)[MIDDLE]
    return 20 * np.log10(middle.std() / wave[MIDDLE].std()), float(np.corrcoef(middle, wave[MIDDLE])[0, 1])


def test_edges_are_three_decibels_down_and_nothing_is_late():
    low = lambda wave: low_pass(wave, RATE_HZ)  # noqa: E731
    high = lambda wave: band_pass(wave, RATE_HZ)  # noqa: E731
    for passed, edge, inside, outside in ((low, 25, 5, 200), (high, 20, 100, 4)):
        level, phase = gain(passed, edge)
        assert level == pytest.approx(-3.01, abs=0.05)
        assert phase > 0.9999
        assert gain(passed, inside)[0] == pytest.approx(0, abs=0.1)
        assert gain(passed, outside)[0] < -60


def test_the_upper_edge_is_left_out_from_0_98_of_nyquist_on():
    assert not has_upper_edge(1000.0)
    assert not has_upper_edge(2000.0 / 0.98)
    assert has_upper_edge(2100.0)
    at_3_khz = lambda wave: band_pass(wave, 3000.0)  # noqa: E731
    assert gain(at_3_khz, 1000, 3000.0)[0] == pytest.approx(-3.01, abs=0.05)
    assert gain(lambda wave: band_pass(wave, RATE_HZ), 480)[0] == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("offset", [9.80665, 1e9])
def test_gravity_and_huge_offsets_leave_no_trace(offset):
    wave = np.sin(2 * np.pi * 100 * T)
    assert np.abs(band_pass(wave + offset, RATE_HZ)[MIDDLE] - wave[MIDDLE]).max() < 1e-6
    np.testing.assert_allclose(low_pass(np.full(50, offset), RATE_HZ), offset, rtol=1e-15)


def test_a_constant_is_silent_exactly():
    assert not band_pass(np.full((300, 3), 0.1), RATE_HZ).any()


def test_half_precision_is_filtered_in_double():
    half = np.sin(2 * np.pi * 100 * T).astype(np.float16)
    np.testing.assert_array_equal(band_pass(half, RATE_HZ), band_pass(half.astype(float), RATE_HZ))


@pytest.mark.parametrize("n", [2, 3, 10])
def test_few_samples_give_finite_numbers(n):
    assert np.isfinite(band_pass(np.arange(n, dtype=float), RATE_HZ)).all()
    assert np.isfinite(low_pass(np.arange(n, dtype=float), RATE_HZ)).all()


def test_what_cannot_be_filtered_is_refused():
    with pytest.raises(SignalError, match="sample 3 is nan"):
        low_pass(np.array([0, 1, np.nan]), RATE_HZ)
    with pytest.raises(SignalError, match="1 sample:"):
        low_pass(np.array([1.0]), RATE_HZ)
    with pytest.raises(SignalError, match="no such band"):
        band_pass(T, 40.0)
    for rate in (0.0, -1.0, np.nan):
        with pytest.raises(SignalError, match="above 0"):
            low_pass(T, rate)
