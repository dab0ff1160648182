"""Recordings by twins in no time."""

import pytest

from palpate.devices.device import Block, Signal, interleaved
from palpate.devices.door.opening_scene import OpeningScene
from palpate.protocols.events import NS
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.virtual_recording import Leaping, VirtualRecorder, recorded_at_once


def test_a_stimulus_beyond_what_the_simulated_sensor_bears_is_a_plain_refusal():
    heavy = OpeningScene([90.0] * 621, 2.0, "hand")
    with pytest.raises(RigError, match="door_force: a simulated sensor does not bear this stimulus.*end of its range"):
        recorded_at_once("door_sensors", heavy, 2.0, 0, 1)


class Losing:
    """A sensor whose third sample of four a second is lost."""

    signals = (Signal("level", ("level",), ("V",), 4.0),)

    def __init__(self):
        self.blocks = [(0, 0), (1, 0), (3, 1), (4, 0)]

    def read(self, _timeout_s):
        first, lost = self.blocks.pop(0)
        return {"level": [Block(first, interleaved((1.0,)), 0, None, lost)]}


def test_samples_that_a_twin_loses_beside_a_session_are_a_refusal_and_no_shift_in_time():
    at_s = [0.5]
    recorder = VirtualRecorder(lambda: round(at_s[0] * NS), Leaping(), {"level": Losing()})
    [samples] = recorder.take()
    assert (samples.t0_ns, samples.count) == (0, 2)
    at_s[0] = 1.0
    with pytest.raises(RigError, match="the twin of level lost samples before number 3"):
        recorder.take()
