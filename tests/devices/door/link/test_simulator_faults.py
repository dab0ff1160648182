"""Every fault while the door presents, in virtual time: it ends safe, is reported, and the next attempt asks first."""

import gc

import pytest

from palpate.devices.door.firmware.ailments import Ailing
from palpate.devices.door.firmware.sensor_check import Limits as DeviceLimits
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import SAFE_WITHIN_MS, DoorFault, State
from palpate.devices.door.link.connections import Threads
from palpate.devices.door.link.frames import Parser
from palpate.devices.door.link.link import Link
from palpate.protocols.events import Aside, Chunk, Fault, Reply
from tests.devices.door.firmware.plants import TinyPlant, out_and_back
from tests.devices.door.link.lines_for_tests import Bench, Drained, Lab, playing, request, slow_lab

DRILLS = {
    "silent": "silent", "stuck": "stuck", "not_a_number": "not_a_number", "angle_not_a_number": "not_a_number",
    "infinite": "not_a_number", "over_range": "over_range", "angle_over_range": "over_range", "too_fast": "limit",
}  # fmt: skip


@pytest.mark.parametrize("ailment", DRILLS)
def test_a_sensor_that_fails_is_a_fault_and_the_next_attempt_asks_first(ailment):
    path = out_and_back(ms=1000)  # 62 deg/s: an encoder that stops is seen at once
    lab = Lab(Bench(Ailing(TinyPlant(path), ailment))).opened()
    presentation = request()
    lab.until(Chunk, presentation)
    lab.bench.plant.from_ms = lab.bench.plant.t_ms
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["device"] == "door" and failed.value["what"] == DRILLS[ailment]
    assert "the door went safe" in failed.value["message"] and lab.at_rest
    assert lab.bench.firmware.fault is not DoorFault.none
    lab.bench.plant.from_ms, lab.bench.plant.plant.angle_deg = None, 0.0
    lab.bench.line.run(50)
    lab.desk.demands.clear()
    assert lab.until(Reply, request())[0].value["ended"] == "brought_back"
    assert lab.desk.demands[0].endswith("Put it right, then confirm.") and "went safe" in lab.desk.demands[0]


def test_nothing_moves_until_the_experimenter_has_confirmed():
    lab, presentation = playing("not_a_number")
    lab.bench.plant.from_ms = lab.bench.plant.t_ms
    lab.until(Fault, presentation)
    lab.bench.plant.from_ms = None
    lab.desk.confirms = False
    lab.desk.at = {lab.bench.line.t_ms + 20_000: Aside({"do": "note", "text": "looking at it"})}
    again = request()
    lab.until(Aside, again)
    assert lab.at_rest and lab.bench.firmware.fault is DoorFault.not_a_number
    lab.desk.confirms = True
    lab.until(Reply, again)


def test_a_fault_is_confirmed_once():
    lab, presentation = playing("not_a_number")
    lab.bench.plant.from_ms = lab.bench.plant.t_ms
    lab.until(Fault, presentation)
    lab.bench.plant.from_ms, lab.bench.plant.plant.angle_deg = None, 0.0
    lab.until((Chunk, Fault), request())
    assert lab.desk.confirmed == [
        "door: the door went safe: a sensor of it gave no number. Put it right, then confirm."
    ]


def test_a_fault_in_a_pause_is_reported_by_its_name_before_anything_moves_again():
    lab, presentation = playing()
    lab.desk.at = {0: Aside({"do": "pause"})}
    lab.until(Aside, presentation)
    lab.bench.firmware.press(True)
    lab.desk.at = {lab.bench.line.t_ms + 300: Aside({"do": "go_on"})}
    lab.until(Aside, presentation)
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["what"] == "emergency_stop" and lab.at_rest


def test_a_fault_whose_cause_remains_is_asked_for_again():
    lab, presentation = playing()
    lab.bench.firmware.press(True)
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["what"] == "emergency_stop" and "emergency stop was pressed" in failed.value["message"]
    lab.desk.demands.clear()
    lab.desk.at = {lab.bench.line.t_ms + 30: lambda: lab.bench.firmware.press(False)}
    lab.until(Reply, request())
    assert any("its cause remains" in demand for demand in lab.desk.demands)


def test_an_emergency_stop_between_two_trials_is_asked_for_before_the_next():
    lab = Lab().opened()
    lab.until(Reply)
    lab.bench.firmware.press(True)
    lab.bench.line.run(20)
    lab.bench.firmware.press(False)
    lab.desk.demands.clear()
    lab.until(Reply, request())
    assert "emergency stop" in lab.desk.demands[0]


def unplug_at(lab, when):
    """Take the cable out when the host sends its n-th message since now."""
    parser, count = Parser(), [0]

    def write(data, push=lab.bench.line.write):
        count[0] += len([frame for frame in parser.feed(data) if frame.kind != says.Heartbeat.KIND])
        if count[0] >= when:
            lab.bench.line.unplugged = True
        push(data)

    lab.bench.line.write = write


@pytest.mark.parametrize("when", range(1, 17))
def test_a_cable_that_comes_out_at_any_request_ends_safe_and_the_trial_is_repeated(when):
    lab = Lab().opened()
    unplug_at(lab, when)
    presentation = request()
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["what"] == "link_lost" and "the link to the door is lost" in failed.value["message"]
    lab.bench.line.run(SAFE_WITHIN_MS)
    assert lab.at_rest and lab.bench.firmware.state is State.safe
    del lab.bench.line.write
    lab.bench.line.unplugged = False
    lab.bench.plant.plant.angle_deg = 0.0
    assert lab.until(Reply, request())[0].value["ended"] == "brought_back"
    assert "Put it right, then confirm" in lab.desk.demands[0] or "Put it right, then confirm" in lab.desk.demands[1]


def test_a_cable_that_comes_out_while_it_is_felt_ends_safe_within_50_ms():
    lab, presentation = playing()
    lab.bench.line.unplugged = True
    cut_ms = lab.bench.line.t_ms
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["what"] == "link_lost"
    lab.bench.line.run(max(0, cut_ms + SAFE_WITHIN_MS - lab.bench.line.t_ms))
    assert lab.at_rest and lab.bench.firmware.fault is DoorFault.heartbeat_lost


def test_a_door_that_stays_unplugged_is_reported_at_every_attempt():
    lab, presentation = playing()
    lab.bench.line.unplugged = True
    lab.until(Fault, presentation)
    failed, _ = lab.until(Fault, request())
    assert failed.value["what"] == "link_lost" and "no door simulator answers" in failed.value["message"]


@pytest.mark.parametrize("side", ["to_host", "to_device"])
def test_a_line_that_goes_deaf_or_dumb_ends_safe(side):
    lab, presentation = playing()
    setattr(lab.bench.line.wire, side, lambda data: b"")
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["what"] in {"silent", "heartbeat_lost"}
    lab.bench.line.run(SAFE_WITHIN_MS)
    assert lab.at_rest


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"\x55" * len(data),  # garbage
        lambda data: data[: len(data) // 2],  # truncated
        lambda data: bytes([*data[:6], data[6] ^ 1, *data[7:]]) if len(data) > 7 else data,  # wrong CRC
    ],
)
def test_a_line_on_which_nothing_comes_over_whole_ends_safe(damage):
    lab, presentation = playing()
    lab.bench.line.wire.to_device = damage
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["what"] == "heartbeat_lost" and lab.at_rest


def test_a_profile_beyond_a_limit_is_never_sent():
    lab = Lab(profile_N=[70.0] * 621).opened()
    sent = []
    lab.bench.line.wire.to_device = lambda data: sent.append(data) or data
    failed, _ = lab.until(Fault)
    assert failed.value["what"] == "limit"
    assert failed.value["message"] == "door: BC3_g0: 63.0 N m at 0 degrees, at most 60 N m are allowed"
    kinds = {frame.kind for frame in Parser().feed(b"".join(sent))}
    assert kinds <= {says.Stop.KIND, says.Heartbeat.KIND} and lab.at_rest


def test_the_devices_own_lower_limit_holds_too():
    lab = Lab(Bench(limits=DeviceLimits(torque_Nm=8.0, speed_deg_s=180.0))).opened()
    failed, _ = lab.until(Fault)
    assert failed.value["message"] == "door: BC3_g0: 9.0 N m at 0 degrees, at most 8 N m are allowed"


def test_a_device_that_leaves_playing_by_itself_is_a_fault():
    lab, presentation = playing()
    lab.bench.firmware._rest()
    failed, _ = lab.until(Fault, presentation)
    assert (
        failed.value["what"] == "firmware" and "the door is safe where it should be playing" in failed.value["message"]
    )


def test_telemetry_that_cannot_be_true_is_a_fault_also_where_the_device_says_nothing():
    lab, presentation = playing()
    lab.bench.firmware._watch.check = lambda *_: None
    lab.bench.plant.ailment, lab.bench.plant.from_ms = "not_a_number", lab.bench.plant.t_ms
    failed, _ = lab.until(Fault, presentation)
    assert failed.value["what"] == "not_a_number" and lab.at_rest


def test_a_door_that_was_switched_off_and_on_is_set_up_anew():
    lab = Lab().opened()
    lab.bench.firmware.receive(says.sent(says.SetRate(100), 9))
    lab.until(Chunk)
    assert lab.bench.firmware._rate_hz == 500
    lab.door.close()
    lab.opened()
    lab.bench.firmware.limits = DeviceLimits(speed_deg_s=400.0)
    failed, _ = lab.until(Fault)
    assert "stops itself at 400 deg/s, the rig allows 180" in failed.value["message"] and lab.at_rest


def test_a_driver_that_raises_anything_is_a_lost_link():
    class Driver:
        def read(self, _timeout_s):
            raise TypeError("'NoneType' object cannot be interpreted as an integer")

        def write(self, data):
            pass

    link = Link("door", Driver())
    threads = Threads(link)
    threads.start()
    try:
        assert not link.wait(lambda: False, 10.0)
        assert link.broken.what == "link_lost" and "NoneType" in str(link.broken)
    finally:
        threads.end()


def test_no_collection_of_garbage_holds_up_the_heart_while_a_hand_is_in_the_machine():
    lab, _ = playing()
    assert gc.get_freeze_count() > 0
    lab.door.close()
    assert gc.get_freeze_count() == 0


def test_what_was_recorded_is_ended_also_where_telling_of_it_fails():
    lab, recorded = slow_lab(), []
    lab.door.recorder = lambda door, now_ns: recorded.append(Drained(door, now_ns)) or recorded[-1]
    lab.until(Chunk, request())
    lab.desk.tell = lambda _state: (_ for _ in ()).throw(OSError("the terminal is gone"))
    with pytest.raises(OSError, match="terminal"):
        lab.door.close()
    assert lab.at_rest and recorded[0].ended
