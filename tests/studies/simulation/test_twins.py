"""Which simulated device performs what, and what is refused by name."""

import hashlib
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.devices.door.making import Doors, maker_for
from palpate.protocols.canonical import canonical, parse
from palpate.protocols.events import Aside, Present, Reply, Rest, Sense
from palpate.signals.doors.grid import DoorDataError
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.rig import simulated
from palpate.studies.simulation.twins import twin_for
from palpate.studies.stimuli.made_doors import MadeDoorPresenter, made_doors
from palpate.studies.stimuli.profiles import Profiles
from tests.protocols.every_task import plan_of
from tests.studies.shipped import plan_for, read_shipped

pytestmark = pytest.mark.usefixtures("shared_grounds")

DOORS = [[attribute.low, attribute.high] for attribute in read_shipped("door_authoring").study.attributes]


def twins_of(name):
    plan = plan_for(name)
    return plan, twin_for(plan.study, plan, read_shipped(name).folder)


def first(plan):
    return plan.trials[0]


def test_a_door_is_opened_along_its_profile():
    plan, twins = twins_of("door_matching")
    done = twins(Present(first(plan)), 7)
    (block,) = done.reply.samples
    rows = np.frombuffer(block.data, "<f4").reshape(-1, 2)
    assert (block.stream, block.channels, block.t0_ns) == ("door", ("angle", "force"), 7)
    assert rows[-1, 0] == pytest.approx(62, abs=0.1) and done.reply.value["presented"] is True
    profile = Profiles(read_shipped("door_matching").folder).of(first(plan).stimulus)
    felt = np.interp(rows[:, 0], np.arange(621) / 10, profile)
    assert rows[:, 1] == pytest.approx(felt, abs=1e-3)


def test_a_wished_door_is_designed_and_opened():
    plan, twins = twins_of("door_authoring")
    wish = {attribute.name: 50.0 for attribute in plan.study.attributes}
    neutral, heavy = (twins(Present(first(plan), {**wish, "Easy-to-pull": pull}), 0) for pull in (50.0, 95.0))
    force_N = [np.frombuffer(done.reply.samples[0].data, "<f4")[1::2].mean() for done in (neutral, heavy)]
    assert force_N[1] > force_N[0] + 1
    with pytest.raises(RigError, match="needs a wish"):
        twins(Present(first(plan)), 0)
    with pytest.raises(DoorDataError, match="Loud"):
        twins(Present(first(plan), {"Loud": 1.0}), 0)


@pytest.mark.parametrize("name", ["texture_ratings", "door_lexicon"])
def test_samples_are_handed_over(name):
    plan, twins = twins_of(name)
    done = twins(Present(first(plan)), 0)
    assert done.reply.value == {"presented": True} and done.seconds == plan.study.simulation.present_s


@pytest.mark.parametrize(
    ("name", "device", "streams"),
    [
        ("texture_capture", "tool", ["tool_acceleration", "tool_force", "tool_position"]),
        ("door_capture", "door_sensors", ["door_force", "door_position"]),
    ],
)
def test_a_recording_has_its_streams_and_depends_on_trial_and_person(name, device, streams):
    plan, twins = twins_of(name)
    one, two = (twins(Sense(device, 2.0, trial), 5).reply for trial in plan.trials[:2])
    assert [block.stream for block in one.samples] == streams and one.value == {"recorded": True, "seconds": 2.0}
    assert {block.t0_ns for block in one.samples} == {5}
    assert all(a.data != b.data for a, b in zip(one.samples, two.samples, strict=True))
    other = plan_for(name, "P003")
    assert (
        twin_for(other.study, other, read_shipped(name).folder)(Sense(device, 2.0, first(other)), 5)
        .reply.samples[0]
        .data
        != one.samples[0].data
    )


def test_what_a_study_has_no_device_for_is_refused():
    plan, twins = twins_of("door_lexicon")
    for request in (Sense("tool", 2.0, first(plan)), Rest(1, 2)):
        with pytest.raises(RigError, match="no device of this study can do"):
            twins(request, 0)
    plan, twins = twins_of("texture_capture")
    with pytest.raises(RigError, match="no device of this study can do 'sense'"):
        twins(Sense("door_sensors", 2.0, first(plan)), 0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "makes doors from Easy-to-pull, .*; found Soft, Cold"),
        ({"attributes": DOORS, "scale": {"from": -10, "to": 10}}, "a scale from 0 to 100; found -10 to 10"),
        ({"attributes": DOORS, "scale": {"from": 0, "to": 10}}, "a scale from 0 to 100; found 0 to 10"),
    ],
)
def test_wishes_that_give_no_door_are_refused_before_anything_is_recorded(tmp_path, changes, message):
    plan = plan_of("authoring", needs=["door_generator"], **changes)
    with pytest.raises(RigError, match=message):
        simulated(plan.study, tmp_path).check(plan)


def test_too_short_a_recording_of_a_door_is_refused_before_anything_is_recorded(tmp_path):
    capture = {"device": "door_sensors", "seconds": 1.0}
    plan = plan_of("capture", needs=["door_sensors"], capture=capture, practice=None)
    with pytest.raises(DoorDataError, match="from 2 to 600 s"):
        simulated(plan.study, tmp_path).check(plan)


def test_a_table_with_a_wrong_estimate_is_refused_before_anything_is_recorded(tmp_path):
    stimuli = [{"id": "mine", "columns": {"sim_roughness": "rather"}}]
    plan = plan_of("capture", needs=["tool"], stimuli=stimuli, practice=None, simulation={"latents": {}})
    with pytest.raises(RigError, match="stimulus 'mine': 'rather' in the column 'sim_roughness'"):
        simulated(plan.study, tmp_path).check(plan)


def test_a_lab_s_own_samples_and_cars_need_nothing_to_be_simulated(tmp_path):
    for device in ("tool", "door_sensors"):
        capture = {"device": device, "seconds": 2.0}
        plan = plan_of("capture", needs=[device], capture=capture, practice=None)
        rig = simulated(plan.study, tmp_path)
        rig.check(plan)
        assert rig.open(plan, 0).world.perform(Sense(device, 2.0, first(plan))).samples


def test_another_profile_than_planned_is_refused(tmp_path):
    plan = plan_for("door_capture")
    folder = shutil.copytree(read_shipped("door_capture").folder, tmp_path / "copy")
    file = folder / first(plan).stimulus.columns["file"]
    file.write_bytes(file.read_bytes() + b"\n")
    assert hashlib.sha256(file.read_bytes()).hexdigest() != first(plan).stimulus.sha256
    with pytest.raises(RigError, match="its SHA-256 differs"):
        simulated(plan.study, folder).check(plan)
    file.unlink()
    with pytest.raises(RigError, match="no door profile"):
        simulated(plan.study, folder).check(plan)


def test_the_record_of_a_made_door_names_its_models_and_holds_its_forces():
    plan, twins = twins_of("door_authoring")
    wish = {attribute.name: 40.0 for attribute in plan.study.attributes}
    reply = twins(Present(first(plan), wish), 0).reply
    design = reply.value["made"]
    maker = maker_for(None)
    assert design["models"] == maker.identity and design["models"]
    assert tuple(design["force_N"]) == Doors(maker).force_N(wish) and len(design["force_N"]) == 621
    felt = np.frombuffer(reply.samples[0].data, "<f4").reshape(-1, 2)
    assert felt[:, 1] == pytest.approx(np.interp(felt[:, 0], np.arange(621) / 10, design["force_N"]), abs=1e-3)
    assert parse(canonical(reply.value)) == reply.value


def test_a_rig_s_door_plays_the_designed_profile_and_its_reply_says_so():
    plan = plan_for("door_authoring")
    doors = made_doors(None)
    wish = {attribute.name: 60.0 for attribute in plan.study.attributes}
    outcomes = [Aside({"do": "pause"}), Reply({"presented": True, "by": "door"})]
    door = SimpleNamespace(perform=lambda *_: outcomes.pop(0))
    request = Present(first(plan), wish)
    presents = MadeDoorPresenter(door, doors)
    assert isinstance(presents.perform(request, None, None, None), Aside)
    reply = presents.perform(request, None, None, None)
    assert reply.value["by"] == "door" and tuple(reply.value["made"]["force_N"]) == doors.force_N(request)
