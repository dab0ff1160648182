"""Sensors on threads of their own: samples are taken, errors reported, and missing samples are gaps."""

import sys
import threading
from dataclasses import replace

import numpy as np
import pytest

from palpate.devices.device import Block, DeviceError, DeviceFault, Signal
from palpate.devices.streams import reader
from palpate.devices.streams.reader import NO_ROOM
from palpate.devices.streams.recording import NOT_A_NUMBER_S, TURN_S, Recording
from palpate.devices.streams.stream import TAKE_BYTES
from palpate.protocols.canonical import canonical
from tests.devices.streams.labs import XYZ, Fed, Time, block, fed_until, values

POSITION = Signal("position", ("x", "y", "z"), ("mm",) * 3, 100.0, "tracker")


@pytest.fixture
def time():
    return Time()


@pytest.fixture
def begin_recording(time):
    """Recordings under way; all are ended."""
    recordings = []

    def begin(*sensors, **settings):
        one = Recording({sensor.name: sensor for sensor in sensors}, time, **settings)
        recordings.append(one)
        one.start()
        return one

    yield begin
    for one in recordings:
        one.end()


def taken(recording):
    chunks = []
    while recording.due():
        chunks.append(recording.take())
    return chunks


def test_two_sensors_are_recorded_chunk_by_chunk_under_the_names_they_are_given(begin_recording, time):
    vibration, tracker = Fed(), Fed("tracker", POSITION)
    one = begin_recording(vibration, tracker, names={("tracker", "position"): "tool_position"})
    assert not one.due()
    vibration.feed(block(0, 100), block(100, 100))
    tracker.feed(block(0, 20, rate_hz=100.0))
    assert not one.due()
    time.pass_s(0.5)
    (chunk,) = taken(one)
    assert [(piece.stream, piece.count) for piece in chunk.samples] == [
        ("vibration_acceleration", 200), ("tool_position", 20),
    ]  # fmt: skip
    assert set(chunk.value["streams"]) == {"vibration_acceleration", "tool_position"}
    canonical(chunk.value)
    vibration.feed(block(200, 50))
    summary = one.stop()
    (last,) = taken(one)
    assert [piece.first for piece in last.samples] == [200] and set(last.value["streams"]) == {"vibration_acceleration"}
    assert summary["vibration_acceleration"]["samples"] == 250 and summary["tool_position"]["lost"] == 0
    assert vibration.log == ["start", "stop"]


def test_what_a_late_thread_had_not_read_at_the_end_is_read_then(begin_recording):
    """A processor that is busy elsewhere: its last read of a second's samples comes after the end."""
    sensor, held = Fed(), threading.Event()
    read, sensor.read = sensor.read, lambda seconds: {} if held.is_set() and seconds else read(seconds)
    one = begin_recording(sensor)
    held.set()
    for first in (0, 100, 200):
        sensor.given.put(block(first, 100))
    assert one.stop()["vibration_acceleration"]["samples"] == 300


def test_two_streams_of_one_name_are_refused(time):
    with pytest.raises(DeviceError, match="two streams would be named 'tool'"):
        Recording({"a": Fed(), "b": Fed()}, time, names={(device, "acceleration"): "tool" for device in "ab"})


def test_a_late_writer_loses_what_had_no_room_and_the_loss_is_reported(begin_recording, time):
    """A disk that stands still for three seconds, with room for one: what is stored is stored whole."""
    sensor = Fed()
    one = begin_recording(sensor, room_s=1.0)
    for second in range(3):
        sensor.feed(*(block(1000 * second + first, 10) for first in range(0, 1000, 10)))
        time.pass_s(1.0)
    chunks = taken_until_empty(one)
    sensor.feed(block(3000, 10))
    summary = one.stop()["vibration_acceleration"]
    chunks += taken(one)
    samples = values(chunks, "vibration_acceleration")
    assert summary["samples"] + summary["lost"] == 3010 and 0 < summary["lost"] < 2000
    assert len(samples) == summary["samples"] and all(row == (n, n, n) for n, row in samples.items())
    gaps = [gap for chunk in chunks for gap in chunk.value["streams"]["vibration_acceleration"].get("gaps", [])]
    assert gaps == [[3000 - summary["lost"], summary["lost"], NO_ROOM]]
    assert one.fault() is None


def taken_until_empty(recording):
    chunks = []
    while any(stream.ring.held for stream in recording.streams.values()):
        chunks.append(recording.take())
    return chunks


def test_what_piles_up_is_taken_in_chunks_of_bounded_size_and_at_once(begin_recording, time):
    sensor = Fed(signal=replace(XYZ, rate_hz=50_000.0))
    one = begin_recording(sensor)
    sensor.feed(*(block(first, 5000, rate_hz=50_000.0) for first in range(0, 250_000, 5000)))
    chunks = []
    while one.due():
        chunks.append(one.take())
    assert len(chunks) == 2  # the rest is less than a chunk holds, and not due yet
    assert all(sum(len(piece.data) for piece in chunk.samples) <= TAKE_BYTES + 60_000 for chunk in chunks)
    one.stop()
    assert len(values(chunks + taken(one), "vibration_acceleration")) == 250_000


def test_a_silent_sensor_is_a_fault_that_stays(begin_recording, time):
    sensor = Fed()
    one = begin_recording(sensor)
    sensor.feed(block(0, 100))
    time.pass_s(1.0)
    assert one.fault() is None
    time.pass_s(0.5)
    fault = one.fault()
    assert (fault.device, fault.what) == ("vibration", "silent") and "nothing for 1.5 s (limit 1 s)" in str(fault)
    sensor.feed(block(100, 100))
    assert one.fault() is fault


def test_a_sensor_may_take_longer_over_its_first_samples(begin_recording, time):
    one = begin_recording(Fed())
    time.pass_s(3.0)
    assert one.fault() is None
    time.pass_s(0.1)
    assert "nothing for 3.1 s (limit 3 s)" in str(one.fault())


def test_a_slow_sensor_may_be_silent_for_longer_and_one_without_a_rate_for_ever(begin_recording, time):
    one = begin_recording(Fed(signal=replace(XYZ, rate_hz=2.0)), Fed("events", replace(XYZ, rate_hz=0.0)))
    time.pass_s(9.9)
    assert one.fault() is None
    time.pass_s(0.2)
    assert one.fault().device == "vibration"


@pytest.mark.parametrize(
    ("raised", "what", "message"),
    [
        (DeviceFault("vibration", "overrun", "the buffer ran over"), "overrun", "the buffer ran over"),
        (OSError(5, "Input/output error"), "link_lost", "the device reports an input/output error"),
        (ZeroDivisionError("division by zero"), "refused", "ZeroDivisionError: division by zero"),
    ],
)
def test_a_sensor_that_raises_is_a_fault_and_what_it_gave_before_is_there(begin_recording, raised, what, message):
    sensor, other = Fed(), Fed("tracker", POSITION)
    one = begin_recording(sensor, other)
    sensor.feed(block(0, 100), raised)
    fed_until(lambda: one.fault() is not None)
    assert (one.fault().what, str(one.fault())) == (what, message)
    one.end()
    assert len(values(taken(one), "vibration_acceleration")) == 100
    assert sensor.log == other.log == ["start", "stop"]


def bad(first, count):
    return Block(first, np.full(3 * count, np.nan, "<f4").tobytes(), first)


def test_a_flood_of_no_numbers_is_a_fault_and_a_covered_marker_is_none(begin_recording, time):
    sensor, tracker = Fed(), Fed("tracker", POSITION)
    one = begin_recording(sensor, tracker, may_hide=["tracker_position"])
    limit = round(NOT_A_NUMBER_S * 1000)
    sensor.feed(block(0, 10), bad(10, limit - 1))
    tracker.feed(bad(0, 1000))
    time.pass_s(0.5)
    taken(one)
    assert one.fault() is None
    sensor.feed(bad(9 + limit, 1))
    time.pass_s(0.5)
    (chunk,) = taken(one)
    assert one.fault().what == "not_a_number" and "no numbers for 1.0 s" in str(one.fault())
    assert chunk.value["streams"]["vibration_acceleration"]["not_a_number"] == 1
    assert one.stop()["tracker_position"]["not_a_number"] == 1000


def test_samples_that_nobody_announced_are_a_fault(begin_recording):
    sensor = Fed()
    one = begin_recording(sensor)
    sensor.signal = replace(XYZ, name="temperature")
    sensor.given.put(block(0, 1))
    fed_until(lambda: one.fault() is not None)
    assert "'temperature' came, which it does not have" in str(one.fault())
    sensor.signal = XYZ


@pytest.mark.parametrize("error", [DeviceError("port /dev/ttyUSB0 is gone"), OSError("no such device")])
def test_where_one_sensor_does_not_start_none_goes_on(time, error):
    first, second = Fed(), Fed("tracker", POSITION, at_start=error)
    one = Recording({"vibration": first, "tracker": second}, time)
    with pytest.raises(DeviceFault) as caught:
        one.start()
    assert caught.value.device == "tracker" and str(error) in str(caught.value)
    assert first.log == ["start", "stop"] and not one.hanging()


def test_a_driver_that_hangs_is_reported_and_the_others_are_stopped(begin_recording, monkeypatch):
    monkeypatch.setattr(reader, "GONE_S", 0.05)
    let_go, inside = threading.Event(), threading.Event()

    class Hangs(Fed):
        def read(self, timeout_s):
            inside.set()
            let_go.wait(10)
            return {}

    stuck, well = Hangs("tracker", POSITION), Fed()
    one = begin_recording(stuck, well)
    assert inside.wait(10)
    one.end()
    assert (one.fault().what, one.fault().device, one.hanging()) == ("stuck", "tracker", ["tracker"])
    assert well.log[-1] == stuck.log[-1] == "stop"
    let_go.set()
    fed_until(lambda: not one.hanging())


def test_a_sensor_that_cannot_be_stopped_does_not_keep_the_others_running(begin_recording):
    sensors = [Fed("a", at_stop=DeviceFault("a", "refused", "no")), Fed("b"), Fed("c")]
    one = begin_recording(*sensors)
    with pytest.raises(DeviceFault):
        one.end()
    assert [sensor.log[-1] for sensor in sensors] == ["stop"] * 3
    one.end()  # once


def test_threads_take_turns_fast_while_there_are_readers_and_as_before_then(begin_recording):
    before = sys.getswitchinterval()
    one = begin_recording(Fed())
    assert sys.getswitchinterval() == pytest.approx(TURN_S)
    one.stop()
    assert sys.getswitchinterval() == pytest.approx(before)


def test_stopping_twice_gives_the_same_result(begin_recording):
    sensor = Fed()
    one = begin_recording(sensor)
    sensor.feed(block(0, 100))
    first = one.stop()
    assert one.stop() == first and len(taken(one)) == 1 and one.stop() == first
    assert not one.due()
