"""The twin behind a real pseudo-terminal, and what becomes of it when its host is killed."""

import json
import os
import select
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from palpate import devices
from palpate.devices.device import DeviceError
from palpate.devices.door.link.connections import by_serial, by_twin
from palpate.devices.door.link.device import Settings, make
from palpate.devices.door.link.limits import Limits
from palpate.devices.door.link.twin_process import TwinProcess
from palpate.protocols.events import Chunk, Fault, Reply
from tests.devices.door.link.lines_for_tests import request
from tests.devices.door.link.twin_processes import children

SLOW = 0.25
"""Seconds of the plant a second: 40 ms without a heartbeat are 160 ms here."""
PATIENCE_S = 60.0
HOST = """
import sys, time
from functools import partial
from pathlib import Path
from palpate.devices.door.link import dialogue
from palpate.devices.door.link.connections import by_twin
from palpate.devices.door.link.limits import Limits
from palpate.devices.door.link.messages import Profile, SetRate
connection = by_twin("door", 0.2, 1, Limits(), 1_000_000, Path(sys.argv[1]))
dialogue.greet(connection.link)
profile = Profile((10.0,) * 621, 62.0)
dialogue.upload(connection.link, profile)
dialogue.play(connection.link, profile)
print("playing", flush=True)
while True:
    connection.link.keep_alive()
    time.sleep(0.05)
"""


class Window:
    def __init__(self):
        self.until = time.monotonic() + PATIENCE_S

    def wait_for(self, key, desk, ready):
        while not ready():
            assert time.monotonic() < self.until
            time.sleep(0.005)


class Desk:
    def __init__(self):
        self.demands, self.prompt, self.ends = [], None, False

    def poll(self):
        return None

    def demand(self, prompt):
        self.prompt = prompt
        self.demands += [prompt.text] if prompt else []

    def answer(self):
        return True if self.prompt and (self.ends or "then confirm" in self.prompt.text) else None

    def tell(self, state):
        pass


def twin(log=None, more=()):
    """A door whose twin is slow enough for any machine, with a profile that is soon opened."""
    door = make("door", Settings(kind="door", driver="twin"), Path())
    door.connect = partial(by_twin, "door", SLOW, 1, Limits(), 1_000_000, log, more)
    door.profile_for = lambda _request: [10.0] * 71 + [0.0] * 550
    return door


def outcomes_of(door, desk, presentation, kinds):
    """What performing comes to in the end, and the chunks before."""
    window, chunks = Window(), []
    while not isinstance(one := door.perform(presentation, window, desk, time.monotonic_ns), kinds):
        chunks.append(one)
    return one, chunks


def notes(log):
    return [json.loads(line) for line in log.read_text().splitlines()]


@pytest.mark.needs("serial")
def test_a_twin_presents_through_its_pty_and_its_telemetry_is_recorded(tmp_path):
    log = tmp_path / "log"
    door = twin(log)
    door.open()
    try:
        reply, chunks = outcomes_of(door, Desk(), request(), (Reply, Fault))
    finally:
        door.close()
    assert isinstance(reply, Reply), reply
    assert reply.value["ended"] == "brought_back" and reply.value["by"] == "twin"
    assert reply.value["opened_deg"] > 5.0 and reply.value["end_deg"] == 7.0
    assert all(isinstance(chunk, Chunk) for chunk in chunks)
    count = sum(piece.count for chunk in chunks for piece in chunk.samples)
    assert count == reply.value["streams"]["door_telemetry"]["samples"] > 500
    assert [note["state"] for note in notes(log)][:4] == ["boot", "safe", "armed", "playing"]
    assert notes(log)[-1]["host"] == "gone, ended" and notes(log)[-1]["mode"] == "off"


@pytest.mark.needs("serial")
def test_a_sensor_that_fails_behind_the_pty_is_a_fault_and_the_door_is_safe(tmp_path):
    log = tmp_path / "log"
    door = twin(log, ("--ail=not_a_number@900",))
    door.open()
    try:
        fault, _ = outcomes_of(door, Desk(), request(), (Reply, Fault))
    finally:
        door.close()
    assert isinstance(fault, Fault) and fault.value["what"] == "not_a_number"
    tripped = next(note for note in notes(log) if note["fault"] == "not_a_number")
    assert tripped["t_ms"] == 900 and tripped["state"] == "safe" and tripped["mode"] == "off"


@pytest.mark.needs("serial")
def test_a_host_that_is_killed_leaves_the_door_safe_within_50_ms_of_plant_time(tmp_path):
    log = tmp_path / "log"
    root = Path(devices.__file__).resolve().parent.parent
    host = subprocess.Popen([sys.executable, "-c", HOST, log], stdout=subprocess.PIPE, cwd=root)
    try:
        assert select.select([host.stdout], [], [], PATIENCE_S)[0] and host.stdout.readline() == b"playing\n"
    finally:
        os.kill(host.pid, signal.SIGKILL)
        host.wait()
        host.stdout.close()
    until = time.monotonic() + PATIENCE_S
    while not (log.exists() and "gone, ended" in log.read_text()):
        assert time.monotonic() < until
        time.sleep(0.02)
    written = notes(log)
    assert "playing" in [note["state"] for note in written]
    tripped = next(note for note in written if note["fault"] == "heartbeat_lost")
    assert tripped["state"] == "safe" and tripped["mode"] == "off"
    assert tripped["t_ms"] - tripped["beat_ms"] <= 50
    assert written[-1]["state"] == "safe" and abs(written[-1]["motor_Nm"]) < 1e-6 and written[-1]["brake_A"] > 0.99


@pytest.mark.needs("serial")
def test_a_twin_that_is_killed_is_a_lost_link_and_another_one_is_started_for_the_next_attempt():
    door, desk = twin(), Desk()
    started = []

    def counted(start=door.connect):
        started.append(start())
        return started[-1]

    door.connect = counted
    door.open()
    try:
        first = request()
        assert isinstance(door.perform(first, Window(), desk, time.monotonic_ns), Chunk)
        for pid in children():
            os.kill(pid, signal.SIGKILL)
        fault, _ = outcomes_of(door, desk, first, (Reply, Fault))
        assert isinstance(fault, Fault) and fault.value["what"] in {"link_lost", "silent"}
        desk.ends = True
        reply, _ = outcomes_of(door, desk, request(), (Reply, Fault))
        assert isinstance(reply, Reply) and len(started) == 2
        assert any("Put it right" in demand for demand in desk.demands)
    finally:
        door.close()


@pytest.mark.needs("serial")
def test_a_port_that_is_not_there_or_is_nobodys_is_refused_with_what_to_do():
    with pytest.raises(DeviceError, match="/dev/nowhere at 1000000 baud cannot be opened.*plugged in"):
        by_serial("door", "/dev/nowhere", 1_000_000)
    master, slave = os.openpty()
    try:
        door = make("door", Settings(kind="door", driver="serial", port=os.ttyname(slave)), Path())
        with pytest.raises(DeviceError, match="no door simulator answers"):
            door.open()
    finally:
        os.close(master)
        os.close(slave)


def test_a_twin_does_not_hear_the_ctrl_c_that_its_host_hears():
    twin = TwinProcess("door")
    try:
        twin.start(1.0, 1, Limits(), 1_000_000)
        assert os.getpgid(twin.process.pid) != os.getpgid(0)
    finally:
        twin.end()


def test_a_twin_that_cannot_start_is_refused():
    with pytest.raises(DeviceError, match="did not start"):
        by_twin("door", 1.0, 1, Limits(), 1_000_000, more=("--nonsense",))
