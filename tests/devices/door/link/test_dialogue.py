"""Byte-level dialogues: what the host sends and what comes back, also from a device in a wrong mode and from others."""

import random
from dataclasses import dataclass, field, replace

import pytest

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.door.link import dialogue
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import DoorFault, Reason, State
from palpate.devices.door.link.frames import Parser
from palpate.devices.door.link.link import Link, Refused, Timing
from tests.devices.door.link.lines_for_tests import Bench

IDENTITY = says.Identity(b"PDOR", 1, 3, 12, 621, 60.0, 100.0, 180.0, 40, State.safe, 0, 0)


@dataclass
class Scripted:
    """A port that answers each request by the next line of a script: messages, raw bytes, or a function of both."""

    script: list
    clock: float = 0.0
    sent: bytes = b""
    requests: list = field(default_factory=list)
    parser: Parser = field(default_factory=Parser)
    waiting: bytes = b""

    def read(self, timeout_s):
        data, self.waiting = self.waiting, b""
        self.clock += 0.001 if data else timeout_s
        return data

    def write(self, data):
        self.sent += data
        for frame in self.parser.feed(data):
            self.requests.append(says.understood(frame))
            answer = self.script.pop(0) if self.script else b""
            if isinstance(answer, says.Message):
                answer = says.sent(answer, frame.sequence)
            self.waiting += answer(data) if callable(answer) else answer

    def close(self):
        pass


def link_to(*script):
    port = Scripted(list(script))
    return Link("door", port, lambda: port.clock, Timing()), port


def booted():
    bench = Bench()
    bench.line.run(50)
    bench.line.arrived.clear()
    return bench


def test_the_greeting_byte_by_byte():
    link, port = link_to(IDENTITY)
    assert dialogue.greet(link) == IDENTITY
    assert port.sent == bytes.fromhex("00 02 02 03 01 01 02 01 05 c3 b1 34 96 00")
    (frame,) = Parser().feed(port.sent)
    assert (frame.kind, frame.sequence, frame.payload) == (0x01, 1, b"\x01\x00")


def test_an_armed_device_is_stopped_before_anything_else():
    link, port = link_to(replace(IDENTITY, state=State.armed), says.Ack(says.Stop.KIND, State.safe), IDENTITY)
    assert dialogue.greet(link).state == State.safe
    assert [type(request) for request in port.requests] == [says.Hello, says.Stop, says.Hello]


def test_a_device_that_does_not_stop_is_refused():
    playing = replace(IDENTITY, state=State.playing)
    link, _ = link_to(playing, says.Ack(says.Stop.KIND, State.playing), playing)
    with pytest.raises(DeviceFault, match="stays playing when it is stopped"):
        dialogue.greet(link)


def test_a_device_that_boots_is_waited_for():
    boot = replace(IDENTITY, state=State.boot)
    link, port = link_to(boot, boot, IDENTITY)
    assert dialogue.greet(link).state == State.safe
    assert [type(request) for request in port.requests] == [says.Hello] * 3


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (b"", "no door simulator answers. Is it switched on"),
        (b"\r\nERROR\r\n", "something answers"),
        (b"\x00\x13garbage\x00", "something answers"),
        (lambda data: data, "what answers is not a door simulator"),  # a plug that sends everything back
        (says.Identity(b"XXXX", 1, 3, 12, 621, 1.0, 1.0, 1.0, 40, 1, 0, 0), "what answers is not a door simulator"),
        (says.Identity(b"PDOR", 2, 3, 12, 621, 60.0, 100.0, 180.0, 40, 1, 0, 0), "another version"),
        (says.Nak(1, Reason.wrong_version, State.safe, 0), "another version"),
    ],
)  # fmt: skip
def test_what_is_no_door_simulator_of_this_version_is_refused_by_name(answer, message):
    link, _ = link_to(*[answer] * 20)
    with pytest.raises(DeviceError, match=message):
        dialogue.greet(link)


def test_an_unanswered_request_is_sent_again_with_its_sequence():
    link, port = link_to(b"", b"", says.Ack(says.Stop.KIND, State.safe))
    link.ask(says.Stop())
    frames = Parser().feed(port.sent)
    assert [frame.sequence for frame in frames] == [1, 1, 1] and len(set(frames)) == 1


def test_an_answer_to_another_request_is_not_taken():
    late = says.sent(says.Ack(says.Play.KIND, State.playing), 9)
    link, _ = link_to(late, late + says.sent(says.Ack(says.Stop.KIND, State.safe), 1))
    assert link.ask(says.Stop()) == [says.Ack(says.Stop.KIND, State.safe)]


def test_a_damaged_answer_is_no_answer():
    good = says.sent(says.Ack(says.Stop.KIND, State.safe), 1)
    cut, turned = good[:-4] + b"\0", bytes([*good[:4], good[4] ^ 2, *good[5:]])
    link, port = link_to(cut, turned, good)
    link.ask(says.Stop())
    assert len(port.requests) == 3 and link.parser.dropped >= 2


def test_a_refusal_says_what_why_and_how_the_device_is():
    link, _ = link_to(says.Nak(says.Arm.KIND, Reason.faulted, State.safe, DoorFault.encoder_stuck))
    with pytest.raises(Refused, match=r"refused Arm \(faulted\); it is safe, with the fault encoder_stuck") as refused:
        link.ask(says.Arm(1))
    assert refused.value.what == "refused"


def test_codes_of_a_later_version_are_shown_by_number():
    link, _ = link_to(says.Nak(says.Arm.KIND, 99, 98, 97))
    with pytest.raises(Refused, match=r"\(reason 99\); it is state 98, with the fault fault 97"):
        link.ask(says.Arm(1))
    assert "fault 97" in str(dialogue.latched_fault("door", 97))


def test_an_upload_is_read_back_and_compared_point_by_point():
    bench = booted()
    link = bench.connect().link
    profile = says.Profile(tuple(0.05 * index for index in range(621)), 62.0)
    dialogue.upload(link, profile)
    dialogue.verify(link, profile)
    other = says.Profile((*profile.torque_Nm[:300], 15.01, *profile.torque_Nm[301:]), 62.0)
    with pytest.raises(DeviceFault, match="1 of the 621 points"):
        dialogue.verify(link, other)


@pytest.mark.parametrize("seed", range(4))
def test_an_upload_survives_a_line_that_loses_bytes_both_ways(seed):
    bench, chance = booted(), random.Random(seed)

    def lossy(share):
        return lambda data: b"" if chance.random() < share else data

    bench.line.wire.to_device, bench.line.wire.to_host = lossy(0.3), lossy(0.05)
    link = bench.connect().link
    link.timing = Timing(reply_s=0.05, patience_s=20.0)
    profile = says.Profile(tuple(0.05 * index for index in range(621)), 62.0)
    dialogue.upload(link, profile)
    dialogue.verify(link, profile)
    assert bench.firmware.memory.profile == profile


def test_a_lost_answer_to_play_does_not_play_twice():
    bench = booted()
    link = bench.connect().link
    profile = says.Profile((1.0,) * 621, 62.0)
    dialogue.upload(link, profile)
    bench.firmware.beat_ms = 0
    link.keep_alive(10.0)
    link.ask(says.Arm(profile.crc))
    answers = []

    def once(data):
        lost = bench.firmware.state is State.playing and len(answers) < 30
        if lost and data:
            answers.append(data)
        return b"" if lost else data

    bench.line.wire.to_host = once
    assert link.ask(says.Play()) == [says.Ack(says.Play.KIND, State.playing)]


def test_clearing_says_whether_the_cause_remains():
    bench = booted()
    link = bench.connect().link
    bench.firmware.press(True)
    link.ask(says.Hello())
    assert dialogue.clear(link, DoorFault.emergency_stop) is False
    bench.firmware.press(False)
    assert dialogue.clear(link, DoorFault.emergency_stop) is True
    with pytest.raises(Refused):
        dialogue.clear(link, DoorFault.encoder_stuck)


def test_the_heart_beats_only_while_the_main_thread_lives():
    bench = booted()
    link = bench.connect().link
    profile = says.Profile((1.0,) * 621, 62.0)
    dialogue.upload(link, profile)
    dialogue.play(link, profile)
    for _ in range(5):
        bench.line.run(300)
        link.keep_alive()
    assert bench.firmware.state is State.playing
    bench.line.run(500 + 50)  # the main thread hangs
    assert bench.firmware.state is State.safe and bench.firmware.fault is DoorFault.heartbeat_lost
