"""palpate record: recordings are reported stream by stream, and mistakes before anything is recorded."""

import io
import json
import sys
from pathlib import Path

import pytest
from click.exceptions import Exit

from palpate.command_line import _status
from palpate.devices.rig.file import rig_path
from palpate.studies.commands_sessions import recorded, report
from palpate.studies.sessions.session import SessionResult
from tests.analysis.streams.ledgers import Written

pytestmark = pytest.mark.usefixtures("shared_grounds")

STUDY = """study: quick
title: A texture, quickly
task: capture
stimuli: [T15]
capture: {device: tool, seconds: 0.3}
order: {design: as_listed}
needs: [samples, tool]
simulation: {latents: {}, present_s: 1}
"""
RIG = """rig: twins
devices:
  vibration: {kind: accelerometer, driver: twin, rate_hz: 3000}
  force: {kind: force_torque, driver: twin, rate_hz: 8000, zero_s: 0}
  tracker: {kind: tracker, driver: twin}
  stage: {kind: stage, driver: twin, mount_s: 0}
  camera: {kind: camera, driver: twin, lights: 2}
needs:
  tool: [vibration, force, tracker]
  samples: [stage]
  camera: [camera]
"""
STREAMS = ("tool_acceleration", "tool_force", "tool_position")


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A lab with a rig of twins, a study of a texture, one of photos, and P001, P002; without a terminal."""
    assert _status(["init", str(tmp_path)]) == 0
    photos = STUDY.replace("tool", "camera").replace("0.3", "60")
    for name, text in (("quick", STUDY), ("photos", photos)):
        (tmp_path / "studies" / name).mkdir(parents=True)
        (tmp_path / "studies" / name / "study.yaml").write_text(text.replace("quick", name, 1), encoding="utf-8")
    rig_path(tmp_path).parent.mkdir(parents=True)
    rig_path(tmp_path).write_text(RIG, encoding="utf-8")
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    for who in ("P001", "P002"):
        assert _status(["participants", "add", "--pseudonym", who, "--lab", str(tmp_path)]) == 0
    return tmp_path


@pytest.fixture
def run(lab, run_palpate):
    """Return a function that runs `palpate record ...` in the lab."""
    return lambda *arguments, status=0: run_palpate("record", *arguments, "--lab", lab, status=status)


def ledgers(lab):
    return sorted(path.name for path in (lab / "sessions").glob("*.sqlite"))


def test_a_recording_at_the_rig_is_reported_stream_by_stream(run, lab):
    text = run("quick", "--participant", "P001")
    for stream in STREAMS:
        [line] = [line for line in text.splitlines() if line.startswith(f"trial 1, {stream}: ")]
        assert int(line.split(": ")[1].split()[0].replace(",", "")) > 20 and ", none lost" in line
    assert "complete: " in text.splitlines()[-1] and ledgers(lab) == ["quick_P001_s1.sqlite"]


def test_a_simulated_recording_is_reported_as_simulated_and_needs_no_rig(run, lab):
    rig_path(lab).unlink()
    text = run("quick", "--participant", "P001", "--simulate")
    assert "trial 1, tool_acceleration: 900 samples, 3000.00 Hz, simulated" in text
    assert "trial 1, tool_position: 36 samples, 120.00 Hz, simulated" in text and "\ncomplete: " in text


def test_as_json_the_answer_stands_alone(run, lab):
    [row] = json.loads(run("quick", "--participant", "P001", "--json"))
    assert row["complete"] and row["ledger"].endswith("quick_P001_s1.sqlite")


@pytest.mark.long
def test_pictures_are_reported_and_lie_in_the_lab_wherever_the_rig_file_lies(run, lab):
    elsewhere = lab / "rigs" / "booth.yaml"
    elsewhere.parent.mkdir()
    rig_path(lab).rename(elsewhere)
    text = run("photos", "--participant", "P001", "--rig", elsewhere)
    assert "trial 1, camera: 2 pictures" in text
    assert {picture.parent.name for picture in (lab / "pictures").rglob("light*.png")} == {"T15"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("qick", "--participant", "P001"), "no study is called 'qick'; did you mean 'quick'?"),
        (("door_ratings", "--participant", "P001"), "it asks, and no sensor records. palpate run door_ratings"),
        (("quick", "--participant", "P009"), "P009 is not known in "),
        (("quick",), "Missing option '--participant'"),
        (("quick", "--participant", "P001..P002"), "only simulated sessions run several at once"),
        (("quick", "--participant", "P001", "--rig", "nowhere.yaml"), "nowhere.yaml: no rig file there"),
        (("quick", "--participant", "P001", "--session", "2"), "P001 has no session 1; give --session 1"),
        (("quick", "--participant", "P001", "--twins", "--rig", "a.yaml"), "--rig names devices to open, and with"),
        (("quick", "--participant", "P001", "--simulate", "--rig", "a.yaml"), "--simulate needs no window and no rig"),
    ],
)
def test_a_mistake_is_reported_and_nothing_is_recorded(run, lab, words, message):
    assert message in run(*words, status=2)
    assert not ledgers(lab)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: None, "this station has no rig file"),
        (lambda text: text.replace("  tool: [vibration, force, tracker]\n", ""), "the need 'tool' is not provided"),
        (lambda text: text.replace("rate_hz: 8000", "rate: 8"), "line 4: devices.force.rate: unknown key"),
        (
            lambda text: text.replace("force_torque, driver: twin", "force_torque, driver: twin, calibration: FT1.cal"),
            "FT1.cal",
        ),
        (
            lambda text: text.replace("tracker, driver: twin", "tracker, driver: recording, recording: gone.csv"),
            "gone.csv",
        ),
    ],
    ids=["no file", "no need", "mistake in it", "no calibration", "cannot be opened"],
)
def test_an_unusable_rig_is_reported_and_nothing_is_recorded(run, lab, change, message):
    text = change(RIG)
    rig_path(lab).unlink() if text is None else rig_path(lab).write_text(text, encoding="utf-8")
    assert message in run("quick", "--participant", "P001", status=2)
    assert not ledgers(lab)


@pytest.mark.long
def test_a_second_session_has_a_number_of_its_own(run, lab):
    run("quick", "--participant", "P001")
    before = (lab / "sessions" / "quick_P001_s1.sqlite").read_bytes()
    assert "if a further one is meant, give --session 2" in run("quick", "--participant", "P001", status=2)
    assert (lab / "sessions" / "quick_P001_s1.sqlite").read_bytes() == before
    run("quick", "--participant", "P001", "--session", "2")
    assert ledgers(lab) == ["quick_P001_s1.sqlite", "quick_P001_s2.sqlite"]


def stream(samples, lost=0, **more):
    return {"samples": samples, "lost": lost, "gaps": int(lost > 0), "rate_hz": 3000.0, **more}


def test_a_recording_that_was_repeated_or_faulted_is_not_reported(tmp_path):
    written = Written(tmp_path / "session.sqlite")
    written.begin(1, 1)
    written.done(a=stream(10))
    written.note("fault", {"device": "daq", "what": "silent", "message": "gone"})
    written.end("faulted")
    written.begin(1, 2)
    written.done(a=stream(20, lost=3, drift_ppm=49.6))
    written.end()
    written.begin(2)
    written.done(a=stream(30))
    written.end()
    written.begin(3)
    written.experimenter(do="repeat", which="last")
    written.end("repeated")
    written.begin(2, 2)
    written.experimenter(do="abort")
    assert list(recorded(written.record())) == ["trial 1, a: 20 samples, 3000.00 Hz, 3 LOST in 1 gap, clock +50 ppm"]


def test_the_way_to_go_on_names_the_rig_file_that_was_named(capsys):
    result = SessionResult(Path("lab/sessions/quick_P001_s1.sqlite"), "interrupted", 7, "interrupted by QUIT")
    with pytest.raises(Exit) as caught:
        report([result], False, "quick", Path("my rigs/a.yaml"))
    assert caught.value.exit_code == 1
    assert "palpate resume lab/sessions/quick_P001_s1.sqlite --rig 'my rigs/a.yaml'" in capsys.readouterr().out
