from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.textures.drive import explored, from_recording
from palpate.modeling.textures.free_run import LIMITS, beyond, ceiling, free_run_scores, truth_of
from palpate.modeling.textures.recording import Parts, Recording, TextureDataError
from tests.modeling.textures.recording_for_tests import parts, recording
from tests.modeling.textures.small_evaluation import ResonantSurfaces


@pytest.fixture(scope="module")
def drive():
    return explored(ResonantSurfaces(), "cloth", 20.0, 1)


def test_the_truth_itself_is_without_fault(drive):
    scores = free_run_scores(drive.truth, drive)
    assert scores["level"] == scores["greatest"] == pytest.approx(1.0)
    assert scores["smoothed_gfc"] == scores["raw_gfc"] == scores["envelope"] == pytest.approx(1.0)
    assert scores["felt_dB"] == 0
    assert scores["cycle_excess"] == 0
    assert beyond(scores) == ()


def test_another_realisation_under_the_same_hand_is_near_but_for_the_raw_spectrum(drive):
    scores = ceiling(drive)
    assert drive.same_hand
    assert set(beyond(scores)) <= {"envelope"}  # a narrow band's own envelope wavers
    assert scores["raw_gfc"] < 0.85
    assert scores["envelope"] > 0.7


def test_a_dead_model_has_no_level_and_follows_no_hand(drive):
    scores = free_run_scores(np.zeros(len(drive.truth)), drive)
    assert scores["level"] == 0
    assert scores["smoothed_gfc"] is scores["cycle"] is None
    assert beyond(scores) == ("level", "smoothed_gfc", "envelope")


def test_a_limit_cycle_of_the_right_level_is_found_out(drive):
    t = np.arange(len(drive.truth)) / 1000
    tone = np.sin(2 * np.pi * 120 * t) * np.sqrt(2 * np.mean(drive.truth**2))
    broken = beyond(free_run_scores(tone, drive))
    assert "level" not in broken
    assert {"smoothed_gfc", "envelope", "cycle_excess"} <= set(broken) <= set(LIMITS)


def test_ten_times_too_loud_breaks_level_and_size_alone(drive):
    assert beyond(free_run_scores(10 * drive.truth, drive)) == ("level", "greatest")


def test_the_limits_are_what_another_realisation_reaches():
    numbers = {"level": 1.0, "smoothed_gfc": 0.97, "envelope": 0.75}
    assert beyond(numbers) == ("smoothed_gfc", "envelope")
    assert beyond(numbers, {"smoothed_gfc": 0.999, "envelope": 0.95}) == ("smoothed_gfc", "envelope")
    assert beyond(numbers, {"smoothed_gfc": 0.97, "envelope": 0.78}) == ()
    assert beyond(numbers, {"smoothed_gfc": 0.97, "envelope": 0.80}) == ("envelope",)
    assert beyond(numbers, {"smoothed_gfc": None, "envelope": None}) == ("smoothed_gfc", "envelope")


@pytest.mark.parametrize("signal", [np.ones(10), np.full(20_000, np.nan)])
def test_what_does_not_fit_is_refused(drive, signal):
    with pytest.raises(TextureDataError, match="samples"):
        free_run_scores(signal, drive)


def test_without_the_same_hand_there_is_no_ceiling_of_the_envelope():
    felt = recording(30.0)
    drive = from_recording(felt, parts(felt), 20.0)
    scores = ceiling(drive)
    assert not drive.same_hand
    assert "envelope" not in scores
    assert scores["smoothed_gfc"] > 0.95
    assert ceiling(replace(drive, again=None)) == {}


def test_a_recordings_own_test_part_is_driven_there_and_back():
    whole = recording(30.0)
    drive = from_recording(whole, parts(whole), 9.0)
    ((start, stop),) = parts(whole).test
    assert (drive.origin, drive.seen, drive.seconds) == ("test part", False, 9.0)
    np.testing.assert_array_equal(drive.truth[: stop - start], whole.acceleration_m_s2[start:stop])
    np.testing.assert_array_equal(drive.speed[stop - start :][: stop - start], whole.speed_mm_s[start:stop][::-1])
    assert free_run_scores(drive.truth, drive)["level"] == pytest.approx(1.0)
    assert ceiling(drive)["level"] is not None


def test_a_recording_of_2_s_is_driven_whole_and_says_that_it_was_seen():
    whole = recording(1.9)
    drive = from_recording(whole, parts(whole, 10), 9.0)
    assert drive.seen
    assert drive.origin == "whole recording"
    assert drive.cycle is not None
    assert set(ceiling(drive)) >= {"level", "smoothed_gfc", "felt_dB"}


def test_a_hand_that_rests_cannot_drive_anything():
    whole = recording(30.0)
    still = Recording("still", "still", np.stack([whole.signals[0], 0 * whole.signals[1], whole.signals[2]]))
    with pytest.raises(TextureDataError, match="units of speed"):
        from_recording(still, parts(still), 9.0)


def test_an_exploration_that_is_none_is_refused():
    simulator = ResonantSurfaces()
    object.__setattr__(simulator, "scene", lambda *_: np.full((3, 100), np.nan))
    with pytest.raises(TextureDataError, match="finite"):
        explored(simulator, "cloth", 1.0, 0)


def test_the_truths_envelope_goes_with_the_hand(drive):
    scores = truth_of(drive)
    assert scores["with_speed"] > 0.7
    assert scores["rms_m_s2"] == pytest.approx(np.sqrt(np.mean(drive.truth**2)))


def test_a_recordings_repetition_is_compared_within_windows_of_one_length():
    felt, generated = recording(20.0), recording(30.0, 4).acceleration_m_s2
    frames = [(at, at + 1000) for at in range(0, 20_000, 1000)]
    drive = from_recording(felt, Parts(tuple(frames[:14]), tuple(frames[14:18]), tuple(frames[18:])), 30.0)
    assert drive.cycle_window == 1000
    alike = free_run_scores(generated, drive)["cycle_excess"]
    assert abs(alike) < 0.1
    assert (
        free_run_scores(generated, replace(drive, cycle_window=2000))["cycle_excess"] < alike - 0.01
    )  # short windows repeat more
