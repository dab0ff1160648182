"""Recordings by twins in no time."""

import pytest

from palpate.devices.door.opening_scene import OpeningScene
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.virtual_recording import recorded_at_once


def test_a_stimulus_beyond_what_the_simulated_sensor_bears_is_a_plain_refusal():
    heavy = OpeningScene([90.0] * 621, 2.0, "hand")
    with pytest.raises(RigError, match="door_force: a simulated sensor does not bear this stimulus.*end of its range"):
        recorded_at_once("door_sensors", heavy, 2.0, 0, 1)
