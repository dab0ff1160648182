"""The rig's side of doors: what modeling is handed instead of a device."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from palpate.devices.door.side import DoorSide
from palpate.signals.doors.features import describe
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.model_features import FEATURES
from palpate.signals.doors.playable import LIMIT_N, STEEPEST_N_DEG, bounded, hardest
from tests.signals.models.cards import feeling

RANDOM = np.random.Generator(np.random.PCG64(11))
FORCE = np.clip(np.cumsum(RANDOM.normal(size=621)), -40, 40)


def test_it_is_a_value_that_pickles():
    side = DoorSide()
    assert pickle.loads(pickle.dumps(side)) == side
    assert (side.feature_names, side.limit_N, side.steepest_N_deg) == (FEATURES, LIMIT_N, STEEPEST_N_DEG)
    assert side.features(FORCE[None]).shape == (1, len(FEATURES))
    assert side.described(FORCE) == describe(FORCE)


@pytest.mark.parametrize("scale", [0.1, 10, 1e6, 1e300])
def test_whatever_is_bounded_is_within_the_limits_and_played(scale):
    side = DoorSide()
    made = side.bounded(RANDOM.normal(size=621) * scale)
    assert np.abs(made).max() <= LIMIT_N
    assert np.abs(np.diff(made)).max() <= STEEPEST_N_DEG / 10 * (1 + 1e-12)
    assert side.refusal(made) is None


def test_what_is_within_the_limits_already_is_left_as_it_is():
    before = FORCE.copy()
    assert np.array_equal(bounded(np.clip(FORCE, -3, 3)), np.clip(FORCE, -3, 3))
    assert np.array_equal(FORCE, before)


def test_the_hardest_profile_that_may_be_made_is_played():
    force = np.array(hardest())
    assert (np.abs(force).max(), np.abs(np.diff(force)).max()) == (LIMIT_N, pytest.approx(STEEPEST_N_DEG / 10))
    assert DoorSide().refusal(force) is None


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (np.zeros(621), "no force beyond 0 degrees: a door that does not open"),
        (np.full(621, 70.0), "63.0 N m at 0 degrees, at most 60 N m are allowed"),
        (np.r_[np.zeros(300), np.full(321, 30.0)], "270.0 N m/deg from 29.9 degrees on, at most 100 are allowed"),
        (np.ones(620), "620 points found, 621 expected"),
        (np.where(np.arange(621) == 7, np.nan, 1.0), "the force at 0.7 degrees is nan"),
    ],
)
def test_what_the_door_would_refuse_is_said(force, words):
    assert words in str(DoorSide().refusal(force))


@pytest.mark.parametrize("force", [np.ones(620), np.full(621, np.nan), np.ones((1, 621))])
def test_what_is_no_profile_is_refused(force):
    for ask in (DoorSide().described, DoorSide().bounded):
        with pytest.raises(DoorDataError):
            ask(force)


def test_a_model_is_loaded_from_its_card(tmp_path):
    assert DoorSide().load(feeling(tmp_path)).run(np.full(621, 5.0)) == pytest.approx([5, 60])
    with pytest.raises(ValueError, match="there is no such file"):
        DoorSide().load(tmp_path / "other.json")
