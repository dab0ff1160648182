"""The real window beside a rig of twins: a door's firmware in a process of its own, sensors in threads of their own."""

import pytest

from palpate.devices.rig.file import rig_path
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session_files import ledger_path
from tests.studies.live.rig_rooms import TWINS
from tests.studies.window.robot import Robot, RunningSession

pytestmark = pytest.mark.needs("psychopy", "xvfb")

STREAMS = {
    "door_ratings": {"door_telemetry"},
    "texture_capture": {"tool_acceleration", "tool_force", "tool_position"},
}
GROUP = {"texture_capture": ["--group", "pilot"]}


def second_trial(_request, record):
    return any(event.kind == "trial_ended" for event in record.events)


@pytest.mark.parametrize("name", STREAMS)
def test_a_trial_with_the_rig_s_twins_in_the_window(name, hand, lab):
    path = rig_path(lab)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(TWINS, encoding="utf-8")
    verb = "record" if name == "texture_capture" else "run"
    begin = [verb, name, "--participant", "P001", "--lab", str(lab), *GROUP.get(name, [])]
    session = RunningSession(hand.display.get_display_name(), lab, ledger_path(lab, name, "P001"), begin)
    Robot(hand, session, read_study(SHIPPED / name / "study.yaml").folder).go_on(second_trial)
    session.order("quit")
    session.end(status=1)
    record = read(session.ledger)
    assert record.header["rig"]["settings"] and record.header["rig"]["twins"]
    chunks = [event for event in record.events if event.kind == "samples"]
    assert {block.stream for event in chunks for block in event.samples} >= STREAMS[name]
    ended = next(event.value["as"] for event in record.events if event.kind == "trial_ended")
    assert ended in {"answered", "captured"}
    replay(session.ledger)
