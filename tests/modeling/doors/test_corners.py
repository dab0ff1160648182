"""The ends of the sliders: doors that play, or words that name the nearest one."""

import numpy as np
import pytest

from palpate.modeling.doors.corners import corners, extremes, singles, unplayable

ANGLE = np.arange(621) / 10
MEASURED = np.array([np.full(621, 10.0), np.full(621, 14.0)])


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
    found = corners(7)
    assert found.shape == (128, 7) and set(found.ravel()) == {0.0, 100.0} and len(np.unique(found, axis=0)) == 128


def test_a_single_slider_leaves_the_others_in_the_middle():
    found = singles(3, 10, 90)
    assert found.tolist() == [[10, 50, 50], [90, 50, 50], [50, 10, 50], [50, 90, 50], [50, 50, 10], [50, 50, 90]]


def test_a_wish_that_cannot_be_had_comes_with_the_nearest_door_found():
    wishes = np.array([[10.0, 50.0], [100.0, 50.0], [100.0, 0.0]])
    found = extremes(Lines(0.5), wishes, Reads(), MEASURED)
    assert [each.had for each in found] == [True, True, False] and unplayable(found) == 0
    assert found[2].nearest.tolist() == [100, 45]
    assert found[2].plausibility.distance_N == pytest.approx(36)


def test_a_door_that_does_not_play_is_counted_and_says_why():
    found = extremes(Lines(0.61), np.array([[100.0, 50.0], [10.0, 50.0]]), Reads(), MEASURED)
    assert unplayable(found) == 1
    assert found[0].plausibility.why == "a force of 61.0 N; at most 60 N may be made"
    assert found[0].nearest.tolist() == [100, 45]
