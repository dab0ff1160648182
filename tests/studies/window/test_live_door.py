"""A door that follows the sliders while it is felt: in the real window and in real time, at a rig of twins."""

import subprocess
import sys

import numpy as np
import pytest

from palpate.analysis.streams.recorded_streams import attempts_of, streams_of
from palpate.devices.door.live import RATE_HZ
from palpate.devices.rig.file import rig_path
from palpate.protocols.events import NS, Present
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session_files import ledger_path
from palpate.studies.stimuli.made_doors import FORCES, SETTINGS
from tests.studies.live.rig_rooms import TWINS, live_doors
from tests.studies.window.robot import MOVED, Robot, RunningSession, pending

pytestmark = [pytest.mark.needs("psychopy", "xvfb"), pytest.mark.long]

NAME, RADIUS_M = "door_live", 0.9


@pytest.fixture
def live_lab(lab):
    """A lab with a rig of twins that live as fast as we do, and the shipped study with a live door and one trial."""
    live_doors(lab / "studies" / NAME, practice=False)
    path = rig_path(lab)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(TWINS.replace("twin_speed: 0.25", "twin_speed: 1"), encoding="utf-8")
    return lab


def start_session(hand, lab, *arguments):
    ledger = ledger_path(lab, NAME, "P001")
    session = RunningSession(hand.display.get_display_name(), lab, ledger, list(arguments))
    return session, Robot(hand, session, lab / "studies" / NAME)


def first_run(hand, lab):
    return start_session(hand, lab, "run", NAME, "--participant", "P001", "--lab", str(lab))


def to_its_end(session, robot, seen=-1):
    """The record once the session is over."""
    assert robot.go_on(lambda _request, _record: False, seen).complete
    session.order("confirm")
    session.end(status=0)
    return read(session.ledger)


def palpate(*arguments):
    command = [sys.executable, "-m", "palpate", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def values(stream):
    return np.concatenate([rows for _, rows in stream.pieces()])


def test_the_door_in_the_hand_follows_the_sliders_and_the_screen_shows_its_force(hand, live_lab, tmp_path):
    session, robot = first_run(hand, live_lab)
    record = to_its_end(session, robot)
    reply = next(event.value for event in record.events if "left_at" in event.value)
    assert reply["ended"] == "participant" and reply["by"] == "twin" and reply["opened_deg"] > 20

    live = reply["live"]
    assert live["refused"] == 0 and live["changes"] >= len(MOVED)
    assert live["ticks"] + live["missed"] == pytest.approx(RATE_HZ * reply["seconds"], abs=RATE_HZ / 2)
    assert len(robot.curves) > 5  # the curve was seen to move with the lines

    given = dict(robot.given)["felt"]["answers"]  # where the mirror of the screen has the lines
    assert given == reply["left_at"]
    streams = {stream.name: stream for stream in streams_of(record, 1)}
    settings, forces, door = (values(streams[name]) for name in (SETTINGS, FORCES, "door_telemetry"))
    assert len(settings) == len(forces) == live["changes"] + 1
    assert settings[-1, 4:] == pytest.approx(list(given.values()), abs=1e-4)

    # What the device says of its torque is, at every moment, the profile that it had taken by then.
    clock = streams["door_telemetry"].timing
    door_s = clock.t0_s + np.arange(len(door)) / clock.rate_hz - streams[SETTINGS].blocks[0].t0_ns / NS
    row = np.searchsorted(settings[:, 2], door_s, side="right") - 1
    grid_deg = [float(name.removesuffix(" deg")) for name in streams[FORCES].channels[1:]]
    angle_deg, felt_N = door[:, 0], door[:, 2] / RADIUS_M
    between = (angle_deg > 3) & (angle_deg < 60)  # no stop is felt
    taken_N = np.array([np.interp(at, grid_deg, forces[n, 1:]) for at, n in zip(angle_deg, row, strict=True)])
    start_N = np.interp(angle_deg, grid_deg, forces[0, 1:])
    assert np.median(np.abs(felt_N - taken_N)[between]) < 0.5
    assert np.median(np.abs(felt_N - start_N)[between]) > 2

    assert replay(session.ledger).complete
    palpate("collect", "--lab", live_lab)
    listed = palpate("streams", "list", session.ledger)
    assert all(name in listed for name in (SETTINGS, FORCES, "door_telemetry"))
    palpate("streams", "export", session.ledger, "--raw", "--out", tmp_path / "raw")
    palpate("streams", "export", session.ledger, "--out", tmp_path / "door.csv")
    written = (tmp_path / "raw" / f"{NAME}_P001_s1_t001_act2_{SETTINGS}.csv").read_text().splitlines()
    assert len(written) == 1 + len(settings)


def test_a_door_killed_while_it_is_felt_loses_nothing_and_is_felt_again(hand, live_lab):
    session, robot = first_run(hand, live_lab)
    record = robot.go_on(lambda request, _record: isinstance(request, Present))
    robot.move_lines(pending(record), robot.page_of(record))
    robot.opened(30)
    session.kill()
    killed = read(session.ledger)
    rows = sum(block.count for event in killed.events for block in event.samples if block.stream == SETTINGS)
    assert killed.events[: len(record.events)] == record.events and rows > len(MOVED)

    session, robot = start_session(hand, live_lab, "resume", str(session.ledger))
    record = to_its_end(session, robot, len(killed.events))
    assert record.events[: len(killed.events)] == killed.events
    attempts = attempts_of(record)
    assert [trial_attempt.attempt.ended_as for trial_attempt in attempts] == ["faulted", "answered"]
    broken_off, whole = (streams_of(record, 1, number) for number in (1, 2))
    assert {SETTINGS, FORCES, "door_telemetry"} <= {stream.name for stream in broken_off} & {s.name for s in whole}
    assert replay(session.ledger).complete
