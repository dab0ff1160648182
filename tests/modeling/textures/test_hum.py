"""Mains hum: found where it is, taken out, and nothing else taken."""

import numpy as np
import pytest

from palpate.modeling.textures.hum import before_filter, notched, without_hum
from palpate.signals.filters import band_pass
from tests.modeling.textures.textures_for_tests import hand, vibration


def texture(n, seed):
    return vibration(n, seed) * hand(n, seed=seed)[0] / 80


def hum(n, mains_hz, sizes=(0.5, 0.0, 0.3), wander_hz=0.01):
    t = np.arange(n) / 1000
    phase = 2 * np.pi * np.cumsum(mains_hz + wander_hz * np.sin(2 * np.pi * 0.05 * t)) / 1000
    return sum(size * np.sin((k + 1) * phase + k) for k, size in enumerate(sizes))


@pytest.mark.parametrize("mains_hz", [49.9, 50.12, 60.05])
@pytest.mark.parametrize("n", [1900, 20_000])
def test_lines_of_mains_are_found_removed_and_reported(mains_hz, n):
    clean = 0.5 * texture(n, 1)
    cleaned, hum_removed = without_hum(clean + hum(n, mains_hz), 1000.0)
    assert hum_removed is not None
    assert hum_removed.mains_hz == round(mains_hz, -1)
    resolution = 1000 / n
    at = [line.frequency_hz for line in hum_removed.lines]
    assert any(abs(hertz - mains_hz) < resolution / 2 for hertz in at)
    assert any(abs(hertz - 3 * mains_hz) < resolution / 2 for hertz in at)
    assert hum_removed.removed_rms_m_s2 == pytest.approx(np.hypot(0.5, 0.3) / np.sqrt(2), rel=0.2)
    # What is left is the texture without what it had in the notches.
    left = (
        cleaned
        - notched(clean[:, None], 1000.0, hum_removed.cycles, [line.multiple for line in hum_removed.lines])[:, 0]
    )
    assert np.sqrt((left**2).mean()) < 0.1 * hum_removed.removed_rms_m_s2
    assert f"{hum_removed.mains_hz:g} Hz" in hum_removed.note() and "gone as well" in hum_removed.note()


def of_multiples(felt, n):
    """Its power within 3 Hz of a multiple of 50 Hz, and what lies between 25 and 440 Hz elsewhere."""
    hz = np.fft.rfftfreq(n, 1e-3)
    power = np.abs(np.fft.rfft(felt * np.hanning(n))) ** 2
    near = np.abs(hz - 50 * np.rint(hz / 50)) < 3
    within = (hz > 25) & (hz < 440)
    return power[near & within].sum(), power[~near & within].sum()


@pytest.mark.parametrize("n", [1900, 20_000])
def test_hum_that_wanders_and_drowns_the_texture_leaves_the_texture_alone(n):
    clean = texture(n, 1)
    t = np.arange(n) / 1000
    phase = 2 * np.pi * np.cumsum(49.95 + 0.1 * np.sin(2 * np.pi * 0.05 * t + 1)) / 1000
    drowned = clean + sum(size * np.sin(k * phase + k) for k, size in ((1, 8), (2, 2), (3, 5), (5, 3), (7, 2)))
    cleaned, hum_removed = without_hum(drowned, 1000.0)
    assert {line.multiple for line in hum_removed.lines} >= {1, 2, 3, 5, 7}
    (at, beside), (own, all_beside) = of_multiples(cleaned, n), of_multiples(clean, n)
    assert 0.4 < at / own < 1.1
    assert beside / all_beside == pytest.approx(1, abs=0.03)
    assert ("wander" in hum_removed.note()) == (n > 1900)


def test_a_filter_does_not_ring_with_hum_at_the_ends():
    clean, steady = texture(1900, 2), hum(1900, 50.07, (10.0, 0.0, 4.0), wander_hz=0.0)
    raw = (clean + steady)[:, None]
    felt = band_pass(raw, 1000.0)
    rung, hum_removed = without_hum(felt, 1000.0)
    cleaned = before_filter(raw, felt, hum_removed, 1000.0, lambda axes: band_pass(axes, 1000.0))
    expected = notched(
        band_pass(clean, 1000.0)[:, None], 1000.0, hum_removed.cycles, [line.multiple for line in hum_removed.lines]
    )
    assert np.abs(cleaned - expected).max() < 0.1 * np.abs(rung - expected).max()


@pytest.mark.parametrize("n", [1900, 20_000])
def test_a_texture_without_hum_is_left_as_it_is(n):
    for seed in range(12 if n < 5000 else 4):
        clean = texture(n, seed)
        cleaned, hum_removed = without_hum(clean, 1000.0)
        assert hum_removed is None
        assert cleaned is clean


def test_a_steady_line_elsewhere_is_the_textures_own():
    own = texture(20_000, 2) + 0.5 * np.sin(2 * np.pi * 77 * np.arange(20_000) / 1000)
    assert without_hum(own, 1000.0)[1] is None


def test_a_line_that_comes_and_goes_with_the_hand_is_not_hum():
    t = np.arange(20_000) / 1000
    pace_hz = 50 + 8 * np.sin(2 * np.pi * 0.4 * t) + 6 * np.sin(2 * np.pi * 0.27 * np.sqrt(2) * t + 1)
    sweeping = texture(20_000, 3) + np.sin(2 * np.pi * np.cumsum(pace_hz) / 1000)
    assert without_hum(sweeping, 1000.0)[1] is None


def test_all_axes_are_cleaned_and_silence_and_short_pieces_are_left():
    axes = np.stack([texture(4000, 4) + hum(4000, 50), texture(4000, 5), texture(4000, 6) - hum(4000, 50)], axis=1)
    cleaned, hum_removed = without_hum(axes, 1000.0)
    assert cleaned.shape == axes.shape and hum_removed is not None
    assert without_hum(np.zeros(5000), 1000.0)[1] is None
    assert without_hum(hum(900, 50), 1000.0)[1] is None


def test_hum_alone_is_found():
    cleaned, hum_removed = without_hum(hum(3000, 50.0, wander_hz=0.0), 1000.0)
    assert hum_removed is not None
    assert np.abs(cleaned).max() < 0.01
