"""The engineered features, against values that can be worked out by hand; and defined for every finite profile."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from palpate.signals.doors.features import describe
from palpate.signals.doors.grid import POINTS, DoorDataError
from palpate.signals.doors.model_features import FEATURES, all_features, features
from tests.examples import examples
from tests.signals.doors.profiles_for_tests import SAW, line


def test_the_first_columns_are_those_of_the_stimulus_table():
    values = all_features(SAW)
    assert tuple(values) == FEATURES
    assert dict(list(values.items())[:11]) == describe(SAW)


def test_peaks_valleys_and_intervals_of_a_drawn_profile():
    values = all_features(SAW)
    expected = {
        "major_peak_count": 3, "peak_2_N": 40, "peak_2_deg": 30, "peak_3_N": 30, "peak_3_deg": 50, "valley_1_N": -5,
        "valley_1_deg": 20, "valley_2_N": -10, "valley_2_deg": 42, "interval_1_deg": 20, "interval_2_deg": 20,
        "start_N": 0, "end_N": 6,
    }  # fmt: skip
    assert {name: values[name] for name in expected} == pytest.approx(expected)


def test_slopes_plateau_and_travel_of_a_drawn_profile():
    values = all_features(SAW)
    assert (values["rise_N_deg"], values["rise_deg"]) == (pytest.approx(5.0), pytest.approx(42, abs=0.05))
    assert (values["fall_N_deg"], values["fall_deg"]) == (pytest.approx(7.0), pytest.approx(38, abs=0.05))
    assert values["travel_N"] == pytest.approx(20 + 25 + 45 + 18 + 4 + 28 + 40 + 24)
    assert values["plateau_deg"] == pytest.approx(4, abs=1)
    assert values["plateau_N"] == pytest.approx(20, abs=1)
    assert values["force_sd_N"] == pytest.approx(SAW.std())


def test_a_flat_stretch_has_its_length_and_level():
    values = all_features(line((0, 0), (10, 30), (26, 30), (62, 120)))
    assert (values["flat_deg"], values["flat_N"]) == (pytest.approx(16, abs=0.8), pytest.approx(30, abs=0.1))
    assert all_features(line((0, 0), (62, 124)))["flat_deg"] == 0


def test_work_is_the_integral_over_the_angle_in_radians():
    values = all_features(line((0, 10), (31, 10), (31.1, -20), (62, -20)))
    half = np.radians(31)
    assert values["work_pulled_J_m"] == pytest.approx(10 * half, rel=2e-3)
    assert values["work_returned_J_m"] == pytest.approx(20 * half, rel=4e-3)
    assert values["work_J_m"] == pytest.approx(values["work_pulled_J_m"] - values["work_returned_J_m"])
    assert values["work_0_20_J_m"] == pytest.approx(10 * np.radians(20))
    parts = sum(values[name] for name in ("work_0_20_J_m", "work_20_40_J_m", "work_40_62_J_m"))
    assert parts == pytest.approx(values["work_J_m"])


def test_a_profile_without_peaks_has_the_documented_defaults():
    values = all_features(np.full(POINTS, 7.0))
    at_the_end = {
        "peak_2_N": 7, "peak_2_deg": 62, "valley_1_deg": 62, "interval_1_deg": 0, "interval_2_deg": 0, "plateau_deg": 0,
        "plateau_N": 7, "rise_N_deg": 0, "rise_deg": 0, "fall_N_deg": 0, "slope_rms_N_deg": 0, "flat_share": 1,
        "flat_N": 7, "major_peak_count": 0,
    }  # fmt: skip
    assert {name: values[name] for name in at_the_end} == pytest.approx(at_the_end)


EXTREMES = {
    "zeros": np.zeros(POINTS),
    "spike": np.eye(POINTS)[300] * 1e6,
    "spike at the start": np.eye(POINTS)[0] * -1e6,
    "spike at the end": np.eye(POINTS)[-1] * 1e6,
    "offset": SAW + 1e9 - 50,
    "noise": np.random.Generator(np.random.PCG64(1)).normal(size=POINTS) * 1e6,
    "short": np.r_[np.ones(4), np.zeros(POINTS - 4)],
    "zigzag": np.tile([1e8, -1e8], 311)[:POINTS],
}


@pytest.mark.parametrize("name", EXTREMES)
def test_every_feature_of_an_extreme_profile_is_finite(name):
    values = features(EXTREMES[name])
    assert values.shape == (len(FEATURES),)
    assert np.isfinite(values).all()


@given(arrays(np.float64, POINTS, elements=st.floats(-1e9, 1e9, width=32)))
@settings(max_examples=examples(40), deadline=None)
def test_every_feature_of_any_profile_is_finite_and_no_length_is_beyond_the_grid(force):
    values = all_features(force)
    assert np.isfinite(list(values.values())).all()
    assert all(0 <= value <= 62 for name, value in values.items() if name.endswith("_deg") and "N_deg" not in name)


def test_a_batch_holds_what_each_row_gives_and_names_pick_and_order():
    batch = np.array([SAW, np.zeros(POINTS), SAW[::-1]])
    assert np.array_equal(features(batch), [features(row) for row in batch])
    assert features(SAW, ("max_force_N", "peak_count")).tolist() == [40, 3]
    assert features(np.empty((0, POINTS))).shape == (0, len(FEATURES))
    assert features(SAW.astype(np.float16)).dtype == np.float64


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (np.ones(620), "621 points expected"),
        (np.ones((2, 622)), "profile 1: 621 points expected"),
        (np.array([SAW, np.where(SAW > 39, np.nan, SAW)]), "profile 2: the force at .* deg is nan"),
        (np.full((1, POINTS), 1e10), "profile 1: a force of 1e.10 N"),
        (np.ones((1, 1, POINTS)), r"an array of \(n, 621\) is expected"),
    ],
)
def test_what_is_no_profile_is_refused_with_its_row(force, words):
    with pytest.raises(DoorDataError, match=words):
        features(force)


def test_an_unknown_feature_names_the_nearest():
    with pytest.raises(DoorDataError, match="'mean_force' is not a feature of a profile; did you mean 'mean_force_N'"):
        features(SAW, ("mean_force",))
