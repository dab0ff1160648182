"""Live sessions with a rig of twins: the station's own devices, threads, processes and clocks; people are simulated."""

from __future__ import annotations

import errno
import os
import signal
import sys
import time
from dataclasses import replace
from functools import partial

import pytest

from palpate.analysis.streams.listing import list_streams
from palpate.devices.daq.twin import TwinDaq
from palpate.devices.device import DeviceError
from palpate.devices.door.link import device
from palpate.devices.door.link.connections import by_twin
from palpate.devices.rig.file import rig_path
from palpate.devices.rig.opened import OpenRig
from palpate.protocols.events import Ask
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, StudyFiles, read_study
from palpate.studies.live import opening as live_rig
from palpate.studies.live.hardware import hardware_for
from palpate.studies.live.opening import live_plan, resumed_live_plan
from palpate.studies.live.options import LiveOptions
from palpate.studies.live.world import Station
from palpate.studies.sessions.interrupts import Interrupted
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session import resume, start
from tests.devices.door.link.twin_processes import children
from tests.studies.live.rig_rooms import (
    TEXTURE_TWINS,
    TWINS,
    Room,
    captures,
    counting_outcomes,
    doors,
    ends,
    kinds,
    live_doors,
    plan_of,
    run_live,
)

pytestmark = pytest.mark.usefixtures("shared_grounds")


@pytest.fixture
def lab(tmp_path):
    rig = rig_path(tmp_path)
    rig.parent.mkdir(parents=True)
    rig.write_text(TWINS, encoding="utf-8")
    return tmp_path


@pytest.fixture
def experimenter(monkeypatch):
    """Says `confirm` a given number of times; each is the answer to one demand."""
    reading, writing = os.pipe()
    with os.fdopen(reading) as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        yield lambda times=1: os.write(writing, b"confirm\n" * times)
    os.close(writing)


@pytest.fixture
def rooms(monkeypatch, experimenter):
    """Every window that is opened is a room; what happens meanwhile can be set."""
    hooks = {"meanwhile": lambda _page, _looks: None}

    def meanwhile(page, looks):
        hooks["meanwhile"](page, looks)

    def window_of(*_given):
        return lambda plan: Room(Perceiver(plan), meanwhile, experimenter)

    monkeypatch.setattr(live_rig, "window_of", window_of)
    monkeypatch.setattr(live_rig, "window_calibration", lambda *_given: None)
    return hooks


@pytest.fixture
def brief_door(lab):
    """A rig whose door is felt for the shortest time that may be set."""
    rig_path(lab).write_text(TWINS.replace("twin_speed: 0.25", "twin_speed: 0.25, time_limit_s: 5"), encoding="utf-8")


def quits_at_once(_page, _looks):
    raise Interrupted("QUIT")


@pytest.mark.needs("serial")
def test_doors_are_felt_through_the_driver_and_the_firmware(lab, rooms):
    study_files = doors()
    result = run_live(study_files, lab)
    record = read(result.path)
    assert result.complete and counting_outcomes(record) == ["answered"]
    rig = record.header["rig"]
    assert rig["twins"] == ["door"] and rig["settings"]["door"]["driver"] == "twin" and rig["devices"]["door"]
    replies = [event.value for event in record.events if event.kind == "reply" and event.value.get("presented")]
    assert [reply["by"] for reply in replies] == ["twin"]
    assert all(reply["opened_deg"] > 55 and not reply["streams"]["door_telemetry"]["lost"] for reply in replies)
    assert "samples" in kinds(record)
    replay(result.path)


@pytest.mark.needs("serial")
@pytest.mark.needs("linux")
@pytest.mark.usefixtures("brief_door")
def test_a_door_that_dies_is_a_fault_and_the_trial_is_repeated(lab, rooms):
    killed = []

    def kill(page, _looks):
        if page == "feel_now" and not killed:
            killed.extend(children())
            for pid in killed:
                os.kill(pid, signal.SIGKILL)

    rooms["meanwhile"] = kill
    result = run_live(doors(1), lab)
    record = read(result.path)
    assert killed and result.complete and ends(record)[0] == "faulted" and counting_outcomes(record) == ["answered"]
    fault = next(event.value for event in record.events if event.kind == "fault")
    assert fault["device"] == "door" and fault["what"] == "link_lost"
    replay(result.path)
    assert not list(children()), "every twin ends with its session"


@pytest.mark.needs("serial")
@pytest.mark.usefixtures("brief_door")
def test_a_session_that_is_quit_while_a_door_is_felt_leaves_it_safe_and_goes_on(lab, rooms):
    def quits(page, looks):
        if page == "feel_now" and looks > 200:
            raise Interrupted("QUIT")

    study_files = doors(1)
    rooms["meanwhile"] = quits
    result = run_live(study_files, lab)
    assert not result.complete and not list(children())
    rooms["meanwhile"] = lambda _page, _looks: None
    rig, accepted = resumed_live_plan(study_files, lab, LiveOptions(), read(result.path).header)
    assert accepted is None and resume(result.path, rig).complete
    record = read(result.path)
    assert ends(record)[-1] == "answered"
    replay(result.path)


@pytest.mark.needs("serial")
def test_the_first_thing_done_in_the_end_is_that_nothing_moves(lab, rooms, monkeypatch):
    done = []

    def noting(kind, name):
        before = getattr(kind, name)
        monkeypatch.setattr(kind, name, lambda self: done.append(name) or before(self))

    noting(OpenRig, "safe")
    noting(Station, "stop")
    rooms["meanwhile"] = quits_at_once
    assert not run_live(doors(1), lab).complete
    assert done[:2] == ["safe", "stop"]


@pytest.mark.needs("serial")
def test_a_profile_beyond_the_rig_s_limits_is_refused_before_anything_is_recorded(lab, rooms):
    path = rig_path(lab)
    path.write_text(TWINS.replace("twin_speed: 0.25", "limits: {torque_Nm: 5}"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"BC3.*5 N m"):
        run_live(doors(1), lab)
    assert not (lab / "sessions").exists() and not list(children())


@pytest.mark.needs("serial")
def test_where_no_ledger_can_be_written_the_devices_are_let_go_of(lab, rooms):
    (lab / "sessions").write_text("a file in the way", encoding="utf-8")
    with pytest.raises(OSError, match="sessions"):
        run_live(doors(1), lab)
    assert not list(children())


@pytest.mark.needs("serial")
def test_wishes_that_the_rig_s_door_may_not_play_are_refused_before_anything_is_recorded(lab, rooms):
    study_files = read_study(SHIPPED / "door_authoring" / "study.yaml")
    hardware = hardware_for(study_files, lab, LiveOptions())
    hardware.open(compile_plan(study_files.study, ParticipantRow("P001")))
    hardware.close()
    rig_path(lab).write_text(TWINS.replace("twin_speed: 0.25", "limits: {torque_Nm: 40}"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"the hardest door that may be wished for.*40 N m"):
        hardware_for(study_files, lab, LiveOptions()).open(compile_plan(study_files.study, ParticipantRow("P001")))
    assert not list(children())


def test_sensors_are_recorded_together_and_nothing_is_lost(lab, rooms):
    result = run_live(captures(), lab)
    record = read(result.path)
    assert result.complete and counting_outcomes(record) == ["captured", "captured"]
    for event in record.events:
        if event.kind == "reply" and event.value.get("recorded"):
            streams = event.value["streams"]
            assert set(streams) == {"tool_acceleration", "tool_force", "tool_position"}
            assert all(stream["lost"] == 0 for stream in streams.values())
            assert streams["tool_force"]["samples"] >= 8000
    replay(result.path)


def test_a_sensor_that_is_unplugged_in_mid_trial_and_comes_back_leaves_a_marked_gap(lab, rooms, monkeypatch):
    """What came before stays in the attempt that does not count; no sample lies outside the attempt it was taken in."""
    read_card, state = TwinDaq.read, {"plugged": True, "looks": 0}

    def read_or_fail(card, most, timeout_s):
        if card.name == "vibration" and not state["plugged"]:
            raise OSError(errno.ENODEV, "No such device")
        return read_card(card, most, timeout_s)

    def unplug_and_plug(page, _looks):
        if page != "recording":
            state["plugged"] = True
            return
        state["looks"] += 1
        if state["looks"] == 15:
            state["plugged"] = False

    monkeypatch.setattr(TwinDaq, "read", read_or_fail)
    rooms["meanwhile"] = unplug_and_plug
    result = run_live(captures(capture={"device": "tool", "seconds": 1.5}), lab)
    record = read(result.path)
    assert result.complete and ends(record)[0] == "faulted" and counting_outcomes(record) == ["captured", "captured"]
    fault = next(event for event in record.events if event.kind == "fault" and event.value["what"] == "link_lost")
    assert (fault.value["device"], fault.value["message"]) == ("vibration", "vibration: no such device")
    spans = {}
    for event in record.events:
        if event.kind in ("trial_started", "trial_ended"):
            spans.setdefault((event.trial, event.attempt), []).append(event.t_ns)
    blocks = [((event.trial, event.attempt), block) for event in record.events for block in event.samples]
    assert any(attempt == (fault.trial, fault.attempt) for attempt, _ in blocks), "what came before the fault is kept"
    for attempt, block in blocks:
        began, ended = spans[attempt]
        assert began <= block.t0_ns and block.t0_ns + (block.count - 1) / block.rate_hz * 1e9 <= ended
    listed = list_streams(record)
    assert (fault.trial, fault.attempt) not in {(row["trial"], row["attempt"]) for row in listed["streams"]}
    short = [row for row in listed["streams"] if row["lost"] or row["samples"] < 1.49 * row["rate_hz"]]
    assert short == [] and listed["not_used"]
    replay(result.path)


def test_a_recording_that_is_interrupted_is_repeated(lab, rooms):
    study_files = captures(stimuli=[{"id": "T15"}], capture={"device": "tool", "seconds": 3.0})
    seen = []

    def quits(page, _looks):
        if page == "recording":
            seen.append(time.monotonic())
            if seen[-1] - seen[0] > 1.2:
                raise Interrupted("QUIT")

    rooms["meanwhile"] = quits
    result = run_live(study_files, lab)
    assert not result.complete and kinds(read(result.path))[-1] == "samples"
    rooms["meanwhile"] = lambda _page, _looks: None
    rig, _ = resumed_live_plan(study_files, lab, LiveOptions(), read(result.path).header)
    assert resume(result.path, rig).complete
    record = read(result.path)
    assert ends(record) == ["faulted", "captured"]
    assert next(event.value["what"] for event in record.events if event.kind == "fault") == "interrupted"
    replay(result.path)


@pytest.mark.long
def test_a_photo_study_keeps_its_pictures_in_the_lab(lab, rooms):
    path = rig_path(lab)
    path.write_text(TWINS.replace("camera, driver: twin", "camera, driver: twin, lights: 2"), encoding="utf-8")
    study_files = captures(
        stimuli=[{"id": "T27"}], needs=["samples", "camera"], capture={"device": "camera", "seconds": 60.0}
    )
    result = run_live(study_files, lab)
    record = read(result.path)
    assert result.complete
    [pictures] = [event.value["pictures"] for event in record.events if "pictures" in (event.value or {})]
    assert len(pictures) == 2 and len(list((lab / "pictures").rglob("*.png"))) == 2
    replay(result.path)
    elsewhere = lab / "rigs" / "other.yaml"
    elsewhere.parent.mkdir()
    path.rename(elsewhere)
    (lab / "pictures").rename(lab / "former")
    assert start(lab, plan_of(study_files), live_plan(study_files, lab, LiveOptions(rig=elsewhere)), 2).complete
    assert len(list((lab / "pictures").rglob("*.png"))) == 2, "wherever the rig file lies"


@pytest.mark.needs("serial")
def test_noise_masks_and_other_settings_are_refused_when_going_on(lab, rooms):
    study_files = doors(1, needs=["door", "masking_noise"])
    rooms["meanwhile"] = quits_at_once
    result = run_live(study_files, lab)
    header = read(result.path).header
    assert set(header["rig"]["settings"]) == {"door", "noise"}
    path = rig_path(lab)
    path.write_text(TWINS.replace("masking_noise, driver: twin", "masking_noise, driver: twin, level_dbfs: -40"))
    with pytest.raises(ValueError, match=r"the rig has changed .*level_dbfs.*--accept-change"):
        resumed_live_plan(study_files, lab, LiveOptions(), header)
    _, accepted = resumed_live_plan(study_files, lab, LiveOptions(accept_change=True), header)
    assert "level_dbfs" in accepted["devices_changed"]
    path.unlink()
    with pytest.raises(ValueError, match="no rig file"):
        resumed_live_plan(study_files, lab, LiveOptions(), header)


@pytest.mark.needs("serial")
@pytest.mark.parametrize(
    ("noise", "message"),
    [
        ("driver: twin", r"noise: the study allows at most 50 dB\(A\), and nobody has measured how loud"),
        ("driver: twin, db_spl_at_0_dbfs: 100", r"noise: 63\.0 dB\(A\) at the ear, and the study allows at most 50"),
    ],
)
def test_noise_that_nobody_measured_or_that_is_too_loud_for_the_study_is_refused(lab, rooms, noise, message):
    study_files = doors(1, needs=["door", "masking_noise"], noise={"at_most_db_a": 50})
    rig_path(lab).write_text(TWINS.replace("masking_noise, driver: twin", f"masking_noise, {noise}"))
    with pytest.raises(DeviceError, match=message):
        run_live(study_files, lab)
    if "100" in noise:
        quiet = TWINS.replace("masking_noise, driver: twin", f"masking_noise, {noise}, level_dbfs: -50")
        rig_path(lab).write_text(quiet)
        rooms["meanwhile"] = quits_at_once
        header = read(run_live(study_files, lab).path).header
        assert header["rig"]["devices"]["noise"]["db_a"] == pytest.approx(48.0, abs=0.1)


def test_a_rig_of_twins_is_no_stand_in_of_this_process(lab, rooms):
    header = {"rig": {"kind": "live", "twins": ["door"], "settings": {}, "language": "en"}, "calibration": None}
    rig, _ = resumed_live_plan(doors(1), lab, LiveOptions(accept_change=True), header)
    assert "settings" in rig.description
    with_twins = replace(LiveOptions(), twins=True)
    assert "settings" not in live_plan(doors(1), lab, with_twins).description


@pytest.fixture
def firmware(monkeypatch):
    """Every twin of a door has this firmware from now on."""

    def installed(version):
        monkeypatch.setattr(device, "by_twin", partial(by_twin, more=[f"--firmware={version}"]))

    return installed


def live_replies(record):
    return [event.value["live"] for event in record.events if event.kind == "reply" and "live" in event.value]


@pytest.mark.needs("serial")
def test_a_door_that_cannot_follow_is_refused_before_anything_is_recorded(lab, rooms, firmware):
    firmware(1)
    study_files = live_doors(lab / "study", practice=False)
    with pytest.raises(DeviceError, match="door: its firmware 1 cannot change the door while it is felt.*firmware 2"):
        run_live(study_files, lab)
    assert not list((lab / "sessions").glob("*.sqlite")) and not list(children())


def quits_while_live():
    """Return what quits the session while the door is felt."""
    seen = []

    def quits(page, _looks):
        seen.append(page)
        if seen.count("live") > 200:  # after more than half a second: what came until then is on record
            raise Interrupted("QUIT")

    return quits


@pytest.mark.needs("serial")
@pytest.mark.parametrize("later", [1, 2])
def test_a_live_session_started_with_a_door_that_cannot_follow_is_resumed(lab, rooms, firmware, monkeypatch, later):
    """As sessions were before such a door was refused: broken off while the door is felt, resumed with either."""
    rooms["meanwhile"] = quits_while_live()
    firmware(1)
    study_files = live_doors(lab / "study", practice=False)
    with monkeypatch.context() as former:
        former.setattr("palpate.studies.live.station.demand_follows", lambda *_given: None)
        path = run_live(study_files, lab).path
    recorded = read(path)
    assert recorded.header["rig"]["devices"]["door"]["firmware"] == 1

    firmware(later)
    rooms["meanwhile"] = lambda _page, _looks: None
    rig, accepted = resumed_live_plan(study_files, lab, LiveOptions(), recorded.header)
    assert accepted is None and resume(path, rig).complete
    record = read(path)
    assert record.events[: len(recorded.events)] == recorded.events and ends(record)[0] == "faulted"
    notes = [event.value["text"] for event in record.events if event.kind == "experimenter"]
    if later == 1:  # nothing follows, and the record says so
        assert not notes and all(live["refused"] == live["changes"] > 0 for live in live_replies(record))
        assert all("refused UploadBegin (wrong_state)" in live["why"] for live in live_replies(record))
    else:
        assert notes == ["The firmware of door was 1 when the session was started, and is 2."]
        assert all(live["refused"] == 0 < live["changes"] for live in live_replies(record))
    replay(path)


@pytest.mark.needs("serial")
def test_a_live_session_started_with_a_door_that_follows_is_not_resumed_with_one_that_does_not(lab, rooms, firmware):
    rooms["meanwhile"] = quits_while_live()
    study_files = live_doors(lab / "study", practice=False)
    path = run_live(study_files, lab).path
    events = read(path).events
    firmware(1)
    rig, _ = resumed_live_plan(study_files, lab, LiveOptions(), read(path).header)
    with pytest.raises(DeviceError, match="firmware 1 cannot change the door"):
        resume(path, rig)
    assert read(path).events == events and not read(path).ended and not list(children())


def textures(count=1) -> StudyFiles:
    study_files = read_study(SHIPPED / "texture_similarity" / "study.yaml")
    some = tuple(stimulus for stimulus in study_files.study.stimuli if stimulus.columns["method"] == "AR")[:count]
    given = {"stimuli": some, "opening": (), "setup": (), "instructions": None}
    return StudyFiles(study_files.study.model_copy(update=given), study_files.folder)


@pytest.mark.long
def test_a_texture_session_resumed_during_an_answer_is_answered_with_the_texture_on(
    lab, rooms, experimenter, monkeypatch
):
    def quits(room, request, desk, now_ns):
        if isinstance(request, Ask):
            raise Interrupted("QUIT")
        return perform(room, request, desk, now_ns)

    rig_path(lab).write_text(TEXTURE_TWINS, encoding="utf-8")
    study_files, perform = textures(), Room.perform
    experimenter(4)
    with monkeypatch.context() as first:
        first.setattr(Room, "perform", quits)
        assert not run_live(study_files, lab).complete
    path = next((lab / "sessions").glob("*.sqlite"))
    rig, _ = resumed_live_plan(study_files, lab, LiveOptions(), read(path).header)
    assert resume(path, rig).complete
    presented, answered = (e.value["rendered"] for e in read(path).events if "rendered" in e.value)
    assert {name: answered[name] for name in ("model", "weights_sha256", "seed")} == {
        name: presented[name] for name in ("model", "weights_sha256", "seed")
    }
    assert answered["met"].keys() >= {"restarts", "quiet", "muted"} and "steps" in answered["deadlines"]
    replay(path)


@pytest.mark.usefixtures("rooms")
def test_a_thermometer_is_recorded_beside_a_capture_and_is_on_record_with_its_settings(lab):
    needs = "  skin: {kind: thermometer, driver: twin, rate_hz: 20}\nneeds:\n  skin_temperature: [skin]\n"
    rig = TWINS.replace("needs:\n", needs)
    rig_path(lab).write_text(rig, encoding="utf-8")
    result = run_live(captures(needs=["tool", "samples", "skin_temperature"]), lab)
    record = read(result.path)
    assert result.complete and ends(record) == ["captured"] * 2
    assert record.header["rig"]["devices"]["skin"]["identity"] == "PALPATE,TWIN,0,1.0"
    held = [event for event in record.events if any(block.stream == "skin_temperature" for block in event.samples)]
    assert held and {event.kind for event in held} == {"reply"} and {event.trial for event in held} == {1, 2}
    streams = {row["stream"] for row in list_streams(record)["streams"]}
    assert streams == {"tool_acceleration", "tool_force", "tool_position", "skin_temperature"}
    replay(result.path)
