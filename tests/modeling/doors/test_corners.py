"""The ends of the sliders: doors that play, or words that name the nearest one."""

import numpy as np
import pytest

from devices.door.side import DoorSide
from modeling.doors.corners import corners, extremes, responses, singles, unplayable
from modeling.doors.perceivers import Perceivers
from modeling.doors.scaling import Scaling

ANGLE = np.arange(621) / 10
MEASURED = np.array([np.full(621, 10.0), np.full(621, 14.0)])
NAMES = ("Light", "Soft")


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


def test_a_wish_that_cannot_be_had_names_the_nearest_door():
    wishes = np.array([[10.0, 50.0], [100.0, 50.0], [100.0, 0.0]])
    found = extremes(Lines(0.5), wishes, Reads(), MEASURED, DoorSide())
    assert [each.had for each in found] == [True, True, False] and unplayable(found) == 0
    assert found[1].words(NAMES) == "can be had"
    assert found[2].words(NAMES) == "cannot be had; the nearest door found has Soft 45 for 0"
    assert found[2].plausibility.distance_N == pytest.approx(36)


def test_a_door_that_does_not_play_is_counted_and_says_why():
    found = extremes(Lines(0.61), np.array([[100.0, 50.0], [10.0, 50.0]]), Reads(), MEASURED, DoorSide())
    assert unplayable(found) == 1
    assert found[0].words(NAMES) == "cannot be played: a force of 61.0 N; at most 60 N may be made"
    assert found[0].nearest.tolist() == [100, 45]


def test_responses_tell_how_far_people_follow_a_slider():
    """Whoever wishes for more of the first attribute gets a heavier door; the other sliders do nothing."""
    people = Perceivers(DoorSide(), people=6)
    found = responses(Lines(0.3), people, Scaling(force_N=(0.0, 60.0), rating=(-10.0, 10.0)))
    assert [each.attribute for each in found] == list(people.attributes)
    first = found[0]
    assert first.moved > 20 and first.others > 0
    assert all(each.moved == 0 and each.others == 0 for each in found[1:])
    heavy, light = people.rate(np.full((1, 621), 27.0)), people.rate(np.full((1, 621), 3.0))
    assert first.moved == pytest.approx((heavy - light)[0, 0] * 5)
    assert first.others == pytest.approx(np.abs(heavy - light)[0, 1:].mean() * 5)
