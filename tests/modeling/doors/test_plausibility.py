"""The plausibility of made profiles."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.modeling.doors.plausibility import (
    assess_profiles,
    corners,
    distances_N,
    extremes,
    singles,
    unplayable,
    work_J_m,
)
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.doors.limits import LIMIT_N, hardest

ANGLE = np.arange(621) / 10


def line(level, slope=0.0):
    return level + slope * ANGLE


MEASURED = np.array([line(10), line(12), line(16), line(10)])


def assess(profile, measured):
    return assess_profiles(profile, measured)[0]


def test_force_slope_and_work_of_a_straight_line():
    """The work of 20 N over 62 degrees is 20 x 62 pi / 180 J for each metre of handle radius; 0..62 N is half of 62."""
    plausibility = assess(line(20), MEASURED)
    assert (plausibility.greatest_N, plausibility.steepest_N_deg) == (20, 0)
    assert plausibility.work_J_m == pytest.approx(20 * np.radians(62))
    ramp = assess(line(0, -0.5), MEASURED)
    assert ramp.greatest_N == pytest.approx(31) and ramp.steepest_N_deg == pytest.approx(0.5)
    assert work_J_m(line(0, -0.5)) == pytest.approx(-15.5 * np.radians(62))


def test_the_distance_is_to_the_nearest_and_is_held_against_those_among_the_measured():
    """Among 10, 12, 16 N (10 counts once) the nearest neighbours lie 2, 2 and 4 N away."""
    assert [round(assess(line(level), MEASURED).distance_N, 9) for level in (10, 13, 19, 21)] == [0, 1, 3, 5]
    plausibilities = assess_profiles(np.array([line(10), line(13), line(19), line(21)]), MEASURED)
    assert [plausibility.beyond for plausibility in plausibilities] == pytest.approx([0, 0, 2 / 3, 1])
    assert distances_N(line(11), MEASURED) == pytest.approx([1, 1, 5, 1])


def test_the_hardest_profile_that_may_be_made_is_playable():
    plausibility = assess(np.array(hardest()), MEASURED)
    assert (
        plausibility.playable
        and plausibility.greatest_N == LIMIT_N
        and plausibility.steepest_N_deg == pytest.approx(60)
    )


@pytest.mark.parametrize(
    ("profile", "why"),
    [(line(61), "a force of 61.0 N; at most 60 N"), (np.where(ANGLE > 30, 7.0, 0.0), "a change of 70.0 N/deg")],
)
def test_a_limit_that_is_broken_is_named(profile, why):
    plausibility = assess(profile, MEASURED)
    assert not plausibility.playable and why in plausibility.why


def test_what_the_door_refuses_is_not_playable():
    plausibility = assess(line(0), MEASURED)
    assert (
        not plausibility.playable
        and plausibility.why == "the profile: no force beyond 0 degrees: a door that does not open"
    )


def test_extreme_input_is_refused_or_assessed_but_never_nan():
    spike = line(5)
    spike[300] = 1e6
    assert "a force of 1000000.0 N" in assess(spike, MEASURED).why
    assert np.isfinite(assess(line(1e300), MEASURED).work_J_m)
    assert assess(line(5).astype(np.float16), MEASURED).playable
    for bad in (np.full(621, np.nan), np.zeros(620), np.zeros(622)):
        with pytest.raises(ModelDataError):
            assess(bad, MEASURED)
    with pytest.raises(ModelDataError, match="at least two"):
        assess(line(5), MEASURED[[0, 3]])


MEASURED_corners = np.array([np.full(621, 10.0), np.full(621, 14.0)])


class Lines:
    """An inverse: the first wish is a steady force of so many newtons times `times`."""

    def __init__(self, times):
        self.times = times

    def predict(self, given):
        return np.tile(given[:, :1] * self.times, (1, 621))


class Reads:
    """A forward model: half of the force is the first rating, the second is always 45."""

    def predict(self, given):
        return np.c_[given[:, 0] * 2, np.full(len(given), 45.0)]


def test_corners_are_all_ends_once():
    wishes = corners(7)
    assert wishes.shape == (128, 7) and set(wishes.ravel()) == {0.0, 100.0} and len(np.unique(wishes, axis=0)) == 128


def test_a_single_slider_leaves_the_others_in_the_middle():
    wishes = singles(3, 10, 90)
    assert wishes.tolist() == [[10, 50, 50], [90, 50, 50], [50, 10, 50], [50, 90, 50], [50, 50, 10], [50, 50, 90]]


def test_a_wish_that_cannot_be_had_comes_with_the_nearest_door_found():
    wishes = np.array([[10.0, 50.0], [100.0, 50.0], [100.0, 0.0]])
    answers_at_ends = extremes(Lines(0.5), wishes, Reads(), MEASURED_corners)
    assert [end.is_attained for end in answers_at_ends] == [True, True, False] and unplayable(answers_at_ends) == 0
    assert answers_at_ends[2].nearest.tolist() == [100, 45]
    assert answers_at_ends[2].plausibility.distance_N == pytest.approx(36)


def test_a_door_that_does_not_play_is_counted_and_says_why():
    answers_at_ends = extremes(Lines(0.61), np.array([[100.0, 50.0], [10.0, 50.0]]), Reads(), MEASURED_corners)
    assert unplayable(answers_at_ends) == 1
    assert answers_at_ends[0].plausibility.why == "a force of 61.0 N; at most 60 N may be made"
    assert answers_at_ends[0].nearest.tolist() == [100, 45]
