import csv
import math
from pathlib import Path

import pytest

from palpate.devices.door.link.device import Settings, make
from palpate.devices.door.link.limits import Limits, ProfileRefused, profile_for_door
from palpate.signals.doors.grid import POINTS
from palpate.signals.doors.limits import refusal
from palpate.signals.doors.profile_file import read_profile
from palpate.studies.catalogue import SHIPPED
from tests.signals.doors.test_limits import REFUSED

DOORS = SHIPPED / "door_ratings"
FLAT = [10.0] * POINTS


def test_every_profile_of_the_door_study_may_be_played_with_the_usual_limits():
    with (DOORS / "stimuli.csv").open(encoding="utf-8", newline="") as table:
        files = [row["file"] for row in csv.DictReader(table)]
    assert len(files) == 90
    for file in files:
        profile_for_door(read_profile(DOORS / file), 0.9, Limits(), file)


def test_torque_is_force_times_the_radius_of_the_handle():
    profile = profile_for_door(FLAT, 0.5, Limits())
    assert set(profile.torque_Nm) == {5.0} and profile.end_deg == 62.0


def test_the_padding_is_held_and_the_stop_stands_at_the_end_of_the_motion():
    profile = profile_for_door([10.0] * 550 + [12.0] + [0.0] * 70, 1.0, Limits())
    assert profile.end_deg == pytest.approx(55.0)
    assert set(profile.torque_Nm[550:]) == {12.0}


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_force_that_is_no_number_is_refused_with_its_angle(value):
    with pytest.raises(ProfileRefused, match=r"P7: the force at 12.3 degrees is (nan|inf)"):
        profile_for_door([*FLAT[:123], value, *FLAT[124:]], 0.9, Limits(), "P7")


@pytest.mark.parametrize(
    ("force", "message"),
    [
        (FLAT[:-1], "620 points found, 621 expected"),
        ([0.0] * POINTS, "a door that does not open"),
        ([70.0] * POINTS, r"63.0 N m at 0 degrees, at most 60 N m"),
        ([-70.0] * POINTS, r"-63.0 N m at 0 degrees"),
        ([5.0] * 300 + [25.0] * 321, r"180.0 N m/deg from 29.9 degrees on, at most 100"),
    ],
)
def test_what_must_not_be_played_is_refused_by_the_limit_and_where(force, message):
    with pytest.raises(ProfileRefused, match=message):
        profile_for_door(force, 0.9, Limits())


def test_a_profile_at_the_limit_is_allowed():
    profile_for_door([60.0] * POINTS, 1.0, Limits())
    with pytest.raises(ProfileRefused):
        profile_for_door([60.0] * POINTS, 1.0, Limits(torque_Nm=59.9))


@pytest.mark.parametrize(("force", "words"), REFUSED)
def test_a_twin_that_is_set_up_by_default_refuses_what_the_default_limits_do(force, words):
    door = make("door", Settings(kind="door", driver="twin"), Path())
    with pytest.raises(ProfileRefused) as refused:
        door.check(force.tolist(), "the profile")
    assert str(refused.value) == refusal(force) == f"the profile: {words}"
