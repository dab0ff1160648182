"""The example of a lab's own device, through the commands: from LAB/extensions, and as an installed package."""

import csv
import os
import select
import shutil
import sys
import threading
import time
import tomllib
import tty
from pathlib import Path

import pytest

from palpate.command_line import _status
from palpate.devices.device import DeviceError, DeviceFault
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
from palpate.studies.sessions.session import resume, start
from palpate.studies.simulation.rig import simulated
from tests.studies.labs import stopping
from tests.studies.live.rig_rooms import Room

EXAMPLE = Path(__file__).parents[3] / "examples" / "thermal_plate"
STUDY = "warmth_threshold"
RATINGS = """study: warmth_ratings
task: slider_rating
stimuli: [{id: warm, target_degc: 35, seconds: 3}, {id: hot, target_degc: 41, seconds: 3}]
attributes: [{name: warmth, low: cold, high: hot}]
scale: {from: 0, to: 100, start: unset}
order: {design: as_listed}
needs: [window, thermal.plate]
simulation: {latents: {warmth: {target_degc: 20}}}
"""


def make_lab(lab, in_folder=True):
    """A new lab with the study of the example and its rig of a twin; the code is in LAB/extensions or installed."""
    assert _status(["init", str(lab)]) == 0
    shutil.copytree(EXAMPLE / STUDY, lab / "studies" / STUDY)
    rig_path(lab).parent.mkdir(parents=True)
    shutil.copy(EXAMPLE / "rig.yaml", rig_path(lab))
    if in_folder:
        shutil.copytree(EXAMPLE / "thermal", lab / "extensions" / "thermal")
        (lab / "lab.yaml").write_text("extensions: true\n", encoding="utf-8")
    return lab


@pytest.fixture(scope="module")
def ran_lab(tmp_path_factory):
    lab = make_lab(tmp_path_factory.mktemp("warm") / "lab")
    for who in ("P001", "P002"):
        assert _status(["run", STUDY, "--participant", who, "--simulate", "--lab", str(lab)]) == 0
    return lab


@pytest.fixture
def lab(ran_lab, tmp_path):
    yield shutil.copytree(ran_lab, tmp_path / "lab")
    forget_lab_modules()


@pytest.fixture
def run(lab, capsys):
    def call(*words):
        capsys.readouterr()
        status = _status([*words, "--lab", str(lab)])
        return status, "".join(capsys.readouterr())

    return call


def edit(path, before, after):
    text = path.read_text(encoding="utf-8")
    assert before in text
    path.write_text(text.replace(before, after), encoding="utf-8")


def presented(lab, participant="P001"):
    record = read(lab / "sessions" / f"{STUDY}_{participant}_s1.sqlite")
    return record, [event for event in record.events if event.kind == "reply" and "plate" in event.value]


def test_a_session_holds_what_the_plate_did_and_its_temperature(lab):
    record, replies = presented(lab)
    assert record.header["extensions"]["thermal"]["version"] == "1.0"
    felt = [event.value["plate"] for event in replies]
    assert len(felt) == 2 * 40 and sum("blank" in one for one in felt) == 40
    for one in felt:
        assert one["highest_degc"] == pytest.approx(one.get("target_degc", 32), abs=0.2)
    [samples] = replies[0].samples
    assert samples.stream == "plate" and samples.count > 2 / 0.06


def test_the_study_is_checked_replayed_collected_and_its_threshold_is_that_of_the_simulated_people(run, lab):
    assert run("check", STUDY)[0] == 0
    status, said = run("replay", "--recompute")
    assert status == 0 and "2 of 2 sessions repeat exactly" in said
    assert run("collect")[0] == 0
    assert run("regenerate", STUDY, "--check-plan")[0] == 0
    status, said = run("regenerate", STUDY, "--no-figures", "--no-crosscheck")
    assert status == 0 and "1 question answered, 0 not" in said
    with (lab / "regenerated" / STUDY / "tests" / "thresholds.csv").open(encoding="utf-8") as file:
        rows = {row["participant"]: row for row in csv.DictReader(file)}
    assert float(rows["P002"]["threshold"]) == pytest.approx(34, abs=3 * 0.5)  # study.yaml: threshold_sd
    assert rows["P001"]["outside"] == "above", "too few of the answers are right: no number is made of them"


def test_a_rehearsal_plays_the_study_with_the_twin(run):
    assert run("run", STUDY, "--participant", "P003", "--rehearse", "--no-window")[0] == 0


def events_of(path):
    """The events of a session without their times, and the samples of each."""
    return [
        (
            event.kind,
            event.trial,
            {**event.value, "plate": {**event.value.get("plate", {}), "onset_ns": 0}},
            [block.data for block in event.samples],
        )
        for event in read(path).events
    ]


def test_a_session_that_stops_at_any_act_goes_on_as_one_that_did_not(live_lab):
    """The twin forgets nothing that matters: each presentation begins with a plate at rest."""
    study_files = read_study(live_lab / "studies" / STUDY / "study.yaml")
    plan = compile_plan(study_files.study, ParticipantRow("P001"))
    rig = simulated(study_files.study, study_files.folder)
    whole, stop = start(live_lab, plan, rig), 1
    while not (stopped := start(live_lab, plan, stopping(rig, stop), 1 + stop)).complete:
        assert resume(stopped.path, rig).complete
        assert events_of(stopped.path)[1:] == events_of(whole.path)[1:], f"stopped at act {stop}"
        stop += 1
    assert whole.complete and stop > 2 * 3, "two intervals and an answer in each of two trials"


def test_simulated_people_feel_what_the_plate_reaches(live_lab):
    """At 20 degC/s and 0.4 s, 40 degC is reached; at 1 degC/s not even a degree, so nobody feels anything."""
    study = live_lab / "studies" / STUDY / "study.yaml"
    edit(study, "stop: {trials: 2}", "stop: {trials: 40}")
    edit(study, "threshold_sd: 0.5", "threshold_sd: 0")
    right = {}
    for number, ramp in enumerate(("20", "1"), start=1):
        edit(study, "ramp_degc_s: 20", f"ramp_degc_s: {ramp}")
        study_files = read_study(study)
        rig = simulated(study_files.study, study_files.folder)
        record = read(start(live_lab, compile_plan(study_files.study, ParticipantRow("P001")), rig, number).path)
        asked = [event.value["context"] for event in record.events if event.value.get("form") == "intervals"]
        chosen = [event.value["answers"]["chosen"] for event in record.events if "answers" in event.value]
        right[ramp] = sum(one["target"] == answer for one, answer in zip(asked, chosen, strict=True)) / len(chosen)
    assert right["20"] > 0.65 and right["1"] == pytest.approx(0.5, abs=4 * (0.25 / 40) ** 0.5)


def test_a_rating_study_is_presented_by_the_plate(run, lab):
    folder = lab / "studies" / "warmth_ratings"
    folder.mkdir()
    (folder / "study.yaml").write_text(RATINGS, encoding="utf-8")
    assert run("run", "warmth_ratings", "--participant", "P001", "--simulate")[0] == 0
    record = read(lab / "sessions" / "warmth_ratings_P001_s1.sqlite")
    felt = [event.value["plate"]["highest_degc"] for event in record.events if "plate" in event.value]
    assert felt == [pytest.approx(35, abs=0.3), pytest.approx(41, abs=0.3)]
    edit(folder / "study.yaml", "target_degc: 41", "target_degc: 51")
    status, said = run("check", "warmth_ratings")
    assert status == 1 and "thermal.plate: stimulus 'hot': target_degc is '51'" in said


def test_a_level_beyond_the_limits_is_refused_before_the_first_event_with_its_line(run, lab):
    study = lab / "studies" / STUDY / "study.yaml"
    edit(study, "level: {column: target_degc, from: 32.1, to: 40,", "level: {column: target_degc, from: 32.1, to: 46,")
    status, said = run("check", STUDY)
    assert status == 1 and "study.yaml: line 16" in said and "target_degc is '45.12" in said
    status, said = run("run", STUDY, "--participant", "P009", "--simulate", "--accept-change")
    assert status == 2 and "is allowed" in said and not list((lab / "sessions").glob("*P009*"))


def test_a_column_that_the_plate_does_not_take_is_named(run, lab):
    edit(lab / "studies" / STUDY / "study.yaml", "column: target_degc", "column: target_deg")
    status, said = run("check", STUDY)
    assert status == 1 and "changes nothing that is presented; did you mean 'target_degc'" in said


def test_the_rig_is_checked_and_its_settings_are_explained(run, lab):
    status, said = run("rig", "check")
    assert status == 0 and "ok     plate (thermal.plate, twin): 3" in said
    status, said = run("rig", "kinds", "thermal.plate")
    assert status == 0 and "limits.hot_s" in said
    edit(rig_path(lab), "highest_degC: 42", "highest_degC: 51")
    status, said = run("rig", "check")
    assert status == 2 and "line 3" in said and "highest_degC" in said


def test_a_replay_needs_no_plate(run, lab):
    shutil.rmtree(lab / "extensions")
    status, said = run("replay", "--recompute")
    assert status == 0 and "2 of 2 sessions repeat exactly" in said
    assert run("collect")[0] == 0
    status, said = run("check", STUDY)
    assert status == 1 and "the extension 'thermal' is not here: install the package" in said


@pytest.fixture
def live_lab(tmp_path, monkeypatch):
    """A lab with a short study, and a window in which a simulated person answers."""
    lab = make_lab(tmp_path / "live")
    study = lab / "studies" / STUDY / "study.yaml"
    edit(study, "stop: {trials: 40}", "stop: {trials: 2}")
    edit(study, "seconds: 2, gap_s: 4", "seconds: 0.4, gap_s: 0.1")
    edit(study, "ramp_degc_s: 8, seconds: 2", "ramp_degc_s: 20, seconds: 0.4")
    monkeypatch.setattr(live_rig, "window_of", lambda *_given: lambda plan: Room(Perceiver(plan)))
    monkeypatch.setattr(live_rig, "window_calibration", lambda *_given: None)
    with used(LabExtensions(lab)):
        yield lab
    forget_lab_modules()


@pytest.mark.parametrize("options", [LiveOptions(), LiveOptions(twins=True)], ids=["rig", "twins"])
def test_a_live_session_presents_with_the_rig_s_plate_or_its_twin(live_lab, options):
    study_files = read_study(live_lab / "studies" / STUDY / "study.yaml")
    plan = compile_plan(study_files.study, ParticipantRow("P001"))
    assert start(live_lab, plan, live_plan(study_files, live_lab, options)).complete
    record, replies = presented(live_lab)
    assert len(replies) == 4 and all(event.value["by"] == "twin" for event in replies)
    if not options.twins:
        assert record.header["rig"]["settings"]["plate"]["limits"]["highest_degC"] == 42


def test_a_rig_with_narrower_limits_refuses_the_study_before_the_first_event(live_lab):
    edit(rig_path(live_lab), "highest_degC: 42", "highest_degC: 39")
    study_files = read_study(live_lab / "studies" / STUDY / "study.yaml")
    plan = compile_plan(study_files.study, ParticipantRow("P001"))
    with pytest.raises(DeviceError, match="plate: stimulus 'palm': target_degc is '39.1'; 20 to 39 is allowed"):
        start(live_lab, plan, live_plan(study_files, live_lab, LiveOptions()))
    assert not (live_lab / "sessions").exists() or not list((live_lab / "sessions").iterdir())


@pytest.fixture
def line():
    """A serial line of the operating system, at whose other end a thread has a simulated plate; and its unplugging."""
    import pty

    ours, theirs = pty.openpty()
    tty.setraw(ours)
    tty.setraw(theirs)
    unplugged = threading.Event()

    def serve(port):
        while not unplugged.is_set():
            if select.select([ours], [], [], 0.01)[0]:
                port.write(os.read(ours, 6))
                os.write(ours, port.read(6))

    threads = []

    def begin(port):
        threads.append(threading.Thread(target=serve, args=(port,)))
        threads[0].start()
        return os.ttyname(theirs)

    def unplug():
        unplugged.set()
        threads[0].join()

    yield begin, unplug
    unplug()
    os.close(ours)
    os.close(theirs)


@pytest.mark.needs("serial")
def test_the_same_driver_works_over_a_real_serial_line(line, monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLE))
    from thermal.plate import Settings, make
    from thermal.twin import TwinPort

    begin, unplug = line
    port = TwinPort(time.monotonic, noise_degC=0)
    settings = Settings(kind="thermal.plate", driver="serial", port=begin(port), timeout_s=0.2)
    plate = make("plate", settings, Path())
    plate.open()
    plate.warm(40, 20)
    until_s = time.monotonic() + 5
    while plate.measure() < 38 and time.monotonic() < until_s:
        time.sleep(0.02)
    assert plate.degC >= 38
    plate.close()
    assert port.plant.target_degC == 32.0
    plate.open()
    unplug()
    with pytest.raises(DeviceFault, match="gives no answer") as fault:
        plate.measure()
    assert fault.value.what == "silent"
    plate.close()


def test_an_installed_package_is_found_by_its_entry_points(tmp_path, monkeypatch, capsys):
    """What pip makes of pyproject.toml: a folder with the metadata, and its entry points."""
    site = tmp_path / "site"
    shutil.copytree(EXAMPLE / "thermal", site / "thermal")
    info = site / "palpate_thermal_plate-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: palpate-thermal-plate\nVersion: 1.0\n")
    groups = tomllib.loads((EXAMPLE / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    lines = [f"[{group}]\n{name} = {place}\n" for group, of in groups.items() for name, place in of.items()]
    (info / "entry_points.txt").write_text("".join(lines), encoding="utf-8")
    monkeypatch.syspath_prepend(str(site))
    for name in [name for name in sys.modules if name.partition(".")[0] == "thermal"]:
        monkeypatch.delitem(sys.modules, name)
    lab = make_lab(tmp_path / "lab", in_folder=False)
    assert _status(["run", STUDY, "--participant", "P001", "--simulate", "--lab", str(lab)]) == 0
    assert presented(lab)[0].header["extensions"]["thermal"]["package"] == "palpate-thermal-plate"
    assert _status(["replay", "--lab", str(lab)]) == 0
    shutil.copytree(EXAMPLE / "thermal", lab / "extensions" / "thermal")
    capsys.readouterr()
    assert _status(["check", STUDY, "--lab", str(lab)]) == 1
    assert "the extension 'thermal' is there twice" in "".join(capsys.readouterr())
