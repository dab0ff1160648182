"""A rehearsal plays the whole study fast, keeps out of the lab's sessions, and can be broken into."""

from __future__ import annotations

from dataclasses import replace

import pytest

from palpate.protocols.events import NS
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.simulated_world import Simulated, VirtualClock
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, StudyFiles, read_study
from palpate.studies.launching.launch import lab_forms
from palpate.studies.live.options import LiveOptions
from palpate.studies.live.rehearsal import Rehearsed, rehearsal_plan, rehearse
from palpate.studies.procedures.advised import advised
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session import start
from palpate.studies.sessions.session_files import ledgers_in, others_in
from palpate.studies.simulation.twins import HandedOver
from tests.studies.live.halls import Hall, sheets, sheets_plan

FAST = LiveOptions(rehearse=True, no_window=True, pace_s=0.0)


@pytest.fixture(autouse=True)
def nobody_at_the_terminal(monkeypatch):
    """No input; lines go where pytest catches them."""
    monkeypatch.setattr("sys.stdin", None)


class Rehearsing(Hall):
    """A hall in which a rehearsal takes place, in virtual time."""

    pace_s = 0.4

    def _furnish(self, plan, t_ns, presenter, opened):
        rig = super()._furnish(plan, 0, presenter, opened)
        session = advised(plan, Simulated(Perceiver(plan), HandedOver(plan), VirtualClock(t_ns)))
        self.world = Rehearsed(session, presenter, self.desk, self.pace_s, self.time.seconds)
        return replace(rig, world=self.world)


def test_a_rehearsal_is_a_session_of_its_own_that_nothing_collects(tmp_path):
    study_files = StudyFiles(sheets(), tmp_path)
    for number in (1, 2):
        result = rehearse(tmp_path, sheets_plan(), rehearsal_plan(study_files, tmp_path, FAST))
        assert result.complete and result.path.name == f"sheets_P001_s{number}.sqlite"
        assert result.path.parent == tmp_path / "rehearsals" / "sessions"
    assert not ledgers_in(tmp_path) and not others_in(tmp_path) and not (tmp_path / "sessions").exists()
    record = read(result.path)
    assert record.header["rig"]["kind"] == "rehearsal" and record.header["calibration"] is None
    replay(result.path)


@pytest.mark.parametrize(
    ("study", "group", "least_s"),
    [("door_ratings", "1", 900), ("door_authoring", None, 60), ("texture_similarity", None, 400)],
)
def test_a_shipped_study_is_rehearsed_at_once_and_reports_how_long_it_takes(tmp_path, study, group, least_s):
    study_files = read_study(SHIPPED / study / "study.yaml")
    forms = lab_forms(study_files.study, tmp_path, live=False)
    plan = compile_plan(study_files.study, ParticipantRow("P001", group), 0, forms)
    result = rehearse(tmp_path, plan, rehearsal_plan(study_files, tmp_path, FAST))
    assert result.complete and read(result.path).events[-1].t_ns > least_s * NS


def test_every_form_is_shown_for_a_moment_and_every_waiting_page_once(tmp_path):
    hall = Rehearsing()
    plan = compile_plan(sheets(instructions="Feel.", rest={"every": 2}), ParticipantRow("P001"))
    record = read(start(tmp_path, plan, hall.rig).path)
    assert [page for page in hall.stage.pages if page != "answered"] == [
        "instruct", "changing_sample", "feel_now", "sliders", "sliders", "rest", "sliders", "sliders", "end",
    ]  # fmt: skip
    assert hall.time.seconds() == pytest.approx(8 * 0.4, abs=1.0)
    assert record.events[-1].t_ns > 60e9, "session time is the simulated one"


def test_a_rehearsal_heeds_the_experimenter(tmp_path):
    hall = Rehearsing([(0.1, "pause"), (9.0, "note x"), (9.0, "go on"), (9.5, "repeat"), (10.0, "abort seen enough")])
    record = read(start(tmp_path, sheets_plan(), hall.rig).path)
    asides = [event.value["do"] for event in record.events if event.kind == "experimenter"]
    assert asides == ["pause", "note", "go_on", "repeat", "abort"] and record.status == "aborted"
    assert "pause" in hall.stage.pages and hall.time.seconds() >= 10.0
    replay(record.path)


def test_of_intervals_the_numbers_are_shown_the_form_and_whether_it_was_right(tmp_path):
    data = {
        "study": "toy", "task": "intervals", "stimuli": [{"id": "A"}], "intervals": {"standard": 1},
        "procedure": {"kind": "constant", "level": {"column": "level_db", "values": [0, 2]}, "repeats": 4},
        "order": {"design": "random"}, "feedback": {"after": "all"}, "needs": ["window"],
        "simulation": {"observer": {"threshold": 1, "slope": 1}},
    }  # fmt: skip
    hall = Rehearsing()
    start(tmp_path, compile_plan(Study.model_validate(data), ParticipantRow("P001")), hall.rig)
    pages = [page for page in hall.stage.pages if page != "answered"]
    assert pages[:3] == ["interval 1", "interval 2", "intervals"] and pages.count("interval 1") == 1
    assert {"right_answer", "wrong_answer"} & set(pages) and "feel_now" not in pages and "changing_sample" not in pages
