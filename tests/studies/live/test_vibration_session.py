"""A live session at a rig of twins with a vibrator and masking noise: its ledger, and the dose of the day."""

from datetime import date, timedelta
from types import SimpleNamespace

import pytest

from palpate.devices.device import DeviceError
from palpate.devices.rig.file import rig_path
from palpate.devices.sound.dose import share_of_day
from palpate.devices.vibrator.exposure import weighted_energy
from palpate.protocols.canonical import encoded
from palpate.protocols.events import Event
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.signals.vibration import read_vibration, waveform
from palpate.studies.catalogue import StudyFiles
from palpate.studies.live import opening as live_rig
from palpate.studies.live.daily_dose import _seconds_on, demand_dose, local_day, noise_had, runs_on, vibration_had
from palpate.studies.live.opening import live_plan
from palpate.studies.live.options import LiveOptions
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session import start
from tests.studies.live.rig_rooms import Room

RIG = """rig: twins
devices:
  shaker: {kind: vibrator, driver: twin, rate_hz: 8000, bits: 24}
  noise: {kind: masking_noise, driver: twin, rate_hz: 8000, db_spl_at_0_dbfs: 100}
needs:
  vibration: [shaker]
  masking_noise: [noise]
"""
SINE = {"waveform": "sine", "level_db": "10", "seconds": "0.2"}


def vibrations(folder, **changes):
    given = {
        "study": "vibrations", "task": "slider_rating", "needs": ["vibration", "masking_noise", "window"],
        "stimuli": [{"id": f"f{hz}", "columns": {**SINE, "frequency_hz": str(hz)}} for hz in (50, 250)],
        "attributes": [{"name": "strength", "low": "weak", "high": "strong"}],
        "scale": {"from": 0, "to": 100, "start": "unset"}, "order": {"design": "as_listed"}, **changes,
    }  # fmt: skip
    return StudyFiles(Study.model_validate(given), folder)


@pytest.fixture
def lab(tmp_path, monkeypatch):
    rig = rig_path(tmp_path)
    rig.parent.mkdir(parents=True)
    rig.write_text(RIG, encoding="utf-8")
    monkeypatch.setattr(live_rig, "window_of", lambda *_given: lambda plan: Room(Perceiver(plan)))
    monkeypatch.setattr(live_rig, "window_calibration", lambda *_given: None)
    return tmp_path


def test_the_ledger_says_when_what_was_felt_and_which_limits_held_and_the_noise_counts_for_the_day(lab):
    study_files = vibrations(lab)
    plan = compile_plan(study_files.study, ParticipantRow("P001"))
    result = start(lab, plan, live_plan(study_files, lab, LiveOptions()))
    assert result.complete
    record = read(result.path)
    felt = [event for event in record.events if event.kind == "reply" and "vibration" in event.value]
    requests = [e for e in record.events if e.kind == "request" and e.value["do"] == "present"]
    assert [event.value["vibration"]["level_db"] for event in felt] == [10.0, 10.0]
    for request, reply in zip(requests, felt, strict=True):
        assert request.t_ns <= reply.value["vibration"]["onset_ns"] <= reply.t_ns - 0.19e9
        assert len(reply.value["vibration"]["sha256"]) == 64 and reply.value["by"] == "twin"
    devices = record.header["rig"]["devices"]
    assert devices["shaker"]["limits"]["a8_m_s2"] == 2.5
    assert devices["noise"]["limits"] == {
        "dose": "80 dB(A) for 8 h a day, 3 dB exchange (ITU-T H.870)", "share_before": 0.0, "feed_s": 10.0,
    }  # fmt: skip
    opened = next(note.value["at"] for note in record.run_notes if note.kind == "opened")
    day = local_day(opened)
    seconds = (record.events[-1].t_ns - requests[0].t_ns) / 1e9
    expected = share_of_day(devices["noise"]["db_a"], seconds)
    assert noise_had(lab, "P001", day) == pytest.approx(expected, rel=1e-9) and expected > 0
    assert noise_had(lab, "P002", day) == noise_had(lab, "P001", day + timedelta(1)) == 0.0
    energy = sum(event.value["vibration"]["hand_arm_m2_s3"] for event in felt)
    assert energy == pytest.approx(
        sum(weighted_energy(waveform(read_vibration(s.id, s.columns), 8000), 8000) for s in study_files.study.stimuli),
        rel=1e-5,
    )
    assert vibration_had(lab, "P001", day) == pytest.approx(energy) and vibration_had(lab, "P002", day) == 0.0
    rig_path(lab).write_text(RIG.replace("bits: 24", "bits: 24, limits: {a8_m_s2: 0.0001}"), encoding="utf-8")
    with pytest.raises(DeviceError, match=r"shaker: the participant has had a daily exposure A\(8\) of .* tomorrow"):
        start(lab, plan, live_plan(study_files, lab, LiveOptions()), 2)
    (lab / "sessions" / "vibrations_P001_s9.sqlite").write_bytes(b"no ledger")
    assert noise_had(lab, "P001", day) == pytest.approx(expected)


def test_a_study_that_takes_longer_than_the_dose_lasts_is_refused_before_anything_is_recorded(lab):
    rig_path(lab).write_text(RIG.replace("100}", "91, level_dbfs: -12}"), encoding="utf-8")
    study_files = vibrations(lab, minutes=60 * 20)
    plan = compile_plan(study_files.study, ParticipantRow("P001"))
    with pytest.raises(
        DeviceError, match=r"noise: .*today's dose of noise.* min of this level are left and the session"
    ):
        start(lab, plan, live_plan(study_files, lab, LiveOptions()))
    assert not (lab / "sessions").exists() or not list((lab / "sessions").iterdir())


def event(seq, t_s, kind="reply", **value):
    return Event(seq, round(t_s * 1e9), kind, encoded(value))


def test_only_the_runs_of_the_day_count_and_pauses_do_not():
    events = (
        event(0, 0, "session_started"), event(1, 10, "request", do="ask"), event(2, 20, "request", do="present"),
        event(3, 50, "experimenter", do="pause"), event(4, 1000, "experimenter", do="go_on"), event(5, 1010),
        event(6, 2000, "request", do="ask"), event(7, 2100, "request", do="present"), event(8, 2160),
    )  # fmt: skip
    notes = [
        ("created", 1, "2026-11-27T10:00:00+00:00"), ("opened", 1, "2026-11-27T10:00:00+00:00"),
        ("closed", 6, "2026-11-27T10:20:00+00:00"), ("opened", 6, "2026-11-28T12:00:00+00:00"),
    ]  # fmt: skip
    run_notes = [SimpleNamespace(kind=kind, events=n, value={"at": at}) for kind, n, at in notes]
    record = SimpleNamespace(events=events, run_notes=run_notes)
    first, second = (local_day(at) for _, _, at in (notes[1], notes[3]))
    assert [_seconds_on(run) for run in runs_on(record, first)] == [40.0]
    assert [_seconds_on(run) for run in runs_on(record, second)] == [60.0]
    assert not list(runs_on(record, date(2026, 1, 1)))


def test_a_run_that_begins_within_a_presentation_has_noise_from_its_beginning():
    assert _seconds_on((event(4, 30, presented=True), event(5, 40, "request", do="present"), event(6, 90))) == 60.0


def test_a_vibration_that_was_broken_off_counts_as_the_strongest_of_its_run(lab, monkeypatch):
    """One plays to its end; then one is paused and repeated, one fails, and one plays when the program ends."""
    whole = {"presented": True, "vibration": {"hand_arm_m2_s3": 3.0}}
    broken = (
        event(0, 0, "request", do="present"), event(1, 1, **whole), event(2, 2, "request", do="present"),
        event(3, 3, "experimenter", do="pause"), event(4, 4, "experimenter", do="go_on"),
        event(5, 5, "experimenter", do="repeat"), event(6, 6, "request", do="present", blank=True),
        event(7, 7, "experimenter", do="repeat"), event(8, 8, "request", do="present"), event(9, 9, "fault"),
        event(10, 10, "request", do="ask"), event(11, 11, "experimenter", do="repeat"),
        event(12, 12, "request", do="present"),
    )  # fmt: skip
    header = {"study": {"needs": ["vibration"]}, "rig": {"devices": {"shaker": {"kind": "vibrator"}}}}
    runs = [(header, broken)]
    monkeypatch.setattr("palpate.studies.live.daily_dose.runs_of", lambda *_: iter(runs))
    assert vibration_had(lab, "P001", date(2026, 1, 1)) == 3.0 + 4 * 3.0
    runs[:] = [(header, broken[2:3])]
    assert vibration_had(lab, "P001", date(2026, 1, 1)) == 20.0**2 * 60.0
    runs[:] = [({**header, "study": {}}, broken)]
    assert vibration_had(lab, "P001", date(2026, 1, 1)) == 0.0


def test_a_study_without_noise_has_no_dose():
    demand_dose(None, compile_plan(vibrations(None, needs=["window"]).study, ParticipantRow("P001")), None)


def test_a_rig_with_wider_limits_than_those_of_a_simulated_one_presents_what_it_can(lab):
    columns = {**SINE, "frequency_hz": "250", "seconds": "21", "level_db": "-20"}
    study_files = vibrations(lab, stimuli=[{"id": "long", "columns": columns}], needs=["vibration", "window"])
    plan = compile_plan(study_files.study, ParticipantRow("P001"))
    with pytest.raises(DeviceError, match=r"21 s; at most limits.longest_s = 20 s"):
        live_plan(study_files, lab, LiveOptions()).check(plan)
    rig_path(lab).write_text(RIG.replace("bits: 24", "bits: 24, limits: {longest_s: 30}"), encoding="utf-8")
    live_plan(study_files, lab, LiveOptions()).check(plan)
