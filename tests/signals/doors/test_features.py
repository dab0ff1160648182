"""Peaks, plateau and the numeric columns, against values that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import find_peaks

from palpate.signals.doors.features import describe, landmarks, peaks_of, plateau_after_second_peak
from palpate.signals.doors.grid import POINTS, DoorDataError, motion_end
from tests.examples import examples
from tests.signals.doors.profiles_for_tests import SAW, line


@given(st.lists(st.integers(-6, 6), min_size=3, max_size=120), st.integers(1, 6))
@settings(max_examples=examples(200), deadline=None)
def test_peaks_and_their_prominence_agree_with_scipy(values, least) -> None:
    force = np.array(values, dtype=float)
    expected, _ = find_peaks(force, prominence=least)
    assert peaks_of(force, least) == expected.tolist()


def test_landmarks_of_a_drawn_profile() -> None:
    marks = landmarks(SAW)
    assert marks.peaks == (100, 300, 500)
    assert marks.valleys == (200, 420, 620)
    assert marks.end == 620


def test_the_plateau_after_the_second_peak_is_found() -> None:
    first, last = plateau_after_second_peak(SAW, "test")
    assert (first, last) == (pytest.approx(340, abs=5), pytest.approx(380, abs=5))


def test_a_fall_in_one_go_has_no_plateau() -> None:
    with pytest.raises(DoorDataError, match="falls in one go"):
        plateau_after_second_peak(line((0, 0), (10, 20), (20, -5), (30, 40), (42, -10), (62, 0)), "test")


def test_the_columns_of_a_drawn_profile() -> None:
    columns = describe(SAW)
    assert columns["first_peak_N"] == 20
    assert columns["first_peak_deg"] == 10
    assert columns["peak_count"] == 3
    assert columns["initial_force_N"] == pytest.approx(5)
    assert columns["drop_N"] == 50
    assert columns["end_slope_N_deg"] == pytest.approx(-2)
    assert (columns["max_force_N"], columns["min_force_N"], columns["opening_deg"]) == (40, -10, 62)
    area = 10 * 10 + 7.5 * 10 + 17.5 * 10 + 31 * 4 + 20 * 4 + 4 * 4 + 10 * 8 + 18 * 12
    assert columns["mean_force_N"] == pytest.approx(area / 62, abs=0.02)


def test_roughness_is_the_level_of_fast_detail_and_zero_on_a_straight_line() -> None:
    ripple = 0.8 * np.sin(2 * np.pi * np.arange(POINTS) / 7)  # three whole periods in the two-degree average
    assert describe(line((0, 3), (62, 30)) + ripple)["roughness_N"] == pytest.approx(0.8 / np.sqrt(2), rel=0.02)
    assert describe(line((0, 3), (62, 30)))["roughness_N"] == pytest.approx(0, abs=1e-9)


def test_padding_is_not_part_of_the_motion() -> None:
    padded = np.where(np.arange(POINTS) <= 550, line((0, 10), (62, 10)), 0.0)
    columns = describe(padded)
    assert (columns["opening_deg"], columns["mean_force_N"], round(columns["end_slope_N_deg"], 12)) == (55, 10, 0)
    assert motion_end(tuple(padded.tolist())) == 550


@pytest.mark.parametrize("force_N", [np.zeros(POINTS), np.full(POINTS, 7.0), np.r_[0.0, 1.0, np.zeros(619)]])
def test_a_profile_without_features_has_finite_columns(force_N) -> None:
    columns = describe(force_N)
    assert np.isfinite(list(columns.values())).all()
    assert columns["peak_count"] == 0
    assert columns["drop_N"] == 0
