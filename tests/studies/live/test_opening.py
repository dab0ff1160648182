"""What a live rig refuses before anything is recorded, what it is made of, and that it is closed on every way out."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from palpate.devices.samples import HandMounted
from palpate.devices.window.calibration import Calibration, write_calibration
from palpate.devices.window.geometry import WindowError
from palpate.protocols.events import Ask, Reply, Sense
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_world import Done
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, StudyFiles, read_study
from palpate.studies.console.headless import Windowless, asks_anything
from palpate.studies.launching.changes import ScreenChanged
from palpate.studies.live.hardware import twin_station as station
from palpate.studies.live.opening import live_plan, resumed_live_plan, window_of
from palpate.studies.live.options import LiveOptions, resume_options, start_options
from palpate.studies.live.world import Mounted, Station, TwinInRealTime
from palpate.studies.sessions.record import read
from palpate.studies.sessions.rig import RigError
from palpate.studies.sessions.session import start
from tests.studies.live.halls import Hall, Stage, sheets, sheets_plan

SCREEN = Calibration((1920, 1080), 3.62, 0, "2026-01-01T10:00:00")
DOORS = read_study(SHIPPED / "door_ratings" / "study.yaml")


def calibrated(lab: Path) -> Path:
    write_calibration(lab, SCREEN)
    return lab


def test_the_error_of_a_station_without_a_rig_says_how_to_get_one(tmp_path):
    with pytest.raises(RigError, match=r"door_ratings needs door, and .* no rig file .*--twins .*--simulate"):
        live_plan(DOORS, calibrated(tmp_path), LiveOptions())


def test_a_stand_in_is_written_into_the_header(tmp_path):
    plan = live_plan(DOORS, calibrated(tmp_path), LiveOptions(twins=True, language="ko"))
    assert plan.description == {"kind": "live", "window": None, "twins": ["door"], "language": "ko"}
    assert plan.calibration == SCREEN.definition()


@pytest.mark.needs("psychopy")
def test_a_screen_that_was_never_measured_is_refused(tmp_path):
    with pytest.raises(WindowError, match="not calibrated"):
        live_plan(StudyFiles(sheets(), tmp_path), tmp_path, LiveOptions())


def test_the_screens_speak_the_lab_s_own_language_where_it_has_brought_one(tmp_path):
    with pytest.raises(WindowError, match="no texts in language 'fr'.*LAB/texts/fr.yaml"):
        window_of(StudyFiles(sheets(), tmp_path), tmp_path, SCREEN, "fr", True)(sheets_plan())
    (tmp_path / "texts").mkdir()
    (tmp_path / "texts" / "fr.yaml").write_text("next: Suivant\n", encoding="utf-8")
    with pytest.raises(WindowError, match=r"texts/fr\.yaml: the key 'back' is missing"):
        window_of(StudyFiles(sheets(), tmp_path), tmp_path, SCREEN, "fr", True)(sheets_plan())


def test_only_the_calibrated_screen_is_taken(tmp_path):
    with pytest.raises(RigError, match=r"screen 0 is calibrated, and screen 1"):
        live_plan(StudyFiles(sheets(), tmp_path), calibrated(tmp_path), LiveOptions(screen=1))
    smaller = live_plan(StudyFiles(sheets(), tmp_path), tmp_path, LiveOptions(windowed=(1280, 720)))
    assert smaller.calibration["size_px"] == [1280, 720] and smaller.calibration["px_per_mm"] == 3.62


def header(**changes):
    rig = {"kind": "live", "twins": ["door"], "language": "ko"}
    return {"rig": rig, "calibration": SCREEN.definition(), **changes}


def test_a_session_goes_on_with_its_stand_ins_and_its_language(tmp_path):
    plan, accepted = resumed_live_plan(DOORS, calibrated(tmp_path), LiveOptions(), header())
    assert plan.description["twins"] == ["door"] and plan.description["language"] == "ko" and accepted is None


def test_a_session_goes_on_at_another_screen_only_where_that_is_accepted(tmp_path):
    other = header(calibration={**SCREEN.definition(), "size_px": [1280, 1024]})
    with pytest.raises(ScreenChanged):
        resumed_live_plan(DOORS, calibrated(tmp_path), LiveOptions(), other)
    _, accepted = resumed_live_plan(DOORS, tmp_path, LiveOptions(accept_change=True), other)
    assert accepted["calibration_before"]["size_px"] == [1280, 1024]


def test_a_rehearsal_is_not_resumed(tmp_path):
    with pytest.raises(RigError, match="rehearse again"):
        resumed_live_plan(DOORS, tmp_path, LiveOptions(), header(rig={"kind": "rehearsal"}))


def test_samples_are_mounted_by_hand_and_devices_present_what_is_theirs(tmp_path):
    assert isinstance(station(sheets_plan(), tmp_path, []).presents, HandMounted)
    of_doors = station(compile_plan(DOORS.study, ParticipantRow("P001", "1")), DOORS.folder, ["door"])
    assert isinstance(of_doors.presents, TwinInRealTime) and not of_doors.records
    both = sheets_plan(needs=["samples", "texture_renderer", "window"])
    opened = station(both, tmp_path, ["texture_renderer"])
    assert isinstance(opened.presents, Mounted) and opened.presents.presents.name == "texture_renderer"


def test_a_recording_without_a_recorder_is_refused():
    trial = sheets_plan().trials[0]
    with pytest.raises(RigError, match="tool is to record"):
        Station(HandMounted()).perform(Sense("tool", 1.0, trial), Windowless(), None, lambda: 0)


def test_a_recorder_that_cannot_be_ended_leaves_none_of_the_others_running():
    ended = []

    class Recorder:
        def __init__(self, name):
            self.name = name

        def close(self):
            ended.append(self.name)
            if self.name == "camera":
                raise OSError("gone")

    station = Station(HandMounted(), {name: Recorder(name) for name in ("tool", "camera", "door_sensors")})
    with pytest.raises(OSError, match="gone"):
        station.stop()
    assert sorted(ended) == ["camera", "door_sensors", "tool"]


class Falls(Hall):
    """A hall whose furnishing fails after the window has opened."""

    def _furnish(self, plan, t_ns, presenter, opened):
        super()._furnish(plan, t_ns, presenter, opened)
        raise OSError("no terminal")


def test_what_was_opened_is_closed_where_the_rest_cannot_be(tmp_path):
    hall = Falls()
    with pytest.raises(OSError, match="no terminal"):
        start(tmp_path, sheets_plan(), hall.rig)
    assert hall.stage.closed and hall.paper.closed and hall.desk.source.closed


class Stuck(Stage):
    """A window that cannot be closed."""

    def close(self):
        super().close()
        raise RuntimeError("the window does not close")


def test_the_terminal_is_given_back_although_the_window_does_not_close(tmp_path):
    hall = Hall([(0.0, "abort")])
    hall._stage = lambda plan: Stuck(None, hall.time)
    with pytest.raises(RuntimeError, match="does not close"):
        start(tmp_path, sheets_plan(), hall.rig)
    assert hall.paper.closed and hall.desk.source.closed


def test_a_window_that_cannot_be_had_leaves_no_session_behind(tmp_path):
    def no_window(_plan):
        raise WindowError("no display")

    hall = Hall()
    hall._stage = no_window
    with pytest.raises(WindowError):
        start(tmp_path, sheets_plan(), hall.rig)
    assert not (tmp_path / "sessions").exists()


def silent_capture() -> Study:
    """A recording of four samples without anything to read or to answer."""
    data = sheets().definition() | {"task": "capture", "capture": {"device": "tool", "seconds": 2.0}}
    data |= {"needs": ["tool", "samples"], "navigation": "forward", "simulation": None, "rest": None}
    return Study.model_validate({key: value for key, value in data.items() if key not in ("attributes", "scale")})


def test_a_capture_that_shows_nothing_needs_no_window(tmp_path):
    assert not asks_anything(silent_capture()) and asks_anything(sheets())
    study_files = StudyFiles(silent_capture(), tmp_path)
    assert live_plan(study_files, tmp_path, LiveOptions(twins=True)).calibration is None


def test_without_a_window_samples_are_mounted_and_recorded_and_pauses_kept(tmp_path):
    def tool(request, t_ns):
        return Done(Reply({"recorded": True, "seconds": request.seconds}), request.seconds)

    hall = Hall(
        [(1.0, "pause"), (5.0, "go on"), (6.0, "confirm"), (7.0, "pause"), (17.0, "go on"), *[(0.0, "confirm")] * 3],
        station=Station(HandMounted(), {"tool": TwinInRealTime("tool", tool)}),
    )

    def rest(_seconds):
        hall.time.t_ns += 10**8

    hall._stage = lambda _plan: Windowless(hall.time.seconds, rest)
    record = read(start(tmp_path, compile_plan(silent_capture(), ParticipantRow("P001")), hall.rig).path)
    replies = [event for event in record.events if event.kind == "reply"]
    assert record.complete and len(replies) == 8
    assert replies[0].value["seconds"] == pytest.approx(2.0, abs=0.2)
    assert replies[1].value == {"recorded": True, "seconds": 2.0, "by": "twin"}
    assert replies[1].t_ns / 1e9 == pytest.approx(6.0 + 2.0 + 10.0, abs=0.5)
    assert record.header["rig"]["window"] is None


def test_a_question_without_a_window_is_refused():
    trial = sheets_plan().trials[0]
    with pytest.raises(RigError, match="no window"):
        Windowless().perform(Ask(trial.form, trial), None, lambda: 0)


def options_given(*arguments, decorate=start_options):
    given = []

    @click.command()
    @click.option("--json", "as_json", is_flag=True)
    @decorate
    def verb(live: LiveOptions, as_json: bool) -> None:
        given.append(live)

    result = CliRunner().invoke(verb, arguments)
    return given[0] if given else result.output


def test_options_come_as_one():
    assert options_given() == LiveOptions()
    assert options_given("--twins", "--windowed", "1280x720", "--language", "ko", "--json") == LiveOptions(
        twins=True, windowed=(1280, 720), language="ko", as_json=True
    )
    assert options_given("--rehearse", "--no-window", "--pace", "0").pace_s == 0
    assert options_given("--accept-change", decorate=resume_options).accept_change


def test_options_that_mean_nothing_are_refused():
    assert "goes with --rehearse" in options_given("--no-window")
    assert "as 1280x720" in options_given("--windowed", "big")
    assert "No such option" in options_given("--rehearse", decorate=resume_options)


def test_a_study_that_renders_textures_needs_a_rig_or_stand_ins(tmp_path):
    study_files = read_study(SHIPPED / "texture_similarity" / "study.yaml")
    with pytest.raises(RigError, match="needs texture renderer, masking noise, .* no rig file .*--twins"):
        live_plan(study_files, calibrated(tmp_path), LiveOptions())
