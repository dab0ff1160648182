"""A threshold study with a vibrator: every level of the grid is checked first, and every reply says what was felt."""

from pathlib import Path

import pytest

from palpate.devices.device import DeviceError
from palpate.devices.rig import file as rig_file
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.opened import open_rig
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.live.station import demand_within_limits, rig_station
from palpate.studies.sessions.record import read
from palpate.studies.sessions.rig import RigError
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated

RIG = (
    "rig: a\ndevices:\n  shaker: {{kind: vibrator, driver: twin, rate_hz: 8000{more}}}\nneeds:\n  vibration: [shaker]\n"
)


def threshold(folder, to=10, onset=""):
    """The shipped study without what is not about vibration, cut to 24 trials."""
    text = (SHIPPED / "vibration_threshold" / "study.yaml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("opening:", "noise:", "onset_ms:", "needs:"))]
    text = "\n".join([*lines, "needs: [window, vibration]", onset]) + "\n"
    text = text.replace("stop: {trials: 60, threshold_sd: 1.2, at_least: 32}", "stop: {trials: 24}")
    text = text.replace("level_db, from: -40, to: 10, points: 51", f"level_db, from: -40, to: {to}, points: 51")
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    study_files = read_study(folder / "study.yaml")
    return study_files, compile_plan(study_files.study, ParticipantRow("P001"))


def opened(folder, more=", bits: 24"):
    (folder / "rig.yaml").write_text(RIG.format(more=more))
    return open_rig(read_rig(folder / "rig.yaml"), ["shaker"])


def test_a_simulated_session_says_when_how_long_how_strong_and_which_waveform(tmp_path):
    study_files, plan = threshold(tmp_path)
    result = start(tmp_path / "lab", plan, simulated(study_files.study, study_files.folder))
    assert result.complete
    replies = [e for e in read(result.path).events if e.kind == "reply" and "vibration" in e.value]
    felt = [event.value["vibration"] for event in replies]
    assert len(felt) > 48 and all(one["seconds"] == 0.6 for one in felt)
    assert sum("blank" in one for one in felt) == len(felt) // 2
    digests = {(one["level_db"], one["sha256"]) for one in felt if "sha256" in one}
    assert len(digests) > 8 and all(event.value["vibration"]["onset_ns"] <= event.t_ns for event in replies)


def test_the_whole_grid_is_checked_before_the_first_event(tmp_path):
    study_files, plan = threshold(tmp_path, to=60)
    lab = tmp_path / "lab"
    with pytest.raises(RigError, match=r"vibrator: stimulus 'f\d+' \(.*limits.peak_m_s2 = 300"):
        start(lab, plan, simulated(study_files.study, study_files.folder))
    assert not list(lab.rglob("*.ledger")) and not list(lab.rglob("*.sqlite"))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            "",
            r"stimulus 'f\d+': -40 dB re 1 m/s.2 RMS at \d+ Hz; its calibration covers -?\d+(.\d)? to \d\d",
        ),
        (", bits: 24, limits: {peak_V: 0.01, rms_V: 0.01}", r"stimulus 'f\d+': -?\d+ dB .* its calibration covers -"),
    ],
)
def test_a_rig_that_cannot_play_a_level_of_the_grid_is_refused(tmp_path, more, message):
    study_files, plan = threshold(tmp_path)
    rig = opened(tmp_path, more)
    with pytest.raises(DeviceError, match=message):
        demand_within_limits(rig, study_files, plan)
    rig.close()


def test_a_rig_of_a_twin_plays_the_grid_and_presents(tmp_path):
    study_files, plan = threshold(tmp_path)
    rig = opened(tmp_path)
    demand_within_limits(rig, study_files, plan)
    assert rig_station(rig, study_files, plan, tmp_path).presents is rig.devices["shaker"]
    described = rig.describe()["shaker"]
    assert described["limits"]["peak_m_s2"] == 300 and "its own equation" in described["response"]
    rig.close()


def test_a_study_that_bounds_its_onset_is_refused_at_a_station_that_was_never_certified(tmp_path):
    study_files, plan = threshold(tmp_path, onset="onset_ms: {p99: 50}")
    rig = opened(tmp_path)
    with pytest.raises(DeviceError, match="the study bounds its onset, and it was never certified"):
        demand_within_limits(rig, study_files, plan)
    rig.close()


def test_the_rig_of_twins_is_certified_as_it_is_written(tmp_path):
    study_files, plan = threshold(tmp_path, onset="onset_ms: {p99: 50}")
    shipped = read_rig(Path(rig_file.__file__).with_name("twins.yaml"))
    rig = open_rig(shipped, ["shaker"])
    demand_within_limits(rig, study_files, plan)
    rig.close()
