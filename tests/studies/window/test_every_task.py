"""A shipped study of every task in the real window: from the first screen through the first trial, then the last.

Two of them beside a rig of twins: a door's firmware in a process of its own, sensors in threads of their own.
"""

from itertools import pairwise

import pytest

from palpate.devices.rig.file import rig_path
from palpate.protocols.events import Ask, Present, Sense, Show
from palpate.protocols.runner import Recorded, run
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.sessions.ledger import open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import recompiled, replay
from palpate.studies.sessions.session_files import ledger_path
from palpate.studies.simulation.rig import simulated
from tests.studies.live.rig_rooms import TWINS
from tests.studies.window.robot import Robot, RunningSession

pytestmark = pytest.mark.needs("psychopy", "xvfb")

STUDIES = ("door_adjectives", "door_authoring", "door_lexicon", "door_matching", "door_ratings", "texture_capture",
           "texture_similarity", "roughness_magnitude", "vibration_threshold")  # fmt: skip
"""One of every task. Screens of all studies: tests/studies/test_shipped_screens.py."""
FIRST_TRIAL_ONLY = (
    "door_matching",
    "door_lexicon",
    "texture_capture",
    "door_adjectives",
    "roughness_magnitude",
    "vibration_threshold",
)
"""Their last trial and their end are shown as those of door_ratings, where no form follows the trials, and of
texture_similarity, which closes with the same interview as door_adjectives."""
OPTIONS = {"texture_capture": ["--group", "pilot"]}
STREAMS = {
    "door_matching": {"door_telemetry"},
    "texture_capture": {"tool_acceleration", "tool_force", "tool_position"},
}
"""What the rig of twins records, by study; the other studies have the twins that need no rig file."""


class Reached(Exception):
    """The last trial is about to begin."""


class Stops:
    """A ledger that is written up to the last trial."""

    def __init__(self, ledger, last):
        self.ledger, self.last = ledger, last

    def append(self, event):
        if event.kind == "trial_started" and event.trial == self.last:
            raise Reached
        self.ledger.append(event)


def fast_forward(path, folder):
    """Let a simulated participant go on with the session, up to its last trial."""
    ledger = open_for_append(path, {"at": "2026-01-01T00:00:00+00:00"})
    plan, events = recompiled(ledger.record), ledger.record.events
    last = plan.trials[-1].number
    world = simulated(plan.study, folder).open(plan, events[-1].t_ns).world
    tape = Recorded(events, world, Stops(ledger, last))
    if all(event.trial != last for event in events):
        with pytest.raises(Reached):
            run(plan, tape, tape, ledger.record.header)
    ledger.close({"at": "2026-01-01T00:00:00+00:00", "because": "the last trial is to come"})
    return plan


def second_trial(request, record):
    """The first trial is behind the participant."""
    return any(event.kind == "trial_ended" for event in record.events)


def never(_request, _record):
    return False


def live(hand, lab, study, *arguments):
    ledger = ledger_path(lab, study, "P001")
    return RunningSession(hand.display.get_display_name(), lab, ledger, [*arguments])


def test_every_task_of_a_shipped_study_is_among_them():
    tasks = {path.parent.name: read_study(path).study.task for path in SHIPPED.glob("*/study.yaml")}
    assert {tasks[name] for name in STUDIES} == set(tasks.values())


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_s_first_and_last_trial_in_the_window(name, hand, lab):
    study_files = read_study(SHIPPED / name / "study.yaml")
    has_rig = name in STREAMS
    if has_rig:
        rig_path(lab).parent.mkdir(parents=True, exist_ok=True)
        rig_path(lab).write_text(TWINS, encoding="utf-8")
    begin = [name, "--participant", "P001", "--lab", str(lab), *OPTIONS.get(name, [])]
    verb = ["record"] if name == "texture_capture" else ["run"]
    session = live(hand, lab, name, *verb, *begin, *([] if has_rig else ["--twins"]))
    first = Robot(hand, session, study_files.folder)
    first.go_on(second_trial)
    session.order("quit")
    session.end(status=1)
    record = read(session.ledger)
    assert f"interrupted by QUIT; recorded: {len(record.events)} events. Resume with: palpate resume" in " ".join(
        session.output().split()
    )
    assert record.header["rig"]["kind"] == "live"
    assert trial_is_met(record) and not replay(session.ledger).complete
    demand_answers_on_record(record, first)
    if has_rig:
        assert record.header["rig"]["settings"] and record.header["rig"]["twins"]
        assert {block.stream for event in record.events for block in event.samples} >= STREAMS[name]
        ended = next(event.value["as"] for event in record.events if event.kind == "trial_ended")
        assert ended in {"answered", "captured"}
    if name in FIRST_TRIAL_ONLY:
        return

    plan = fast_forward(session.ledger, study_files.folder)
    session = live(hand, lab, name, "resume", str(session.ledger))
    last = Robot(hand, session, study_files.folder, page=first.page)
    assert last.go_on(never).complete
    session.order("confirm")
    session.end(status=0)

    record = read(session.ledger)
    assert record.header["group"] == plan.who.group
    assert [s.value.get("because") for s in record.run_notes if s.kind == "closed"] == [
        "interrupted by QUIT", "the last trial is to come", "complete",
    ]  # fmt: skip
    assert replay(session.ledger).complete
    demand_answers_on_record(record, first, last)


def demand_answers_on_record(record, *robots):
    """Every answer that was given in the window is the one on record."""
    for robot in robots:
        for form, value in robot.given:
            assert value.get("answers") in answers(record, form), f"{form}: another answer was recorded than was given"


def answers(record, form):
    """Every answer on record to a form; [None] for pages that are only read."""
    given = [
        reply.value.get("answers")
        for request, reply in pairwise(record.events)
        if request.kind == "request" and request.value.get("form") == form and reply.kind == "reply"
    ]
    return given or [None]


def trial_is_met(record):
    """What the first trial asks for was performed live."""
    kinds = {"ask": Ask, "present": Present, "sense": Sense, "show": Show}
    first = [event.value["do"] for event in record.events if event.kind == "request" and event.trial == 1]
    return first and set(first) <= set(kinds)
