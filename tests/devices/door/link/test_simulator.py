"""Presenting on the door, in virtual time: what is felt, what breaks in, and every fault."""

import random

import pytest

from palpate.devices.device import DeviceError
from palpate.devices.door.firmware.ailments import Ailing
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import SAFE_WITHIN_MS, DoorFault, State
from palpate.protocols.events import Aside, Chunk, Fault, Reply
from palpate.studies.sessions.interrupts import Interrupted
from tests.devices.door.firmware.plants import TinyPlant
from tests.devices.door.link.lines_for_tests import Bench, Lab, playing, request, slow_lab


def test_a_door_that_is_opened_and_brought_back_is_presented():
    lab = Lab().opened()
    reply, before = lab.until(Reply)
    assert reply.value["presented"] is True and reply.value["by"] == "door" and reply.value["ended"] == "brought_back"
    assert reply.value["opened_deg"] == pytest.approx(62.0, abs=0.3) and reply.value["end_deg"] == 62.0
    assert reply.value["profile"] == f"{lab.bench.firmware.memory.profile.crc:08x}"
    assert reply.value["seconds"] == pytest.approx(2.1, abs=0.2)
    assert lab.at_rest and lab.bench.firmware.fault is DoorFault.none
    assert set(lab.window.shown) == {"feel_now"}
    samples = [piece for chunk in before for piece in chunk.samples]
    assert [piece.first for piece in samples] == [0, *_sums(piece.count for piece in samples)][:-1]
    assert sum(piece.count for piece in samples) == reply.value["streams"]["door_telemetry"]["samples"] > 1000


def _sums(counts):
    total = 0
    for count in counts:
        total += count
        yield total


def test_nothing_but_what_was_checked_and_read_back_is_played():
    lab = Lab().opened()
    lab.until(Reply)
    (loaded,) = lab.bench.plant.plant.loaded
    assert loaded[0] == says.as_float32((9.0,) * 621)  # 10 N at 0.9 m


def test_the_experimenter_may_end_it():
    lab = slow_lab()
    lab.desk.at[1000] = lambda: setattr(lab.desk, "answered", True)
    reply, _ = lab.until(Reply)
    assert reply.value["ended"] == "experimenter" and reply.value["opened_deg"] < 20 and lab.at_rest
    assert "Confirm to end it" in lab.desk.demands[0]


def test_a_presentation_ends_with_its_time():
    lab = Lab(Bench(Ailing(TinyPlant(), "silent")), time_limit_s=3.0).opened()
    reply, _ = lab.until(Reply)
    assert reply.value["ended"] == "time_limit" and reply.value["opened_deg"] == 0.0 and lab.at_rest


def test_a_pause_rests_the_door_and_going_on_plays_it_again():
    lab, presentation = slow_lab(), request()
    lab.desk.at = {1000: Aside({"do": "pause"}), 5000: Aside({"do": "go_on"})}
    aside, _ = lab.until(Aside, presentation)
    assert aside.value["do"] == "pause" and lab.at_rest
    again, _ = lab.until(Aside, presentation)
    assert again.value["do"] == "go_on" and lab.at_rest
    reply, _ = lab.until(Reply, presentation)
    assert reply.value["ended"] == "brought_back"
    assert reply.value["seconds"] < lab.bench.line.clock_s() - 4


def test_a_note_changes_nothing():
    lab, presentation = slow_lab(), request()
    lab.desk.at = {1000: Aside({"do": "note", "text": "hm"})}
    lab.until(Aside, presentation)
    assert not lab.at_rest
    assert lab.until(Reply, presentation)[0].value["ended"] == "brought_back"


@pytest.mark.parametrize("do", ["repeat", "abort"])
def test_what_is_given_up_is_at_rest_at_once_and_the_next_one_begins_anew(do):
    lab, presentation = slow_lab(), request()
    lab.desk.at = {1000: Aside({"do": do})}
    lab.until(Aside, presentation)
    assert lab.at_rest and lab.bench.firmware.state is State.safe
    assert lab.until(Reply, request())[0].value["ended"] == "brought_back"


def test_another_request_in_between_stops_the_first():
    lab, _ = playing()
    lab.until(Reply, request("FORD_g2"))
    assert lab.at_rest


@pytest.mark.parametrize("error", [Interrupted("abandoned"), KeyboardInterrupt(), RuntimeError("the window is closed")])
def test_an_exception_from_the_desk_or_the_window_leaves_it_at_rest(error):
    lab, presentation = playing()
    lab.desk.at = {0: error}
    began_ms = lab.bench.line.t_ms
    with pytest.raises(type(error)):
        lab.until(Reply, presentation)
    assert lab.at_rest and lab.bench.line.t_ms - began_ms <= SAFE_WITHIN_MS


def test_an_exception_out_of_the_window_itself_leaves_it_at_rest():
    lab, presentation = playing()
    lab.window.wait_for = lambda *_: (_ for _ in ()).throw(OSError("the display is gone"))
    with pytest.raises(OSError, match="display"):
        lab.perform(presentation)
    assert lab.at_rest


def test_a_slow_disk_costs_the_heartbeat_and_ends_safe():
    lab, presentation = playing()
    lab.window.passes(480)  # the main thread writes
    assert not lab.at_rest
    lab.window.passes(100)
    assert lab.at_rest
    failed, before = lab.until(Fault, presentation)
    assert failed.value["what"] == "heartbeat_lost" and "heard nothing of this computer" in failed.value["message"]
    assert all(isinstance(outcome, Chunk) for outcome in before)


def test_a_door_whose_own_limit_is_higher_than_the_rigs_is_not_opened():
    lab = Lab()
    lab.bench.firmware.limits = type(lab.bench.limits)(speed_deg_s=400.0)
    with pytest.raises(DeviceError, match="stops itself at 400 deg/s, the rig allows 180"):
        lab.door.open()
    assert lab.bench.closed == 1


def test_a_door_is_safe_from_the_start_whatever_it_was_doing():
    lab, _ = playing()
    lab.door._connection = lab.door._showing = None  # this program was killed; another one comes
    lab.bench.beats = False
    lab.door.open()
    assert lab.at_rest


def test_safe_and_close_may_be_called_at_any_time():
    lab = Lab()
    lab.door.safe()
    lab.door.close()
    lab.opened()
    lab.door.safe()
    lab.door.safe()
    lab.door.close()
    lab.door.close()
    assert lab.bench.closed == 1
    with pytest.raises(DeviceError, match="not open"):
        lab.door.start(lambda: 0)


def test_closing_in_full_swing_leaves_it_at_rest():
    lab, _ = playing()
    lab.door.close()
    assert lab.at_rest and lab.bench.closed == 1


def test_health_reports_noise_and_faults():
    lab = Lab().opened()
    health = lab.door.health(0.3)
    assert health.ok and health.readings[0].signal.name == "telemetry" and health.facts["firmware"] == "2"
    lab.bench.firmware.press(True)
    health = lab.door.health(0.3)
    assert not health.ok and "emergency stop" in health.summary


def test_health_reports_what_is_lost_on_the_line():
    lab, chance = Lab().opened(), random.Random(1)
    lab.bench.line.wire.to_host = lambda data: b"" if chance.random() < 0.1 else data
    health = lab.door.health(0.3)
    assert not health.ok and "samples of telemetry lost on the line" in health.summary


def test_what_the_ledger_keeps_of_it():
    description = dict(Lab().opened().door.describe())
    assert description["kind"] == "door" and description["driver"] == "serial" and description["serial_number"] == 1
    assert description["limits"] == {"torque_Nm": 60.0, "slope_Nm_deg": 100.0, "speed_deg_s": 180.0}
    assert description["device_limits"]["heartbeat_ms"] == 40
