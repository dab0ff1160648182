"""A simulated opening of a door turns back into the door's profile."""

import csv

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.devices.door.commands import doors
from palpate.devices.door.opening import RATE_HZ, opened_once
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.profile_file import read_profile
from palpate.studies.catalogue import SHIPPED

CARS = ("BC3", "FORD", "G90", "K3", "K8", "MQ4")


def profile_of(car):
    return read_profile(SHIPPED / "door_capture" / "profiles" / f"{car}.csv")


def write_csv(path, column, values, rate_hz):
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time_s", column])
        rows.writerows([n / rate_hz, value] for n, value in enumerate(values))
    return str(path)


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize("seconds", [5.0, 8.0])
def test_a_recording_is_normalised_back_into_its_profile(tmp_path, car, seconds):
    profile = profile_of(car)
    opening = opened_once(profile, seconds, "round trip", car)
    force = write_csv(tmp_path / "force.csv", "force_N", opening.force_N, RATE_HZ)
    every = np.interp(
        np.arange(round(seconds * 80)) / 80, np.arange(len(opening.angle_deg)) / RATE_HZ, opening.angle_deg
    )
    angle = write_csv(tmp_path / "angle.csv", "angle_deg", every, 80.0)
    made_path = str(tmp_path / "made.csv")
    done = CliRunner().invoke(doors, ["normalise", force, "--angle-file", angle, "--zero", "--out", made_path])
    assert done.exit_code == 0, done.output
    error_N = np.array(read_profile(made_path)) - np.array(profile)
    assert np.sqrt(np.mean(error_N**2)) < 0.25
    assert np.abs(error_N[20:600]).max() < 0.8


def test_a_hand_that_rests_is_unsteady_and_lets_go():
    opening = opened_once(profile_of("K8"), 6.0, "hand")
    assert len(opening.force_N) == len(opening.angle_deg) == 6000
    assert set(opening.force_N[:600]) == {0.0} and opening.force_N[-1] == pytest.approx(0, abs=0.3)
    speed = np.diff(opening.angle_deg)[1400:4600]
    assert 0.02 < speed.std() / speed.mean() < 0.2


def test_a_door_that_opens_less_stops_there():
    assert max(opened_once(profile_of("MQ4"), 6.0, "stop").angle_deg) == pytest.approx(60.55, abs=0.05)
    assert max(opened_once(profile_of("K3"), 6.0, "stop").angle_deg) > 64


def test_only_the_key_decides():
    one, again, other = (opened_once(profile_of("K3"), 3.0, seed) for seed in (1, 1, 2))
    assert one == again and one.angle_deg != other.angle_deg


@pytest.mark.parametrize(
    ("profile", "seconds", "message"),
    [
        ((1.0,) * 620, 5.0, "621 points"),
        ((0.0,) * 621, 5.0, "zero throughout"),
        ((1.0,) * 621, 1.9, "from 2 to 600 s"),
        ((1.0,) * 621, float("nan"), "from 2 to 600 s"),
    ],
)
def test_what_cannot_be_recorded_is_refused(profile, seconds, message):
    with pytest.raises(DoorDataError, match=message):
        opened_once(profile, seconds, "refused")
