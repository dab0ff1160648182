"""A small set of simulated textures, from nothing to ledgers; stopped, resumed, and never overwritten."""

import hashlib
import os
import signal

import pytest
from PIL import Image

from palpate.analysis.features.touch import SEGMENT_S, TRIM_S
from palpate.analysis.features.touch_features import touch_features
from palpate.devices.surfaces.photo import light, photograph, photographs
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.table import read_surfaces
from palpate.modeling.attributes.reading_touch import touches
from palpate.modeling.evaluate.intervals import COVERAGE, needed
from palpate.modeling.textures.reading_ledgers import read_lab
from palpate.protocols.events import Sense
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.lab import demand_lab
from palpate.studies.participants.lab_template import make_lab
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session import resume, start
from palpate.studies.sessions.session_files import SessionStart, ledger_path
from palpate.studies.simulation import texture_set
from palpate.studies.simulation.rig import simulated
from palpate.studies.simulation.texture_set import (
    LEAST_S,
    QUICK,
    STUDIES,
    Pace,
    SetOptions,
    TextureSetError,
    all_textures,
    estimate,
    make_set,
    room_bytes,
    select_textures,
    set_studies,
)
from palpate.studies.simulation.texture_set_rig import Ahead, ToolAhead, felt, rig_for
from palpate.studies.simulation.texture_simulator import SimulatedTextures
from palpate.studies.simulation.twins import ToolTwin
from palpate.studies.stimuli.scenes import WHOLE, Strokes

pytestmark = pytest.mark.usefixtures("shared_grounds")

SMALL = {"textures": ("T46", "T15"), "seconds": 6.0, "pictures": 1, "raters": 2}
ALL = ("texture_capture P001", "texture_photos P001", "texture_ratings P001", "texture_ratings P002")


def make(lab, report=lambda _line: None, **changed):
    return SimulatedTextures().make_set(lab, report, **{**SMALL, **changed})


def events(lab, study, who="P001"):
    """All but the first, which says when and on what."""
    return read(ledger_path(lab, study, who)).events[1:]


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    lab, lines = tmp_path_factory.mktemp("set") / "lab", []
    return lab, make(lab, lines.append), lines


def test_the_sessions_are_real_complete_and_repeat(small):
    lab, sessions, lines = small
    demand_lab(lab)
    assert [f"{session.study} {session.participant}" for session in sessions] == list(ALL)
    assert {session.done for session in sessions} == {"made"} and all(session.complete for session in sessions)
    assert all(replay(session.ledger).complete for session in sessions)
    assert "about" in lines[0] and any(line.startswith("texture_photos: T46, 2 of 2") for line in lines)
    assert "texture_ratings: P002, 2 textures rated" in lines
    assert read(sessions[0].ledger).header["rig"] == {"kind": "simulated", "twins": ["samples", "tool", "window"]}
    assert read(sessions[1].ledger).header["rig"]["pictures"] == 1


def test_what_was_felt_can_be_learned_from_and_says_that_it_is_simulated(small):
    recordings = read_lab(small[0])
    assert [recording.texture for recording in recordings] == ["T15", "T46"]  # in the study's order
    assert all(5.9 < recording.seconds < 6.01 and "simulated" in recording.notes for recording in recordings)
    assert recordings[0].acceleration_m_s2.std() > 2 * recordings[1].acceleration_m_s2.std()  # sandpaper and aluminum


@pytest.mark.needs("librosa", "pywt")
def test_the_shortest_set_has_a_segment_of_touch_to_describe(small):
    """And a half second less would not have."""
    assert 2 * TRIM_S + SEGMENT_S < LEAST_S <= 2 * TRIM_S + 2 * SEGMENT_S
    assert [len(touch_features(recording.touch)["mfcc"]) for recording in touches(small[0])] == [1, 1]


def test_pictures_are_stored_as_a_camera_s_are(small):
    lab = small[0]
    replies = [
        event.value for event in events(lab, "texture_photos") if event.kind == "reply" and "pictures" in event.value
    ]
    for reply, texture in zip(replies, ("T15", "T46"), strict=True):
        (picture,) = reply["pictures"]
        file = lab / "pictures" / picture["file"]
        assert file.parent.name == texture and reply["by"] == "twin" and picture["light"] == 1
        assert hashlib.sha256(file.read_bytes()).hexdigest() == picture["sha256"]
        with Image.open(file) as image:
            assert (image.format, image.size, image.mode) == ("JPEG", (1568, 1568), "RGB")


def test_a_smaller_set_is_a_study_of_the_lab_s_own(small):
    lab = small[0]
    shipped, own = (read_study(root / "texture_capture" / "study.yaml").study for root in (SHIPPED, lab / "studies"))
    seconds = {
        stimulus.id: stimulus.columns["seconds"] for stimulus in own.stimuli if "perception" in stimulus.columns["set"]
    }
    assert seconds == {"T15": "6", "T46": "6"}
    assert own.model_copy(update={"stimuli": shipped.stimuli}).definition() == shipped.definition()
    assert {"pilot", "rendering"} <= {stimulus.columns["set"] for stimulus in own.stimuli}
    assert "50" not in (lab / "studies" / "texture_ratings" / "study.yaml").read_text("utf-8")
    assert not list(lab.glob(".draft*"))


def test_complete_sessions_are_not_simulated_again(small):
    lab = small[0]
    before = {file: file.stat().st_mtime_ns for file in lab.rglob("*") if file.is_file()}
    assert {session.done for session in make(lab)} == {"kept"}
    assert {file: file.stat().st_mtime_ns for file in lab.rglob("*") if file.is_file()} == before


def test_stopped_it_goes_on_and_two_processes_make_the_same(small, tmp_path):
    def stop(line):
        if line.startswith("texture_capture: T15, 1 of 2"):
            os.kill(os.getpid(), signal.SIGINT)

    (stopped,) = make(tmp_path / "lab", stop, workers=2)
    assert not stopped.complete and stopped.ended == "interrupted by SIGINT"
    again = make(tmp_path / "lab")
    assert [session.done for session in again] == ["gone on", "made", "made", "made"]
    for study in STUDIES:
        assert events(tmp_path / "lab", study) == events(small[0], study)


def test_palpate_resume_goes_on_with_pictures_too(tmp_path):
    selection = select_textures(("T46", "T15"), 6.0)
    study_files = read_study(SHIPPED / "texture_photos" / "study.yaml")
    one = set_studies(tmp_path, selection)["texture_photos"].stimuli[:1]
    few = study_files.study.model_copy(update={"stimuli": one})
    plan = compile_plan(few, ParticipantRow("P001", "all"))

    def stop(event):
        if event.kind == "trial_started":
            os.kill(os.getpid(), signal.SIGINT)

    rig = rig_for(type(study_files)(few, study_files.folder), tmp_path, 1, 1, stop)
    result = start(tmp_path, plan, rig)
    assert result.status == "interrupted" and not (tmp_path / "pictures").exists()
    lights = read(result.path).header["rig"]["pictures"]
    assert resume(result.path, simulated(few, study_files.folder, tmp_path, lights)).complete
    assert len(list((tmp_path / "pictures").glob("*/light01-*.jpg"))) == 1


def test_where_people_took_part_no_simulated_ones_join_them(tmp_path, monkeypatch):
    existing = SessionStart("door_ratings", ParticipantRow("P001"), 0, in_person=True)
    monkeypatch.setattr(texture_set, "session_starts", lambda ledgers: iter([existing]))
    with pytest.raises(TextureSetError, match="people took part here"):
        make(tmp_path / "lab")
    assert not (tmp_path / "lab").exists()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"seed": 1}, "it has seed 0, not 1"),
        ({"pictures": 2}, "it keeps 1 pictures of each texture, not 2"),
        ({"seconds": 7.0}, "texture_capture already, which is not of 2 textures x 7 s"),
        ({"textures": ("T46", "T15", "T01")}, "which is not of 3 textures x 6 s"),
        ({"textures": (), "seconds": None}, "which is not of 50 textures x 60 s"),
        ({"raters": 1}, "P002_s1.sqlite: a session of texture_ratings that is not of 1 simulated"),
    ],
)
def test_another_set_is_refused_and_nothing_is_written(small, changed, words):
    lab = small[0]
    before = sorted(lab.rglob("*"))
    with pytest.raises(TextureSetError, match=words):
        make(lab, **changed)
    assert sorted(lab.rglob("*")) == before


def test_more_raters_are_added(small):
    sessions = make(small[0], raters=3)
    assert [session.done for session in sessions] == ["kept"] * 4 + ["made"]
    ledger_path(small[0], "texture_ratings", "P003").unlink()


def test_a_lab_s_sessions_are_left_alone(tmp_path):
    study_files = read_study(SHIPPED / "texture_ratings" / "study.yaml")
    lab = tmp_path / "lab"
    plan = compile_plan(study_files.study, ParticipantRow("P007"), 0, texture_set.plans_of(
        study_files.study, lab, ["P007"], 0, False)[0].lab_forms)  # fmt: skip
    start(lab, plan, simulated(study_files.study, study_files.folder, lab))
    with pytest.raises(TextureSetError, match="P007_s1.sqlite: a session of texture_ratings that is not of 2"):
        make(lab)
    assert not (lab / "studies").exists() and not (lab / "participants.json").exists()


def test_who_withdrew_is_reported_before_anything_is_written(tmp_path):
    make_lab(tmp_path / "lab")
    registry = open_registry(tmp_path / "lab")
    enter(registry, "P002")
    withdraw(registry, "P002", "asked to")
    registry.engine.dispose()
    before = sorted((tmp_path / "lab").rglob("*"))
    with pytest.raises(TextureSetError, match="P002 withdrew here.*needs its own lab, or fewer raters"):
        make(tmp_path / "lab")
    assert sorted((tmp_path / "lab").rglob("*")) == before and not list((tmp_path / "lab" / "sessions").glob("*"))


def test_a_recording_made_ahead_is_the_tool_s_own(tmp_path):
    """Whatever the workers, and wherever in the session it is requested: equal bytes and times."""
    study = read_study(SHIPPED / "texture_capture" / "study.yaml").study
    plan = compile_plan(study, ParticipantRow("P001", "perception"))
    request, at_ns = Sense("tool", 1.5, plan.trials[3]), 7_000_000_123
    tool = ToolTwin(plan, Strokes(plan, WHOLE))
    ahead = Ahead(felt, plan)
    assert ToolAhead(tool, ahead)(request, at_ns) == tool(request, at_ns)
    assert {block.t0_ns for block in tool(request, at_ns).reply.samples} == {at_ns}


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"textures": ("T1", "T15")}, "no texture is called 'T1'; did you mean 'T01'"),
        ({"textures": ("T99",)}, "no texture is called 'T99'; did you mean"),
        ({"textures": ("T01",)}, "2 or more are needed"),
        ({"seconds": 0.0}, "0 s of each texture: from 6 to 3600"),
        ({"seconds": 5.9}, "5.9 s of each texture: from 6 to 3600 s are expected, as 2.5 s are left out at both ends"),
        ({"seconds": float("nan")}, "nan s of each texture"),
        ({"pictures": 11}, "11 pictures of each texture: from 1 to 10"),
        ({"raters": 0}, "0 raters"),
        ({"workers": 0}, "0 workers"),
    ],
)
def test_what_cannot_be_simulated_is_reported(tmp_path, changed, words):
    with pytest.raises(TextureSetError, match=words):
        make(tmp_path / "lab", **changed)
    assert not (tmp_path / "lab").exists()


def test_a_full_disk_is_reported_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(texture_set.shutil, "disk_usage", lambda _path: type("Usage", (), {"free": 10**6})())
    with pytest.raises(TextureSetError, match=r"0.001 GB free, and the set takes 1.* GB"):
        make_set(tmp_path / "lab", SetOptions(select_textures()), lambda _line: None)
    assert not (tmp_path / "lab").exists()


def test_the_sets_and_their_size():
    assert len(all_textures()) == 50 and select_textures().is_shipped and not select_textures(QUICK, 8.0).is_shipped
    assert 0.8e9 < room_bytes(SetOptions(select_textures())) < 2e9
    assert "50 textures x 60 s, 10 pictures of each, 20 simulated raters" in estimate(SetOptions(select_textures()))
    classes = {stimulus.id: stimulus.columns["class"] for stimulus in planned_ratings().stimuli}
    assert len({classes[name] for name in QUICK}) == len(QUICK) >= needed(COVERAGE)


def test_the_time_left_is_what_the_steps_so_far_took_by_their_weights():
    seconds = iter((100.0, 130.0, 200.0))
    pace = Pace({"slow": 3.0, "quick": 1.0}, 10.0, lambda: next(seconds))
    assert pace.step("slow") == 7 / 3 * 30.0  # 3 of 10 took 30 s
    pace.skip("quick", 2)
    assert pace.step("quick") == 4 / 4 * 100.0


def planned_ratings():
    return read_study(SHIPPED / "texture_ratings" / "study.yaml").study


def test_photos_taken_together_are_those_taken_alone():
    surface = read_surfaces()["T33"]
    field = relief(surface, pixels=196)
    together = list(photographs(surface, field, (light(0), light(6)), "key"))
    assert (together[0] == photograph(surface, field, light(0), "key")).all()
    assert (together[1] == photograph(surface, field, light(6), "key")).all()
