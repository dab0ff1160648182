import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.door.firmware.controller import ALLOWED, BOOT_MS, Firmware
from palpate.devices.door.firmware.sensor_check import Limits
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import HEARTBEAT_MS, DoorFault, Reason, State
from tests.devices.door.firmware.plants import Host, TinyPlant, firmware, out_and_back, profile
from tests.examples import examples

REQUESTS = {
    says.Hello: says.Hello(), says.Heartbeat: says.Heartbeat(), says.Stop: says.Stop(), says.EStop: says.EStop(),
    says.SetRate: says.SetRate(1000), says.ReadBack: says.ReadBack(0, 10),
    says.UploadBegin: says.UploadBegin(621, 62.0, 1), says.UploadChunk: says.UploadChunk(0, (1.0,)),
    says.UploadEnd: says.UploadEnd(1), says.Clear: says.Clear(0), says.Arm: says.Arm(1), says.Play: says.Play(),
    says.Change: says.Change(1),
}  # fmt: skip


def brought_to(state):
    """A host whose device is in that state, with a profile of which it knows the CRC."""
    if state is State.boot:
        return Host(Firmware(TinyPlant()))
    host = Host(firmware())
    host.upload(profile())
    if state in (State.armed, State.playing):
        host.say(says.Arm(profile().crc))
    if state is State.playing:
        host.say(says.Play())
    assert host.firmware.state is state
    return host


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("kind", ALLOWED)
def test_every_request_in_every_state_is_done_or_refused_as_the_table_says(state, kind):
    host = brought_to(state)
    answer = host.say(REQUESTS[kind])
    refused = isinstance(answer, says.Nak) and answer.reason == Reason.wrong_state
    assert refused == (state not in ALLOWED[kind])
    if refused:
        assert answer.state == state == host.firmware.state  # nothing has changed


def test_nothing_moves_before_arming_and_playing():
    plant = TinyPlant(out_and_back())
    host = Host(firmware(plant))
    host.run(200)
    host.upload(profile())
    assert isinstance(host.say(says.Play()), says.Nak)
    host.run(200)
    assert plant.mode == "off" and not plant.moved
    host.say(says.Arm(profile().crc))
    host.run(200)
    assert plant.mode == "hold" and not plant.moved
    host.say(says.Play())
    host.run(200)
    assert plant.mode == "play" and plant.moved


def test_a_profile_is_held_exactly_as_it_was_sent_and_given_to_the_plant():
    plant = TinyPlant()
    host = Host(firmware(plant))
    sent = profile(33.3, 55.5)
    assert all(isinstance(answer, says.Ack) for answer in host.upload(sent))
    held = [host.say(says.ReadBack(first, min(100, 621 - first))).torque_Nm for first in range(0, 621, 100)]
    assert sum(held, ()) == sent.torque_Nm
    host.say(says.Arm(sent.crc))
    assert plant.loaded == [(sent.torque_Nm, math.radians(sent.end_deg))]


@pytest.mark.parametrize(
    ("built", "reason"),
    [
        (says.Profile((61.0,) * 621, 62.0), Reason.over_limit),
        (says.Profile((0.0,) * 300 + (20.0,) * 321, 62.0), Reason.over_limit),
    ],
)
def test_the_device_checks_the_limits_again(built, reason):
    host = Host(firmware())
    assert host.upload(built)[-1].reason == reason
    assert host.say(says.Arm(built.crc)).reason == Reason.incomplete


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_torque_that_is_no_number_is_refused_where_it_comes(value):
    host = Host(firmware())
    host.say(says.UploadBegin(621, 62.0, 1))
    assert host.say(says.UploadChunk(0, (1.0, value))).reason == Reason.bad_value


@pytest.mark.parametrize("end_deg", [0.0, -1.0, 62.5, math.nan])
def test_an_end_outside_the_grid_is_refused(end_deg):
    assert Host(firmware()).say(says.UploadBegin(621, end_deg, 1)).reason == Reason.bad_value


def test_a_profile_with_a_missing_chunk_or_another_crc_does_not_count():
    host, sent = Host(firmware()), profile()
    host.say(says.UploadBegin(621, sent.end_deg, sent.crc))
    host.say(says.UploadChunk(0, sent.torque_Nm[:128]))
    assert host.say(says.UploadEnd(sent.crc)).reason == Reason.incomplete
    host.upload(sent)
    assert host.say(says.Arm(sent.crc ^ 1)).reason == Reason.wrong_crc
    host.say(says.UploadBegin(621, sent.end_deg, sent.crc ^ 1))
    for first in range(0, 621, 128):
        host.say(says.UploadChunk(first, sent.torque_Nm[first : first + 128]))
    assert host.say(says.UploadEnd(sent.crc ^ 1)).reason == Reason.wrong_crc
    assert host.say(says.Arm(sent.crc)).reason == Reason.incomplete  # the old one is gone since the upload began


def test_a_request_that_comes_twice_is_done_once_and_answered_twice():
    host = brought_to(State.armed)
    data = says.sent(says.Play(), 77)
    host.firmware.receive(data)
    first = host.tick()
    host.say(says.Stop())
    host.firmware.receive(data)  # a copy that was under way when it was stopped
    again = host.tick()
    assert [answer for answer in first if answer[0] == 77] == [answer for answer in again if answer[0] == 77]
    assert host.firmware.state is State.safe and host.firmware.plant.mode == "off"


def test_a_moving_arm_is_not_armed():
    plant = TinyPlant()
    host = Host(firmware(plant))
    host.upload(profile())
    plant.angle_deg = 0.0
    real = plant.step
    plant.step = lambda: _pushed(plant, real)
    host.tick()
    assert host.say(says.Arm(profile().crc)).reason == Reason.moving


def _pushed(plant, step):
    from dataclasses import replace

    return replace(step(), velocity_rad_s=1.0)


def test_a_profile_damaged_in_memory_is_detected_when_it_is_armed():
    host = brought_to(State.safe)
    held = host.firmware.memory.profile
    object.__setattr__(held, "torque_Nm", (9.0, *held.torque_Nm[1:]))
    assert host.say(says.Arm(held.crc)).reason == Reason.faulted
    assert host.firmware.fault is DoorFault.profile_damaged and host.firmware.plant.mode == "off"


def test_telemetry_comes_at_the_rate_asked_for_and_counts_its_samples():
    for rate_hz in (1, 500, 640, 1000):
        host = Host(firmware())
        host.say(says.SetRate(rate_hz))
        host.messages.clear()
        host.run(2000)
        numbers = [message.sample for message in host.messages if isinstance(message, says.Telemetry)]
        assert len(numbers) == 2 * rate_hz
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def test_another_version_and_an_unknown_type_are_refused_by_name():
    host = Host(firmware())
    assert host.say(says.Hello(99)).reason == Reason.wrong_version
    assert host.say(says.Ack(1, 2)).reason == Reason.unknown_type


def test_a_hello_is_answered_with_identity_and_state_in_every_state():
    for state in State:
        identity = brought_to(state).say(says.Hello())
        assert identity.known and identity.state == state and identity.heartbeat_ms == HEARTBEAT_MS
        assert identity.profile_crc == (0 if state is State.boot else profile().crc)


def test_a_fault_stays_latched_until_it_is_cleared_by_its_own_code():
    host = brought_to(State.playing)
    host.say(says.EStop())
    assert host.firmware.fault is DoorFault.emergency_stop
    host.run(100)
    assert host.say(says.Arm(profile().crc)).reason == Reason.faulted
    assert host.say(says.Clear(DoorFault.heartbeat_lost)).reason == Reason.bad_value
    assert isinstance(host.say(says.Clear(DoorFault.emergency_stop)), says.Ack)
    assert isinstance(host.say(says.Arm(profile().crc)), says.Ack)


def test_a_pressed_button_cannot_be_cleared_away():
    host = brought_to(State.playing)
    host.firmware.press(True)
    host.tick()
    assert host.firmware.state is State.safe and host.firmware.plant.mode == "off"
    assert host.say(says.Clear(DoorFault.emergency_stop)).reason == Reason.cause_remains
    host.firmware.press(False)
    assert isinstance(host.say(says.Clear(DoorFault.emergency_stop)), says.Ack)


def test_a_device_that_boots_does_nothing_but_answer():
    host = Host(Firmware(TinyPlant()))
    assert host.say(says.Hello()).state == State.boot
    host.run(BOOT_MS)
    assert host.firmware.state is State.safe


@settings(max_examples=examples(200), deadline=None)
@given(st.lists(st.sampled_from(list(REQUESTS.values())) | st.binary(max_size=40), max_size=40))
def test_whatever_is_sent_the_motor_is_on_only_in_the_states_that_say_so(requests):
    host = Host(firmware(limits=Limits()))
    host.upload(profile())
    for request in requests:
        if isinstance(request, bytes):
            host.firmware.receive(request)
            host.tick()
        else:
            host.say(says.Arm(profile().crc) if isinstance(request, says.Arm) else request)
        expected = {State.armed: "hold", State.playing: "play"}.get(host.firmware.state, "off")
        assert host.firmware.plant.mode == expected
        assert host.firmware.fault is DoorFault.none or host.firmware.plant.mode == "off"
