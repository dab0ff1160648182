"""A capture as a session performs it: chunks, then the reply; a pause, a fault, an end in the middle."""

import numpy as np
import pytest

from palpate.devices.device import Block, DeviceError, DeviceFault
from palpate.devices.streams.capture import Capture
from palpate.protocols.canonical import canonical
from palpate.protocols.events import Aside, Chunk, Fault, Reply
from tests.devices.streams.labs import XYZ, Desk, Fed, Time, Window, block, fed_until, sense, values

STREAM = "tool_acceleration"
NAMES = {("vibration", "acceleration"): STREAM}


class Lab:
    """One sensor that gives what is due, 0.1 s a turn, from each start on; `upset` is fed instead at a time."""

    def __init__(self, script=(), upset=(), **settings):
        self.time, self.sensor = Time(), Fed()
        self.capture = Capture({"vibration": self.sensor}, NAMES, **settings)
        self.desk, self.window = Desk(self.time, list(script)), Window(self.turn)
        self.upset, self.given, self.starts = list(upset), 0, 0

    def turn(self):
        self.time.pass_s(0.1)
        if self.sensor.log.count("start") != self.starts:
            self.starts, self.given = self.sensor.log.count("start"), 0
        if self.sensor.log[-1:] != ["start"]:
            return
        if self.upset and self.time() >= self.upset[0][0] * 10**9:
            self.sensor.feed(self.upset.pop(0)[1])
            fed_until(lambda: self.capture._last.fault() is not None)
            return
        self.sensor.feed(block(self.given, 100, at_s=self.time() / 1e9))
        self.given += 100

    def perform_until_end(self, request, most=100):
        """All that performing the request comes to, its reply or fault last."""
        outcomes = []
        while len(outcomes) < most:
            outcomes.append(self.capture.perform(request, self.window, self.desk, self.time))
            if isinstance(outcomes[-1], Reply | Fault):
                return outcomes
        raise AssertionError(outcomes)


def kinds(outcomes):
    return [type(outcome).__name__ for outcome in outcomes]


def test_a_recording_comes_as_chunks_and_then_its_reply():
    lab = Lab()
    *chunks, reply = lab.perform_until_end(sense(2.0))
    assert kinds(chunks) == ["Chunk"] * 4
    assert sorted(values(chunks, STREAM)) == list(range(2000))
    assert (reply.value["recorded"], reply.value["seconds"], reply.value["by"]) == (True, 2.0, "rig")
    summary = reply.value["streams"][STREAM]
    assert (summary["samples"], summary["lost"], summary["calibration"]) == (2000, 0, XYZ.calibration)
    canonical(reply.value)
    assert lab.sensor.log == ["expect None", "start", "stop"]
    assert set(lab.window.pages) == {"recording"}


def test_a_twin_receives_the_scene_that_it_will_sense():
    lab = Lab(scene_for=lambda request: f"strokes of {request.trial.stimulus.id}")
    lab.perform_until_end(sense(0.2))
    assert lab.sensor.log[0] == "expect strokes of T07"


def test_the_experimenter_sees_level_samples_and_losses_while_it_lasts():
    lab = Lab()
    lab.perform_until_end(sense(2.0))
    levels = [status[STREAM] for status in lab.desk.seen if status.get(STREAM)]
    assert levels[0].startswith("RMS ") and levels[0].endswith("m/s^2, 500 samples, 0 lost") and len(levels) == 3
    assert lab.desk.states == {}


def test_a_pause_breaks_a_recording_off_and_the_trial_is_repeated():
    lab = Lab(script=[(0.7, {"do": "pause"}), (5.0, {"do": "note", "text": "phone"}), (9.0, {"do": "go_on"})])
    outcomes = lab.perform_until_end(sense(2.0))
    assert kinds(outcomes) == ["Chunk", "Aside", "Chunk", "Aside", "Aside", "Fault"]
    assert sorted(values([outcome for outcome in outcomes if isinstance(outcome, Chunk)], STREAM)) == list(range(700))
    assert outcomes[-1].value == {
        "device": "session",
        "what": "interrupted",
        "message": "a pause broke the recording off",
    }
    assert lab.sensor.log == ["expect None", "start", "stop", "safe"]
    again = lab.perform_until_end(sense(2.0))
    assert kinds(again) == ["Chunk"] * 4 + ["Reply"] and again[-1].value["seconds"] == 2.0
    assert lab.desk.prompts == []  # no device failed: nothing is to be put right


@pytest.mark.parametrize("do", [{"do": "repeat", "which": "this"}, {"do": "abort", "text": "ill"}])
def test_to_repeat_and_to_abort_stop_it_at_once(do):
    lab = Lab(script=[(0.7, do)])
    request = sense(2.0)
    first, second = (lab.capture.perform(request, lab.window, lab.desk, lab.time) for _ in range(2))
    assert isinstance(first, Chunk) and second == Aside(do)
    assert lab.sensor.log == ["expect None", "start", "stop", "safe"]
    assert lab.desk.states == {}
    assert kinds(lab.perform_until_end(sense(0.5)))[-1] == "Reply"


def test_a_note_changes_nothing():
    lab = Lab(script=[(0.7, {"do": "note", "text": "loud outside"})])
    outcomes = lab.perform_until_end(sense(2.0))
    assert kinds(outcomes).count("Aside") == 1 and outcomes[-1].value["seconds"] == 2.0
    assert sorted(values([outcome for outcome in outcomes if isinstance(outcome, Chunk)], STREAM)) == list(range(2000))


def test_a_fault_makes_every_sensor_safe_then_stores_the_samples_then_is_reported():
    lab = Lab(upset=[(0.8, DeviceFault("vibration", "overrun", "the buffer ran over"))])
    outcomes = lab.perform_until_end(sense(2.0))
    assert kinds(outcomes) == ["Chunk", "Chunk", "Fault"]
    assert lab.sensor.log == ["expect None", "start", "stop", "safe"]
    assert sorted(values(outcomes[:2], STREAM)) == list(range(700))
    assert outcomes[-1].value == {"device": "vibration", "what": "overrun", "message": "vibration: the buffer ran over"}
    assert lab.desk.states == {}


def test_after_a_fault_nothing_is_recorded_before_somebody_has_confirmed():
    lab = Lab(upset=[(0.8, OSError("unplugged"))], script=[(20.0, {"do": "note", "text": "was the cable"})])
    lab.perform_until_end(sense(2.0))
    lab.desk.confirms, before = False, list(lab.sensor.log)
    request = sense(2.0)
    assert isinstance(lab.capture.perform(request, lab.window, lab.desk, lab.time), Aside)
    assert lab.sensor.log == before
    assert lab.desk.prompts == ["vibration: OSError: unplugged. Put it right, then confirm."]
    lab.desk.confirms = True
    outcomes = lab.perform_until_end(request)
    assert kinds(outcomes) == ["Chunk"] * 4 + ["Reply"] and lab.desk.demanded is None
    lab.perform_until_end(sense(0.5))
    assert len(lab.desk.prompts) == 1  # asked for once


def test_a_sensor_that_cannot_be_had_any_more_is_a_fault_and_no_end_of_the_session():
    lab = Lab()
    lab.sensor.at_start = DeviceError("vibration: Dev1 is not there")
    outcomes = lab.perform_until_end(sense(2.0))
    assert kinds(outcomes) == ["Fault"] and outcomes[0].value["message"] == "vibration: Dev1 is not there"
    assert lab.sensor.log[-2:] == ["stop", "safe"]
    lab.sensor.at_start = None
    assert kinds(lab.perform_until_end(sense(0.5)))[-1] == "Reply"


def test_what_cannot_be_made_safe_is_reported_with_the_fault():
    lab = Lab(upset=[(0.3, DeviceFault("vibration", "silent", "gone"))])
    lab.sensor.at_stop = OSError("no answer")
    (*_, fault) = lab.perform_until_end(sense(2.0))
    assert fault.value["message"] == "vibration: gone; recording could not be made safe: OSError: no answer"
    assert lab.sensor.log[-1] == "safe"


class Quits(BaseException):
    """As palpate.studies.sessions.interrupts.Interrupted: no Exception."""


def test_the_end_of_a_run_in_a_recording_leaves_nothing_running():
    lab = Lab(script=[(0.3, Quits())])
    with pytest.raises(Quits):
        lab.perform_until_end(sense(2.0))
    assert lab.sensor.log[-1] == "stop" and not lab.capture._last.hanging()


def test_another_request_stops_the_one_that_was_given_up():
    lab = Lab()
    lab.capture.perform(sense(2.0), lab.window, lab.desk, lab.time)
    outcomes = lab.perform_until_end(sense(0.5))
    assert lab.sensor.log == ["expect None", "start", "stop"] * 2
    assert sorted(values(outcomes[:-1], STREAM)) == list(range(500))


def test_close_stops_it_and_may_be_called_at_any_time():
    lab = Lab()
    lab.capture.close()
    lab.capture.perform(sense(2.0), lab.window, lab.desk, lab.time)
    lab.capture.close()
    lab.capture.close()
    assert lab.sensor.log == ["expect None", "start", "stop"]


def test_a_short_recording_without_samples_is_no_recording():
    lab = Lab()
    lab.window.turn = lambda: lab.time.pass_s(0.1)
    (fault,) = lab.perform_until_end(sense(0.5))
    assert (fault.value["what"], fault.value["message"]) == ("silent", f"vibration: {STREAM}: nothing in 0.5 s")
    assert lab.sensor.log == ["expect None", "start", "stop", "safe"]


def test_a_short_recording_without_numbers_is_no_recording():
    lab = Lab()
    lab.window.turn = lambda: (lab.time.pass_s(0.1), lab.sensor.feed(no_numbers(lab.time)))
    *chunks, fault = lab.perform_until_end(sense(0.5))
    assert fault.value["what"] == "not_a_number"
    assert fault.value["message"] == f"vibration: {STREAM}: no numbers in 0.5 s"
    assert sorted(values(chunks, STREAM)) == list(range(500))  # kept as it came


def no_numbers(time):
    return Block(round(time() / 1e6) - 100, np.full(300, np.nan, "<f4").tobytes(), time())


def raises(error):
    raise error


@pytest.mark.parametrize(
    ("last", "what"),
    [(lambda: raises(OSError("unplugged")), "link_lost"), (lambda: {"acceleration": (block(150, 10),)}, "firmware")],
)
def test_what_fails_last_is_a_fault_and_no_recording(last, what):
    """The read that follows the end raises, or gives what cannot be true."""
    lab = Lab()
    read = lab.sensor.read
    lab.sensor.read = lambda timeout_s: read(timeout_s) if timeout_s else last()
    *chunks, fault = lab.perform_until_end(sense(2.0))
    assert isinstance(fault, Fault) and fault.value["what"] == what
    assert sorted(values(chunks, STREAM)) == list(range(2000))


def test_a_sensor_that_cannot_be_stopped_at_the_end_is_a_fault_and_no_end_of_the_session():
    lab = Lab()
    lab.sensor.at_stop = OSError("no answer")
    *chunks, fault = lab.perform_until_end(sense(2.0))
    assert fault.value == {"device": "vibration", "what": "link_lost", "message": "vibration: OSError: no answer"}
    assert sorted(values(chunks, STREAM)) == list(range(2000)) and lab.sensor.log[-1] == "safe"


def test_where_a_sensor_neither_starts_nor_stops_the_first_error_is_reported():
    lab = Lab()
    lab.sensor.at_start, lab.sensor.at_stop = DeviceError("vibration: Dev1 is not there"), OSError("no answer")
    (fault,) = lab.perform_until_end(sense(2.0))
    assert fault.value["message"] == "vibration: Dev1 is not there"
