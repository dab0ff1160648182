"""The thermometer against dialogues of bytes: sound ones, ones in a wrong mode, and ones that break in the middle."""

from __future__ import annotations

import array
import threading
from dataclasses import replace

import pytest
from pydantic import ValidationError

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.instruments.thermometer import KIND, Settings, Thermometer, connect_serial, make
from palpate.devices.streams.beside import BesideRecorder
from palpate.protocols.events import NS, Aside, Chunk, Fault, Present, Reply
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial
from palpate.studies.live.world import clock_from
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.rig import RecordedBeside
from palpate.studies.simulation.rig import simulated
from palpate.studies.simulation.virtual_recording import VirtualRecorder
from tests.studies.labs import Lab

SCPI = {b"*IDN?\n": [b"ACME,T1,0042,1.3\n"], b"UNIT:TEMP?\n": [b"C\n"], b"MEAS:TEMP?\n": [b"+3.2791E+01\n"]}
LAKE_SHORE = {
    b"*IDN?\r\n": [b"LSCI,MODEL218S,218ABC,010205\r\n"], b"CRDG? 3\r\n": [b"+022.417\r\n"],
    b"RDGST? 3\r\n": [b"000\r\n"],
}  # fmt: skip
LINES = {b"": [b".41\r\n", b"32.5\r\n"]}
READ = b"MEAS:TEMP?\n"


class Line:
    """A device that answers each request with its answers in turn, the last one for ever; an exception is raised."""

    def __init__(self, dialogue):
        self.dialogue = {request: list(answers) for request, answers in dialogue.items()}
        self.sent, self.coming, self.closed, self.in_waiting = [], [], False, 0

    def write(self, data):
        self.sent.append(data)
        self.coming.append(data)

    def readline(self):
        request = self.coming.pop() if self.coming else b""
        answers = self.dialogue.get(request, [b""])
        answer = answers.pop(0) if len(answers) > 1 else answers[0]
        if isinstance(answer, Exception):
            raise answer
        return answer

    def reset_input_buffer(self):
        self.coming.clear()

    def close(self):
        self.closed = True


class Clock:
    def __init__(self):
        self.s = 0.0

    def __call__(self):
        return round(self.s * NS)


def thermometer(dialogue, **settings):
    lines = []

    def connect(_thermometer):
        lines.append(Line(dialogue))
        return lines[-1]

    given = {"kind": "thermometer", "driver": "serial", "port": "/dev/ttyUSB7", "calibrated": "2026-11-21", **settings}
    sensor = Thermometer("skin", Settings(**given), connect)
    return sensor, lines


def start_thermometer(dialogue, **settings):
    sensor, lines = thermometer(dialogue, **settings)
    sensor.open()
    clock = Clock()
    sensor.start(clock)
    return sensor, lines[0], clock


def values(blocks):
    return [round(value, 4) for block in blocks for value in array.array("f", block.data)]


@pytest.mark.parametrize(
    ("dialogue", "settings", "degC", "sent"),
    [
        (SCPI, {}, 32.791, [*SCPI]),
        (SCPI | {b"MEAS:TEMP? (@101)\n": [b"21.5 C\n"]}, {"input": "(@101)"}, 21.5,
         [b"*IDN?\n", b"UNIT:TEMP?\n", b"MEAS:TEMP? (@101)\n"]),
        (LAKE_SHORE, {"commands": "lakeshore", "input": "3"}, 22.417, [b"*IDN?\r\n", b"RDGST? 3\r\n", b"CRDG? 3\r\n"]),
        (LINES, {"commands": "lines"}, 32.5, []),
    ],
)  # fmt: skip
def test_each_set_of_commands_is_spoken_byte_by_byte_and_read_at_the_set_pace(dialogue, settings, degC, sent):
    sensor, line, clock = start_thermometer(dialogue, **settings)
    assert line.sent == sent
    blocks = []
    for clock.s in (0.0, 0.4, 1.0, 1.9, 2.1):
        blocks += sensor.read(0.0)["temperature"]
    assert values(blocks) == [degC] * 3 and [block.first for block in blocks] == [0, 1, 2]
    assert not any(block.lost for block in blocks)
    [signal] = sensor.signals
    assert (signal.units, signal.rate_hz, signal.calibration) == (("degC",), 1.0, "2026-11-21")


@pytest.mark.parametrize(
    ("dialogue", "settings", "message"),
    [
        ({}, {}, "no answer within 0.5 s. Is it switched on"),
        ({b"": [b"32.41\n"]}, {}, "Is it switched on"),
        (SCPI | {b"*IDN?\n": [b"32.41 C\n"]}, {}, r"it sends readings by itself \(32.41 C\); set `commands: lines`"),
        (SCPI | {b"*IDN?\n": [b"*IDN?\n"]}, {}, "it sends back what it is sent; switch its echo off"),
        (SCPI | {b"UNIT:TEMP?\n": [b"F\n"]}, {}, "its unit is 'F', and C is expected"),
        (SCPI | {b"*IDN?\n": [b"\xff\xfe\x80\n"]}, {}, "is no text.*`baud` .9600."),
        (SCPI | {READ: [b"-113,Undefined header\n"]}, {}, "'-113,Undefined header' is not a temperature"),
        (SCPI | {READ: [b"+9.90000000E+37\n"]}, {}, "overload"),
        (SCPI | {READ: [OSError("unplugged")]}, {}, "the line is gone: unplugged"),
        (SCPI, {"commands": "lakeshore"}, "no answer"),
        ({}, {"commands": "lines"}, "no answer"),
        ({b"": [b"90.5 F\n"]}, {"commands": "lines"}, "'90.5 F' is not a temperature in degrees Celsius"),
        (LAKE_SHORE | {b"RDGST? 3\r\n": [b"032\r\n"]}, {"commands": "lakeshore", "input": "3"}, "status 032"),
    ],
)
def test_a_thermometer_in_a_wrong_mode_is_refused_when_it_is_opened_and_its_port_let_go_of(dialogue, settings, message):
    sensor, lines = thermometer(dialogue, **settings)
    with pytest.raises(DeviceError, match=message):
        sensor.open()
    assert lines[0].closed and sensor.port is None


def test_one_line_of_garbage_one_cut_and_one_missing_are_lost_samples_with_their_reason():
    sensor, _, clock = start_thermometer(
        SCPI | {READ: [b"33\n", b"33.1\n", b"3#.2\n", b"33.3\n", b"33.", b"33.5\n", b"", b"33.7\n"]}
    )
    blocks = []
    for clock.s in range(7):
        blocks += sensor.read(0.0)["temperature"]
    assert values(blocks) == pytest.approx([33.1, 33.3, 33.5, 33.7], abs=1e-4)
    assert [(block.first, block.lost) for block in blocks] == [(0, 0), (2, 1), (4, 1), (6, 1)]
    whys = [block.why for block in blocks[1:]]
    assert whys == ["'3#.2' is not a temperature in degrees Celsius", "an answer broke off within 0.5 s",
                    "no answer within 0.5 s"]  # fmt: skip


def test_readings_that_came_too_late_are_lost_and_never_numbered_on():
    sensor, _, clock = start_thermometer(SCPI)
    sensor.read(0.0)
    clock.s = 4.2
    [block] = sensor.read(0.0)["temperature"]
    assert (block.first, block.lost, block.why) == (4, 3, "it answered too late")


@pytest.mark.parametrize(
    ("answers", "reads", "what", "message"),
    [
        ([b""], 3, "silent", "skin: 3 readings in a row were missed, the last: no answer within 0.5 s"),
        ([b"Err\n"], 3, "not_a_number", "'Err' is not a temperature"),
        ([b"+9.91E+37\n"], 1, "not_a_number", "it measures nothing"),
        ([b"NaN\n"], 1, "not_a_number", "it measures nothing"),
        ([b"-9.9E37\n"], 1, "over_range", "overload"),
        ([b"+8.5E+01\n"], 1, "over_range", "85 degC is outside of -20 to 60 degC"),
        ([OSError(5, "Input/output error")], 1, "link_lost", "the line is gone"),
    ],
)
def test_what_fails_for_good_is_a_fault_by_its_kind_and_the_next_start_opens_it_anew(answers, reads, what, message):
    sensor, lines = thermometer(SCPI | {READ: [b"33\n", b"33\n", *answers]})
    sensor.open()
    clock = Clock()
    sensor.start(clock)
    assert values(sensor.read(0.0)["temperature"]) == [33.0]
    with pytest.raises(DeviceFault, match=message) as caught:
        for clock.s in range(1, reads + 1):
            sensor.read(0.0)
    assert caught.value.what == what and clock.s == reads
    assert lines[0].closed
    sensor.start(clock)
    assert len(lines) == 2 and values(sensor.read(0.0)["temperature"]) == [33.0]


@pytest.mark.parametrize(
    ("commands", "place", "about"), [("scpi", "skin", 33), ("lakeshore", "room", 22.5), ("lines", "skin", 33)]
)
def test_the_twin_speaks_the_same_bytes_and_gives_plausible_temperatures(commands, place, about):
    def given(seed=1):
        twin = make(
            "skin", Settings(kind="thermometer", driver="twin", commands=commands, place=place, seed=seed), None
        )
        clock = Clock()
        twin.elapsed_s = lambda: clock.s
        twin.open()
        twin.start(clock)
        return [value for clock.s in range(901) for value in values(twin.read(0.0)["temperature"])]

    degC = given()
    assert len(degC) == 901 and all(abs(value - about) < 0.5 for value in degC)
    assert max(degC) - min(degC) > 0.4 and given() == degC and given(seed=2) != degC


def test_settings_that_do_not_go_together_are_refused():
    with pytest.raises(ValidationError, match="the driver serial needs a port"):
        Settings(kind="thermometer", driver="serial")
    with pytest.raises(ValidationError, match="must be below"):
        Settings(kind="thermometer", driver="twin", lowest_degC=30, highest_degC=20)


@pytest.mark.needs("serial")
def test_a_port_that_is_not_there_is_named():
    sensor = make("skin", Settings(kind="thermometer", driver="serial", port="/dev/there-is-none"), None)
    assert sensor.connect is connect_serial
    with pytest.raises(DeviceError, match="skin: the port /dev/there-is-none cannot be opened"):
        sensor.open()


def test_its_health_says_what_it_measures():
    twin = make("skin", Settings(kind="thermometer", driver="twin", rate_hz=20), None)
    twin.open()
    health = twin.health(0.2)
    assert health.ok and health.summary.endswith(" degC") and health.facts == {"identity": "PALPATE,TWIN,0,1.0"}
    assert KIND.make is make


def wait_until(done):
    """Let the reading thread run until something is so."""
    for _ in range(2000):
        if done():
            return
        threading.Event().wait(0.005)
    raise AssertionError("it took too long")


class Desk:
    """An experimenter who confirms once asked to."""

    def __init__(self):
        self.prompts, self.confirms = [], True

    def demand(self, prompt):
        self.prompts += [] if prompt is None else [prompt.text]

    def answer(self):
        return True if self.confirms else None


class Window:
    def wait_for(self, _key, _desk, ready):
        return None if ready() else Aside({"do": "note", "text": "not yet"})


class Inner:
    """A world that answers at once; what happens meanwhile is the test's."""

    def __init__(self, clock, meanwhile):
        self.now, self.meanwhile = clock, meanwhile

    def perform(self, _request):
        self.meanwhile()
        return Reply({"presented": True})


def test_it_is_recorded_beside_trials_and_an_unplugged_one_costs_no_answer():
    sensor, lines = thermometer(SCPI, rate_hz=20, timeout_s=0.02)
    sensor.open()
    recorder, desk = BesideRecorder({"skin": sensor}, {("skin", "temperature"): "skin_temperature"}), Desk()
    inner = Inner(clock_from(0), lambda: wait_until(lambda: sensor.number > 3))
    world = RecordedBeside(inner, lambda: recorder.ready(Window(), desk, inner.now), recorder.take)
    request = Present(Trial(1, "B", False, Stimulus(id="A"), None, False, False))
    [first] = world.perform(request).samples
    assert first.stream == "skin_temperature" and first.units == ("degC",) and first.first == 0 and first.count >= 3
    assert values([first]) == [32.791] * first.count
    lines[0].dialogue[READ] = [OSError("unplugged")]
    inner.meanwhile = lambda: wait_until(lambda: sensor.port is None)
    assert isinstance(world.perform(request), Reply)  # the answer is kept
    outcome = world.perform(request)
    outcome = world.perform(request) if isinstance(outcome, Chunk) else outcome
    assert isinstance(outcome, Fault)
    assert outcome.value["what"] == "link_lost"
    assert "unplugged" in outcome.value["message"]
    desk.confirms = False
    assert isinstance(world.perform(request), Aside)
    desk.confirms = True
    inner.meanwhile = lambda: wait_until(lambda: sensor.number > 2)
    [again] = world.perform(request).samples
    assert again.first == 0 and again.count >= 2 and len(lines) == 2
    assert desk.prompts[0].endswith("Put it right, then confirm.")
    recorder.close()


def test_a_simulated_session_holds_it_without_a_gap_and_replays_byte_for_byte(tmp_path):
    lab, needs = Lab(tmp_path), {"needs": ["samples", "skin_temperature", "window"]}
    path = lab.start(rig=simulated(lab.plan(**needs).study, tmp_path), **needs)
    record = read(path)
    replay(path)
    blocks = [block for event in record.events for block in event.samples]
    assert {block.stream for block in blocks} == {"skin_temperature"} and all(block.first == 0 for block in blocks)
    assert all(event.kind == "reply" and event.trial is not None for event in record.events if event.samples)
    at_s = [block.t0_ns / NS + number for block in blocks for number in range(block.count)]
    assert at_s == [*range(len(at_s))] and len(at_s) > 20


def test_resumed_sessions_get_the_temperatures_of_sessions_that_were_never_left(tmp_path):
    plan, clock = Lab(tmp_path).plan(), Clock()
    whole = VirtualRecorder.of(["skin_temperature"], clock, plan)
    clock.s = 10.5
    whole.take()
    resumed = VirtualRecorder.of(["skin_temperature"], clock, plan)
    clock.s = 20.0
    assert whole.take() == resumed.take() != ()
    other = VirtualRecorder.of(["skin_temperature"], clock, replace(plan, seed=plan.seed + 1))
    clock.s = 30.0
    assert other.take() != whole.take()
