"""Live sessions through the front door: the real window on a virtual display, an experimenter at a pipe."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.window.display import virtual_display
from palpate.devices.window.calibration import Calibration, write_calibration
from palpate.studies.participants.lab_template import make_lab
from palpate.studies.participants.people import add
from palpate.studies.participants.registry import open_registry
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session_files import ledger_path, ledgers_in

pytestmark = pytest.mark.needs("psychopy", "xvfb")

ROOT = Path(__file__).resolve().parents[3]
SIZE = (1280, 720)
LONGEST_S = 60.0
STUDY = """
study: stroking
task: capture
stimuli: stimuli.csv
capture: {device: tool, seconds: 1}
order: {design: as_listed}
needs: [samples, tool, window]
"""
STIMULI = """id,label,sim_roughness,sim_bumpiness,sim_slipperiness,sim_softness
T01,wood,28,13,64,6
T02,foam,40,30,30,80
T03,mesh,70,60,40,10
"""


@pytest.fixture(scope="module")
def display():
    with virtual_display(*SIZE) as name:
        yield name


@pytest.fixture
def lab(tmp_path):
    make_lab(tmp_path)
    folder = tmp_path / "studies" / "stroking"
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    (folder / "stimuli.csv").write_text(STIMULI, encoding="utf-8")
    write_calibration(tmp_path, Calibration(SIZE, 3.6, 0, "2026-01-01T10:00:00+00:00"))
    add(open_registry(tmp_path), "P001")
    return tmp_path


def command(*arguments):
    return [sys.executable, "-m", "palpate", *arguments]


@contextmanager
def session_process(display, *arguments):
    """A session in a process of its own; it is gone when the block is left, or when it has hung for long."""
    process = subprocess.Popen(
        command(*arguments), cwd=ROOT, env={**os.environ, "DISPLAY": display}, text=True, bufsize=1,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    hung = threading.Timer(LONGEST_S, process.kill)
    hung.start()
    try:
        yield process
    finally:
        hung.cancel()
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()


def order(process, line):
    process.stdin.write(line + "\n")
    process.stdin.flush()


def until(process, expected):
    """Read what the console says until the wanted words have come."""
    lines = []
    while line := process.stdout.readline():
        lines.append(line)
        if expected in line:
            return line
    raise AssertionError(f"{expected!r} did not come:\n{''.join(lines)}")


def run_of(lab):
    return "run", "stroking", "--participant", "P001", "--twins", "--lab", str(lab)


def ended(process):
    """(exit code, the last line)."""
    output, _ = process.communicate(timeout=LONGEST_S)
    return process.returncode, output.splitlines()[-1]


def test_a_session_that_is_killed_in_a_pause_is_resumed_to_its_end(display, lab):
    path = ledger_path(lab, "stroking", "P001")
    with session_process(display, *run_of(lab)) as process:
        until(process, "How many mm")
        order(process, "127.2")
        until(process, "Put in place: T01 (wood)")
        order(process, "note begun late")
        order(process, "confirm")
        until(process, "Put in place: T02 (foam)")
        order(process, "pause")
        until(process, "paused")
        process.send_signal(signal.SIGKILL)
    recorded = read(path).events
    with session_process(display, "resume", str(path)) as process:
        until(process, "went on")
        for _ in range(3):
            order(process, "confirm")
        assert ended(process)[0] == 0
    record = read(path)
    assert record.complete and record.events[: len(recorded)] == recorded
    assert record.header["rig"]["twins"] == ["tool"] and record.header["rig"]["window"]["size_px"] == list(SIZE)
    assert record.header["calibration"]["px_per_mm"] == 3.6
    replies = [event.value for event in record.events if event.kind == "reply"]
    assert replies[0]["measured_mm"] == 127.2
    assert [reply.get("by") for reply in replies[1:]] == ["experimenter", "twin"] * 3
    asides = [event.value["do"] for event in record.events if event.kind == "experimenter"]
    assert asides == ["note", "pause", "go_on"]
    replay(path)


def test_a_line_that_measures_wrong_twice_ends_the_run_and_a_changed_study_is_named(display, lab):
    path = ledger_path(lab, "stroking", "P001")
    with session_process(display, *run_of(lab)) as process:
        until(process, "How many mm")
        recorded = read(path).events
        order(process, "120")
        until(process, "measure once more")
        order(process, "120")
        code, last = ended(process)
        assert code == 2 and "measures 120 mm" in last and "Traceback" not in last
    assert not read(path).ended and read(path).events == recorded
    study = lab / "studies" / "stroking" / "study.yaml"
    study.write_text(STUDY.replace("seconds: 1", "seconds: 2"), encoding="utf-8")
    with session_process(display, "resume", str(path)) as process:
        code, last = ended(process)
        assert code == 2 and "capture.seconds was 1" in last and "--accept-change" in last


def test_a_rehearsal_shows_a_whole_study_and_leaves_no_session(display, lab):
    options = ("--rehearse", "--pace", "0.01", "--participant", "P001", "--lab", str(lab))
    with session_process(display, "run", "door_matching", *options) as process:
        code, last = ended(process)
    assert code == 0, last
    [path] = ledgers_in(lab / "rehearsals")
    assert read(path).complete and read(path).header["rig"]["kind"] == "rehearsal" and not ledgers_in(lab)
