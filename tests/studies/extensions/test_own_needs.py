"""A lab's own need whose device records a stimulus while it is explored."""

import os
import sys

import pytest

from palpate.command_line import _status
from palpate.devices.rig.file import rig_path
from palpate.protocols.extensions import used
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import read_study
from palpate.studies.extensions.finder import LabExtensions, forget_lab_modules
from palpate.studies.live import opening as live_rig
from palpate.studies.live.opening import live_plan
from palpate.studies.live.options import LiveOptions
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session import start
from tests.studies.extensions.labs import add_study
from tests.studies.live.rig_rooms import Room

NEED = """from palpate.protocols.needs import Need, Taken
NEEDS = {"skin": Need("records", {"thermometer": Taken("skin_degc", 4.0)})}
"""
STUDY = """study: skin
task: capture
stimuli: [{id: wool}, {id: steel}]
capture: {device: acme.skin, seconds: 0.8}
order: {design: as_listed}
needs: [window, acme.skin]
"""
RIG = """rig: skin
devices:
  hand: {kind: thermometer, driver: twin, rate_hz: 4}
needs:
  acme.skin: [hand]
"""


@pytest.fixture
def lab(tmp_path, monkeypatch):
    lab = tmp_path / "lab"
    assert _status(["init", str(lab)]) == 0
    (lab / "extensions").mkdir()
    (lab / "extensions" / "acme.py").write_text(NEED, encoding="utf-8")
    (lab / "lab.yaml").write_text("extensions: true\n", encoding="utf-8")
    add_study(lab, "skin", STUDY)
    rig_path(lab).parent.mkdir(parents=True)
    rig_path(lab).write_text(RIG, encoding="utf-8")
    monkeypatch.setattr(live_rig, "window_of", lambda *_given: lambda plan: Room(Perceiver(plan)))
    monkeypatch.setattr(live_rig, "window_calibration", lambda *_given: None)
    reading, writing = os.pipe()  # the experimenter confirms that each sample is in place
    os.write(writing, b"confirm\n" * 2)
    with used(LabExtensions(lab)), os.fdopen(reading) as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        yield lab
    os.close(writing)
    forget_lab_modules()


def streams(path):
    return [(block.stream, block.units) for event in read(path).events for block in event.samples if block.count > 2]


def test_it_is_simulated_at_rest(lab):
    assert _status(["run", "skin", "--participant", "P001", "--simulate", "--lab", str(lab)]) == 0
    assert streams(lab / "sessions" / "skin_P001_s1.sqlite") == [("skin_degc", ("degC",))] * 2


@pytest.mark.parametrize("twins", [False, True], ids=["rig", "twins"])
def test_it_records_in_a_live_session(lab, twins):
    study_files = read_study(lab / "studies" / "skin" / "study.yaml")
    plan = compile_plan(study_files.study, ParticipantRow("P001"))
    result = start(lab, plan, live_plan(study_files, lab, LiveOptions(twins=twins)))
    assert result.complete and streams(result.path) == [("skin_degc", ("degC",))] * 2
