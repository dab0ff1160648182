"""Wished ratings, the profile that is made of them, and what it is rated."""

import numpy as np
import pytest

from palpate.modeling.doors.data import Scaling
from palpate.modeling.doors.profile_scores import Perceivers, loop_error
from palpate.modeling.evaluate.rows import ModelDataError

SCALING = Scaling(force_N=(-20.0, 60.0), rating=(-5.0, 5.0))
DOORS = np.array([20 * np.sin(np.linspace(0, k, 621)) + 5 for k in (3, 9, 15)])


class Says:
    """A forward model that says the same of every door."""

    def __init__(self, *ratings):
        self.ratings = np.array(ratings, dtype=float)

    def predict(self, given):
        return np.tile(self.ratings, (len(given), 1))


def test_people_and_model_rate_the_generated_profiles_on_the_models_scale():
    """-5 to 5 on the study's scale is 0..100 here, so a felt -7 is -20: nothing is clipped away."""
    people = Perceivers(people=5)
    wish = np.full((3, 7), 50.0)
    loop = loop_error(wish, DOORS, Says(1, 2, 3, 4, 5, 6, 7), people, SCALING)
    assert loop.perceived == pytest.approx((people.rate(DOORS) + 5) * 10)
    assert loop.felt == pytest.approx((people.felt(DOORS) + 5) * 10)
    assert loop.predicted.tolist() == [[1, 2, 3, 4, 5, 6, 7]] * 3
    assert np.array_equal(loop.wish, wish)


def test_wishes_without_a_profile_each_are_refused():
    people = Perceivers(people=1)
    with pytest.raises(ModelDataError, match="2 wishes and 3 made profiles"):
        loop_error(np.zeros((2, 7)), DOORS, Says(*range(7)), people, SCALING)
    with pytest.raises(ModelDataError, match="7 numbers a row"):
        loop_error(np.zeros((3, 6)), DOORS, Says(*range(7)), people, SCALING)
