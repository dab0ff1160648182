"""What a touch may hold, and how it is cut into segments of half a second."""

import numpy as np
import pytest

from palpate.analysis.features.touch import SEGMENT, FeatureError, Stretch, Touch, segments
from tests.analysis.features.touch_specimens import noise, stretch, touch


def test_no_segment_reaches_over_a_hole_and_what_is_left_over_is_in_none():
    first, second = stretch(1249), stretch(700, seed=1)
    segmented = segments(Touch("made", (first, second)))
    assert segmented.vibration.shape == segmented.speed_mm_s.shape == segmented.force_N.shape == (3, 500)
    np.testing.assert_array_equal(segmented.speed_mm_s[1], first.speed_mm_s[500:1000])
    np.testing.assert_array_equal(segmented.force_N[2], second.force_N[:500])
    assert Touch("made", (first, second)).seconds == pytest.approx(1.949)


def test_the_energy_of_all_axes_stays_in_its_segment():
    axes = noise(4 * SEGMENT) * np.repeat([1e-6, 30.0, 0.2, 1e3], SEGMENT)[:, None] + 0.3
    recording = Touch("made", (Stretch(axes, np.zeros(len(axes)), np.ones(len(axes))),))
    expected = (axes.reshape(4, SEGMENT, 3) ** 2).sum(axis=(1, 2))
    np.testing.assert_allclose((segments(recording).vibration ** 2).sum(axis=1), expected, rtol=1e-10)


def test_its_spectrum_is_the_root_of_the_summed_spectra_with_the_phase_of_the_summed_axes():
    axes = noise(SEGMENT)
    joined = np.fft.rfft(segments(Touch("made", (Stretch(axes, *2 * [np.zeros(SEGMENT)]),))).vibration[0])
    spectra = np.fft.rfft(axes, axis=0)
    np.testing.assert_allclose(np.abs(joined), np.sqrt((np.abs(spectra) ** 2).sum(axis=1)), rtol=1e-10)
    np.testing.assert_allclose(np.exp(1j * np.angle(joined)), np.exp(1j * np.angle(spectra.sum(axis=1))), atol=1e-9)


def test_one_axis_stays_as_it_is():
    recording = touch(1000, axes=1)
    np.testing.assert_array_equal(segments(recording).vibration.ravel(), recording.stretches[0].axes[:, 0])


@pytest.mark.parametrize("lengths", [(), (1,), (499, 499)])
def test_less_than_a_segment_is_refused(lengths):
    with pytest.raises(FeatureError, match="a segment takes 0.5 s: record longer"):
        segments(touch(*lengths))


@pytest.mark.parametrize(
    ("given", "message"),
    [((np.zeros(5), np.zeros(5), np.zeros(5)), "of shapes"),
     ((np.zeros((5, 0)), np.zeros(5), np.zeros(5)), "of shapes"),
     ((np.zeros((5, 3)), np.zeros(4), np.zeros(5)), "of shapes"),
     ((np.zeros((5, 3)), np.zeros(5), np.zeros((5, 1))), "of shapes"),
     ((np.full((5, 3), np.nan), np.zeros(5), np.zeros(5)), "acceleration, sample 1, is nan"),
     ((np.zeros((5, 3)), np.r_[np.zeros(4), np.inf], np.zeros(5)), "speed, sample 5, is inf"),
     ((np.zeros((5, 3)), np.zeros(5), np.r_[0, np.nan, 0, 0, 0]), "force, sample 2, is nan")],
)  # fmt: skip
def test_signals_that_do_not_fit_or_are_no_numbers_are_refused(given, message):
    with pytest.raises(FeatureError, match=message):
        Stretch(*given)
