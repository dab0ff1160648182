"""Wished ratings, the profile that is made of them, and what it is rated."""

import numpy as np
import pytest

from devices.door.side import DoorSide
from modeling.doors.data import ModelDataError
from modeling.doors.loop import Loop, joined, loop_error
from modeling.doors.perceivers import Perceivers
from modeling.doors.scaling import Scaling

SCALING = Scaling(force_N=(-20.0, 60.0), rating=(-5.0, 5.0))
DOORS = np.array([20 * np.sin(np.linspace(0, k, 621)) + 5 for k in (3, 9, 15)])


class Says:
    """A forward model that says the same of every door."""

    def __init__(self, *ratings):
        self.ratings = np.array(ratings, dtype=float)

    def predict(self, given):
        return np.tile(self.ratings, (len(given), 1))


def test_the_errors_are_means_over_wishes_by_attribute():
    wish = np.array([[0.0, 50.0], [100.0, 50.0]])
    off = np.array([[[1, -2], [3, 4]], [[5, 0], [5, 0]], [[3, 0], [4, 0]]])
    loop = Loop(wish, *(wish + off))
    assert loop.by_model.tolist() == [2, 3] and loop.by_people.tolist() == [5, 0]
    assert loop.without_noise.tolist() == [3.5, 0] and loop.raters.tolist() == [1.5, 0]
    assert loop.raters_share == pytest.approx(1 - (9 + 16) / (25 + 25))
    rows = loop.rows(("Light", "Soft"))
    assert [row["attribute"] for row in rows] == ["Light", "Soft", "mean"]
    assert (rows[0]["by_people"], rows[1]["by_model"], rows[2]["by_people"]) == (5, 3, 2.5)


def test_a_perfect_loop_has_no_error_and_no_share_of_it():
    wish = np.full((2, 3), 40.0)
    perfect = Loop(wish, wish, wish, wish)
    assert perfect.raters_share == 0 and perfect.by_people.tolist() == [0, 0, 0]


def test_people_and_model_are_asked_about_the_made_profiles_on_the_models_scale():
    """-5 to 5 on the study's scale is 0..100 here, so a felt -7 is -20: nothing is clipped away."""
    people = Perceivers(DoorSide(), people=5)
    wish = np.full((3, 7), 50.0)
    loop = loop_error(wish, DOORS, Says(1, 2, 3, 4, 5, 6, 7), people, SCALING)
    assert loop.perceived == pytest.approx((people.rate(DOORS) + 5) * 10)
    assert loop.felt == pytest.approx((people.felt(DOORS) + 5) * 10)
    assert loop.by_model.tolist() == [49, 48, 47, 46, 45, 44, 43]


def test_folds_join_to_one_loop():
    people = Perceivers(DoorSide(), people=2)
    wish = np.linspace(0, 100, 21).reshape(3, 7)
    whole = loop_error(wish, DOORS, Says(*range(7)), people, SCALING)
    parts = [loop_error(wish[i : i + 1], DOORS[i : i + 1], Says(*range(7)), people, SCALING) for i in range(3)]
    assert np.array_equal(joined(parts).perceived, whole.perceived) and joined(parts).raters_share == whole.raters_share


def test_wishes_without_a_profile_each_are_refused():
    people = Perceivers(DoorSide(), people=1)
    with pytest.raises(ModelDataError, match="2 wishes and 3 made profiles"):
        loop_error(np.zeros((2, 7)), DOORS, Says(*range(7)), people, SCALING)
    with pytest.raises(ModelDataError, match="7 numbers a row"):
        loop_error(np.zeros((3, 6)), DOORS, Says(*range(7)), people, SCALING)
