"""Virtual textures at a rig: presented until they are answered for, named and counted in the record."""

from dataclasses import dataclass, field, replace

import pytest

from palpate.devices.device import DeviceError
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.opened import open_rig
from palpate.protocols.events import Aside, Ask, Fault, Present, Reply
from palpate.protocols.plan import compile_plan
from palpate.signals.textures.sounds import RenderError
from palpate.studies.catalogue import StudyFiles
from palpate.studies.live.hardware import Hardware
from palpate.studies.live.renderer import RigRenderer, demand_usable
from palpate.studies.live.station import rig_station
from palpate.studies.live.world import Mounted, Station
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.virtual_textures import VirtualTextures
from tests.devices.window.shells_for_tests import FakeDesk
from tests.protocols.every_task import LAB
from tests.studies.live.rig_rooms import TEXTURE_TWINS
from tests.studies.shipped import plan_for
from tests.studies.simulation.small_textures import write
from tests.studies.simulation.test_virtual_textures import FOLDER, of_two

PLAN = compile_plan(of_two(), plan_for("texture_similarity").who, 1, LAB)
TRIAL = PLAN.trials[0]


VOICE = {"runtime": "native", "steps": 90, "sounding": 80, "held": 1, "restarts": 7, "quiet": 20, "muted": 40}


@dataclass
class FakePlays:
    """Counts a step at every look; fails at the methods in `fails`."""

    running: bool = True
    fails: str = ""
    dead: str = ""
    steps: int = 0
    sounds: list = field(default_factory=list)
    ended: int = 0

    def switch(self, sounds):
        if self.fails:
            raise RenderError(self.fails)
        self.sounds.append(sounds)

    def record(self):
        if self.dead:
            raise RenderError(self.dead)
        self.steps += 100
        ready = {"steps": self.steps, "late": self.steps // 100, "skipped": 0}
        output = {"underruns": 0, "missing": 0, "limited": 0, "ahead_ms": 10}
        return {"ready": ready, "output": output, "voice": VOICE, "priority": "normal"}

    def __exit__(self, *_raised):
        self.ended += 1
        self.running = False


@dataclass
class Window:
    pages: list = field(default_factory=list)

    def wait_for(self, key, desk, ready):
        self.pages.append(key)
        return None if ready() else Aside({"do": "note", "text": "waits"})


@pytest.fixture
def lab(tmp_path):
    for method in ("ar", "foten_generative"):
        write(tmp_path / "models", "cloth", method)
    return tmp_path


def present(renderer, trial=TRIAL, desk=None):
    times = iter(range(0, 10**12, 10**9))
    return renderer.perform(Present(trial), Window(), desk or FakeDesk(), lambda: next(times))


def fake(lab, **more):
    players = [FakePlays(**more)]

    def begin():
        players.append(FakePlays())
        return players[-1]

    return RigRenderer(PLAN, VirtualTextures(FOLDER, lab), begin, players[0]), players


def test_replies_name_the_model_and_count_the_deadlines_of_the_texture_alone(lab):
    renderer, (plays,) = fake(lab)
    rendered = present(renderer).value["rendered"]
    model = TRIAL.stimulus.columns["model"]
    assert (rendered["model"], rendered["method"], rendered["runtime"]) == (f"texture-cloth-{model}", model, "native")
    assert len(rendered["sha256"]) == len(rendered["weights_sha256"]) == 64
    answered = renderer.after(Reply({"answers": {"a": 1}})).value
    assert answered["answers"] == {"a": 1} and answered["rendered"]["model"] == rendered["model"]
    counted = answered["rendered"]["deadlines"]
    assert (counted["steps"], counted["late"], counted["underruns"], counted["ahead_ms"]) == (100, 1, 0, 10)
    assert rendered["seed"] == plays.sounds[0].seed == answered["rendered"]["seed"]
    assert answered["rendered"]["met"] == {"sounding": 80, "held": 1, "restarts": 7, "quiet": 20, "muted": 40}
    assert plays.sounds[0].card.stem == rendered["model"] and plays.sounds[-1] is None, "silent once it is answered for"
    assert renderer.after(Reply({})) == Reply({}), "forms without a texture are left alone"


def test_another_person_and_another_attempt_hear_other_noise(lab):
    renderer, (plays,) = fake(lab)
    present(renderer)
    other = compile_plan(PLAN.study, plan_for("texture_similarity", "P002").who, 1, LAB)
    RigRenderer(other, VirtualTextures(FOLDER, lab), lambda: plays, plays).perform(
        Present(TRIAL), Window(), FakeDesk(), lambda: 0
    )
    assert plays.sounds[0].seed != plays.sounds[1].seed


@dataclass
class FakeTablet:
    """Records what it shows; fails once that is set."""

    seen: list = field(default_factory=list)
    fails: str = ""

    def show(self, picture):
        if self.fails:
            raise RenderError(self.fails)
        self.seen.append(None if picture is None else picture.stem)


def test_the_tablet_shows_the_picture_while_the_virtual_side_is_on(lab):
    renderer, _ = fake(lab)
    renderer.tablet = tablet = FakeTablet()
    rendered = present(renderer).value["rendered"]
    assert rendered["picture"]["file"] == "cloth.jpg" and len(rendered["picture"]["sha256"]) == 64
    assert rendered["picture"]["size_mm"] == pytest.approx([100.0, 100.0], abs=0.2)
    assert tablet.seen == [None], "no side was chosen yet"
    station = Station(renderer, beside=renderer, switch_side=renderer.switch_side)
    for side in ("virtual", "real", "virtual"):
        station.switch_side(side)
    assert tablet.seen[1:] == ["cloth", None, "cloth"]
    answered = station.after(Reply({"answers": {}})).value["rendered"]
    assert tablet.seen[-1] is None and answered["picture"] == rendered["picture"]
    present(renderer)
    assert tablet.seen[-1] is None, "the next trial begins with no side"


def test_without_sides_the_picture_is_there_as_long_as_the_texture(lab):
    renderer, _ = fake(lab)
    renderer.plan = replace(PLAN, study=PLAN.study.model_copy(update={"sides": ()}))
    renderer.tablet = tablet = FakeTablet()
    present(renderer)
    renderer.after(Reply({"answers": {}}))
    assert tablet.seen == ["cloth", None]


def test_a_tablet_that_goes_dark_marks_the_trial(lab):
    renderer, _ = fake(lab)
    renderer.tablet = tablet = FakeTablet()
    present(renderer)
    tablet.fails = "the window on the tablet's screen has ended"
    renderer.switch_side("virtual")
    outcome = renderer.after(Reply({"answers": {}}))
    assert isinstance(outcome, Fault) and "tablet's screen has ended" in outcome.value["message"]


def test_a_tablet_s_screen_is_its_own_and_every_texture_has_a_picture(lab):
    screened = TEXTURE_TWINS.replace("tablet, driver: twin", "tablet, driver: twin, screen: {number: 1, px_per_mm: 5}")
    hardware = Hardware(StudyFiles(PLAN.study, FOLDER), lab, file=rig_file(lab, screened))
    hardware.demand_other_screen(0)
    with pytest.raises(RigError, match="screen 1 is the participant's"):
        hardware.demand_other_screen(1)
    write(lab / "models", "cloth", "ar", picture="weave.png")
    with pytest.raises(DeviceError, match="weave.png"):
        hardware.open(PLAN)
    assert hardware.opened is None and hardware.tablet is None


def test_what_fails_is_a_fault_and_goes_on_once_somebody_has_mended_it(lab):
    renderer, players = fake(lab, fails="the actuator is gone")
    outcome = present(renderer)
    assert isinstance(outcome, Fault) and outcome.value["message"] == "the actuator is gone" and players[0].ended == 1
    desk = FakeDesk()
    desk.answers.append(True)
    assert isinstance(present(renderer, desk=desk), Reply) and len(players) == 2
    assert "the actuator is gone. Put it right" in desk.demands[0].text
    players[1].running = False
    assert isinstance(renderer.after(Reply({"answers": {}})), Fault), "what was not felt to its end is repeated"


def test_a_fault_while_the_texture_is_felt_says_what_failed(lab):
    renderer, (plays,) = fake(lab)
    present(renderer)
    plays.running, plays.dead = False, "stylus: unplugged"
    assert renderer.after(Reply({"answers": {}})).value["message"] == "stylus: unplugged"


def test_what_the_experimenter_wants_is_done_though_the_renderer_has_ended(lab):
    renderer, (plays,) = fake(lab)
    present(renderer)
    plays.running = False
    abort = Aside({"do": "abort"})
    assert renderer.after(abort) is abort and plays.ended == 1


def test_a_session_resumed_within_a_trial_plays_the_texture_before_the_rating(lab):
    """The presentation is on record, and was another process'."""
    renderer, (plays,) = fake(lab)
    ask = Ask(TRIAL.form, TRIAL)
    assert renderer.before(ask) is None and plays.sounds[0].card.stem.startswith("texture-cloth")
    assert renderer.before(ask) is None and len(plays.sounds) == 1, "it goes on"
    assert renderer.after(Reply({"answers": {}})).value["rendered"]["seed"] == plays.sounds[0].seed
    assert renderer.before(Ask(TRIAL.form, replace(TRIAL, previous={"a": 1}))) is None and len(plays.sounds) == 2
    assert renderer.before(Ask(PLAN.opening[0])) is None and len(plays.sounds) == 2
    renderer, _ = fake(lab, fails="the actuator is gone")
    assert isinstance(renderer.before(ask), Fault)


def test_a_renderer_is_part_of_the_station_and_ends_with_it(lab):
    renderer, (plays,) = fake(lab)
    Station(renderer, beside=renderer).stop()
    assert plays.ended == 1


def rig_file(lab, text=TEXTURE_TWINS):
    path = lab / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    return read_rig(path)


def test_the_twins_of_stylus_and_actuator_render_in_a_process_of_their_own(lab):
    rig = open_rig(rig_file(lab), ["stylus", "actuator", "noise"])
    try:
        station = rig_station(rig, StudyFiles(PLAN.study, FOLDER), PLAN, lab)
        assert isinstance(station.presents.presents, Mounted) and isinstance(station.beside, RigRenderer)
        try:
            assert isinstance(present(station.beside), Reply)
            counted = station.after(Reply({})).value["rendered"]["deadlines"]
            assert counted["ahead_ms"] == 10 and counted["steps"] >= 0 and counted["priority"]
        finally:
            station.stop()
    finally:
        rig.close()


def test_what_cannot_render_is_refused_while_the_session_is_planned(lab):
    real = TEXTURE_TWINS.replace("voice_coil, driver: twin", "voice_coil, driver: sound")
    file = rig_file(lab, TEXTURE_TWINS.replace("tablet, driver: twin", "tablet, driver: pyglet, px_per_mm: 5"))
    with pytest.raises(DeviceError, match="evdev"):
        demand_usable(closed(file))
    with pytest.raises(DeviceError, match="palpate rig calibrate actuator"):
        demand_usable(closed(rig_file(lab, real)))


def closed(file):
    """The rig's devices, none of them open."""
    from palpate.devices.kinds import KINDS
    from palpate.devices.rig.opened import OpenRig

    names = ("stylus", "actuator")
    devices = {name: KINDS[file.kind(name)].make(name, file.devices[name], file.path.parent) for name in names}
    return OpenRig(file, devices, lambda: None)


def test_a_model_that_is_not_whole_is_refused_before_a_device_is_opened(lab):
    (lab / "models" / "texture-cloth-ar.safetensors").unlink()
    hardware = Hardware(StudyFiles(PLAN.study, FOLDER), lab, file=rig_file(lab))
    with pytest.raises(RigError, match=r"texture-cloth-ar"):
        hardware.open(PLAN)
    assert hardware.opened is None
