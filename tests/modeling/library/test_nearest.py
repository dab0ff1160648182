"""Distances between textures: in JNDs, as sure as the attributes are."""

import numpy as np
import pytest

from palpate.modeling.doors.shares import JND
from palpate.modeling.library.nearest import measured, near
from tests.modeling.library.made_library import entry, made_library, rated


def two(one, other, one_se=2.0, other_se=2.0):
    return entry("A01", rated=rated(*one, se=one_se)), entry("B02", rated=rated(*other, se=other_se))


def test_one_jnd_on_every_attribute_is_a_distance_of_one():
    assert measured(*two((50, 50, 50, 50), (60, 40, 60, 40)), 4).distance == pytest.approx(1)
    found = measured(*two((50, 50, 50, 50), (90, 50, 50, 50)), 4)
    assert found.distance == pytest.approx(2)  # sqrt(4^2 / 4)
    assert found.apart == (4, 0, 0, 0)


@pytest.mark.parametrize("other", [(50, 50, 50, 50), (55, 45, 52, 50), (90, 20, 50, 40)])
@pytest.mark.parametrize("spread", [1.0, 6.0, 15.0])
def test_its_sd_and_likeness_are_those_of_drawn_textures(other, spread):
    found = measured(*two((50, 50, 50, 50), other, spread, spread / 2), 4)
    chance = np.random.Generator(np.random.PCG64(1))
    drawn = chance.normal(np.subtract(other, 50), np.hypot(spread, spread / 2), (200_000, 4)) / JND
    distances = np.sqrt((drawn**2).mean(axis=1))
    assert found.sd == pytest.approx(distances.std(), rel=0.08)
    assert found.alike == pytest.approx((np.abs(drawn) < 1).all(axis=1).mean(), abs=0.005)


def test_what_is_known_for_sure_has_no_spread():
    assert measured(*two((1, 2, 3, 4), (1, 2, 3, 4), 0, 0), 4).sd == 0
    found = measured(*two((1, 2, 3, 4), (9, 2, 3, 4), 0, 0), 4)
    assert found.sd == 0 and found.alike == 1
    assert measured(*two((1, 2, 3, 4), (11, 2, 3, 4), 0, 0), 4).alike == 0


def test_distances_are_the_same_from_either_side():
    one, other = two((10, 20, 30, 40), (44, 33, 22, 11), 3, 9)
    there, back = measured(one, other, 4), measured(other, one, 4)
    assert (there.distance, there.sd, there.alike) == pytest.approx((back.distance, back.sd, back.alike))


def test_the_nearest_come_first_and_a_texture_is_not_near_itself():
    library = made_library()
    found = near(library.textures[0], library.textures, 4)
    assert [each.entry.id for each in found] == ["T02", "T06", "T05", "T03", "T04"]


def test_an_attribute_that_is_not_known_makes_the_distance_unsure():
    one, other = two((50, 50, 50, 50), (50, 50, 50, 50))
    lacking = other.model_copy(update={"rated": other.rated.model_copy(update={"mean": (None, 50, 50, 50)})})
    assert measured(one, lacking, 4).sd > 3 * measured(one, other, 4).sd
    assert measured(one, lacking, 4).alike < 0.4 and measured(one, other, 4).alike > 0.9
