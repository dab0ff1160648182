"""An opening in front of the sensors, at any rate."""

from pathlib import Path

import numpy as np
import pytest

from palpate.devices.daq.force_torque import Settings, make
from palpate.devices.daq.gauges import gauge_volts
from palpate.devices.door.opening import RATE_HZ, opened_once
from palpate.devices.door.opening_scene import ASIDE, OpeningScene
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.profile_file import read_profile
from palpate.studies.catalogue import SHIPPED

K8 = read_profile(SHIPPED / "door_capture" / "profiles" / "K8.csv")


def rows(pieces, count):
    taken = [next(pieces)]
    while sum(map(len, taken)) < count:
        taken.append(next(pieces))
    return np.concatenate(taken)[:count]


def test_what_it_shows_is_the_opening():
    scene, opening = OpeningScene(K8, 6.0, "hand", 1, radius_m=1.1), opened_once(K8, 6.0, "hand", 1)
    wrench, place = rows(scene.wrench(RATE_HZ), 6000), rows(scene.position_mm(RATE_HZ), 6000)
    assert wrench[:, 0] == pytest.approx(opening.force_N, abs=1e-9)
    assert np.degrees(np.arctan2(place[:, 0], place[:, 1])) == pytest.approx(opening.angle_deg, abs=1e-9)
    assert np.hypot(place[:, 0], place[:, 1]) == pytest.approx(1100)


def test_a_little_of_the_pull_goes_aside():
    wrench = rows(OpeningScene(K8, 6.0, "hand").wrench(1000.0), 6000)
    aside = np.abs(wrench[:, 1:3]).max()
    assert 0 < aside <= ASIDE * np.abs(wrench[:, 0]).max() + 1e-12
    assert 0 < np.abs(wrench[:, 3:]).max() < 0.02 * np.abs(wrench[:, 0]).max()


def test_every_rate_sees_the_same_opening_and_rest_follows_it():
    scene = OpeningScene(K8, 5.0, "hand")
    fast, slow = rows(scene.position_mm(8000.0), 48_000), rows(scene.position_mm(80.0), 480)
    assert fast[::100] == pytest.approx(slow, abs=1e-9)
    assert np.ptp(fast[40_000:], axis=0).max() == 0
    assert np.abs(rows(scene.wrench(1000.0), 8000)[5000:]).max() < 0.1
    assert rows(scene.acceleration_m_s2(3000.0), 10).tolist() == [[0.0, 0.0, 9.80665]] * 10


@pytest.mark.parametrize("car", ["BC3", "FORD", "G90", "K3", "K8", "MQ4"])
def test_the_twin_of_a_force_sensor_bears_every_car(car):
    sensor = make("force", Settings(kind="force_torque", driver="twin"), Path())
    profile = read_profile(SHIPPED / "door_capture" / "profiles" / f"{car}.csv")
    wrench = rows(OpeningScene(profile, 6.0, "hand").wrench(100.0), 600)
    volts = rows(gauge_volts(sensor.transducer.matrix, None)(OpeningScene(profile, 6.0, "hand"), 100.0), 600)
    assert np.abs(wrench / sensor.transducer.calibration.rated).max() < 1
    assert np.abs(volts).max() < 9.5


def test_only_the_key_decides():
    one, again, other = (rows(OpeningScene(K8, 5.0, seed).wrench(500.0), 2500) for seed in (1, 1, 2))
    assert (one == again).all() and not (one == other).all()


def test_what_cannot_be_is_refused():
    with pytest.raises(DoorDataError, match="radius_m is 0"):
        OpeningScene(K8, 5.0, radius_m=0)
    with pytest.raises(DoorDataError, match="from 2 to 600 s"):
        OpeningScene(K8, 1.0)
    with pytest.raises(DoorDataError, match="nan samples a second"):
        OpeningScene(K8, 5.0).wrench(float("nan"))
