"""Limits of profiles: what may be made, and what a door would refuse to play."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.limits import (
    LIMIT_N,
    STEEPEST_N_DEG,
    UnplayableProfile,
    bounded,
    bounded_profiles,
    hardest,
    refusal,
    torque_profile,
)

RANDOM = np.random.Generator(np.random.PCG64(11))
FORCE = np.clip(np.cumsum(RANDOM.normal(size=621)), -40, 40)
REFUSED = [
    (np.zeros(621), "no force beyond 0 degrees: a door that does not open"),
    (np.full(621, 70.0), "63.0 N m at 0 degrees, at most 60 N m are allowed"),
    (np.r_[np.zeros(300), np.full(321, 30.0)], "270.0 N m/deg from 29.9 degrees on, at most 100 are allowed"),
    (np.ones(620), "620 points found, 621 expected"),
    (np.where(np.arange(621) == 7, np.nan, 1.0), "the force at 0.7 degrees is nan, not a finite number"),
]


@pytest.mark.parametrize("scale", [0.1, 10, 1e6, 1e300])
def test_whatever_is_bounded_is_within_the_limits_and_played(scale):
    bounded = bounded_profiles(RANDOM.normal(size=(2, 621)) * scale)
    assert np.abs(bounded).max() <= LIMIT_N
    assert np.abs(np.diff(bounded)).max() <= STEEPEST_N_DEG / 10 * (1 + 1e-12)
    assert [refusal(profile) for profile in bounded] == [None, None]


def test_what_is_within_the_limits_already_is_left_as_it_is():
    before = FORCE.copy()
    assert np.array_equal(bounded(np.clip(FORCE, -3, 3)), np.clip(FORCE, -3, 3))
    assert np.array_equal(FORCE, before)


def test_the_hardest_profile_that_may_be_made_is_played():
    force = np.array(hardest())
    assert (np.abs(force).max(), np.abs(np.diff(force)).max()) == (LIMIT_N, pytest.approx(STEEPEST_N_DEG / 10))
    assert refusal(force) is None


@pytest.mark.parametrize(("force", "words"), REFUSED)
def test_what_the_door_would_refuse_is_reported(force, words):
    assert refusal(force) == f"the profile: {words}"


def test_torques_are_force_times_radius_and_the_last_one_is_held():
    torque, end_deg = torque_profile([*[2.0] * 101, *[0.0] * 520], handle_radius_m=0.5)
    assert torque == (1.0,) * 621 and end_deg == 10.0
    with pytest.raises(UnplayableProfile, match=r"^door: 1\.0 N m at 0 degrees, at most 0\.9 N m"):
        torque_profile([2.0] * 621, 0.5, torque_Nm=0.9, what="door")


@pytest.mark.parametrize("force", [np.ones(620), np.full(621, np.nan), np.ones((1, 621))])
def test_what_is_no_profile_is_not_bounded(force):
    with pytest.raises(DoorDataError):
        bounded_profiles([force])
