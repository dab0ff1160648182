"""The station of a rig's open devices: what presents, what records, and what each must know of the stimulus."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from palpate.devices.device import Device, DeviceError, Presents, Records, Sensor
from palpate.devices.door.link.codes import FOLLOWS_FROM
from palpate.devices.kinds import KINDS
from palpate.devices.rig.opened import OpenRig
from palpate.devices.samples import HandMounted
from palpate.devices.streams.capture import Capture
from palpate.protocols.events import Present, Sense
from palpate.protocols.needs import NEEDS, needs_with, recorded_beside
from palpate.protocols.plan import Plan
from palpate.studies.catalogue import StudyFiles
from palpate.studies.live.world import Station, compose_station
from palpate.studies.stimuli.profiles import Profiles
from palpate.studies.stimuli.scenes import pictures_of, scenes_for

if TYPE_CHECKING:
    from palpate.devices.door.link.simulator import DoorSimulator
    from palpate.devices.scene import Scene
    from palpate.devices.sound.device import MaskingNoise
    from palpate.devices.streams.beside import BesideRecorder
    from palpate.devices.vibrator.device import Vibrator
    from palpate.studies.live.renderer import RigRenderer, Shows

CAPTURED = tuple(need for need in needs_with("records") if need != "camera")
"""Needs that sensors record together; a camera records alone."""


def rig_station(rig: OpenRig, study_files: StudyFiles, plan: Plan, lab: Path, tablet: Shows | None = None) -> Station:
    """Return the station of a study at open devices.

    Pictures that a camera takes are saved in the lab; textures' pictures are shown on the `tablet`.
    """
    records: dict[str, Records] = {need: _capture(rig, need, study_files, plan) for need in _needed(plan, CAPTURED)}
    if "camera" in plan.study.needs:
        # its twin must know what it sees, and both where the pictures go
        camera: Any = rig.of("camera")["camera"]
        camera.pictures_of = pictures_of
        camera.keep_in(lab)
        records["camera"] = cast(Records, camera)
    renderer: RigRenderer | None = None
    if "texture_renderer" in plan.study.needs:
        from palpate.studies.live.renderer import rig_renderer

        renderer = rig_renderer(rig, plan, study_files.folder, lab, tablet)
    presents = renderer or _vibrator(rig, study_files, plan) or _door(rig, study_files, plan, lab)
    made = compose_station(plan.study, presents, records, lambda: _stage(rig, plan))
    recorder: BesideRecorder | None = None
    if needs := recorded_beside(plan.study.needs):
        from palpate.devices.streams.beside import BesideRecorder

        recorder = BesideRecorder(*_sensors(rig, needs))
    made = replace(made, beside=renderer, recorder=recorder)
    if renderer is not None:
        made = replace(made, switch_side=renderer.switch_side)
    if "masking_noise" not in plan.study.needs:
        return made
    from palpate.devices.sound.device import Masked

    noise = cast("MaskingNoise", rig.of("masking_noise")["masking_noise"])
    masked = Masked(made.presents, noise)
    return replace(made, presents=masked, on_aside=masked.handle_aside, feed=noise.feed)


def _needed(plan: Plan, among: Sequence[str]) -> list[str]:
    return [need for need in plan.study.needs if need in among]


def _door(rig: OpenRig, study_files: StudyFiles, plan: Plan, lab: Path) -> Presents | None:
    """Return the door, which plays profiles of the study's files, or those that the lab's models make from a wish."""
    for need in _needed(plan, ("door", "door_generator")):
        door: Any = rig.of(need)["door"]
        if need == "door_generator":
            from palpate.studies.stimuli.made_doors import MadeDoorPresenter, made_doors

            made = made_doors(lab)
            door.profile_for = made.force_N
            return MadeDoorPresenter(door, made, partial(setattr, door, "changes"))
        door.profile_for = profiles_of(study_files)
        return cast(Presents, door)
    return None


def _vibrator(rig: OpenRig, study_files: StudyFiles, plan: Plan) -> Presents | None:
    """Return the vibrator, which reads recorded vibrations in the study's folder; None if the study needs none."""
    if "vibration" not in plan.study.needs:
        return None
    vibrator = cast("Vibrator", rig.of("vibration")["vibrator"])
    vibrator.folder = study_files.folder
    return vibrator


def demand_within_limits(rig: OpenRig, study_files: StudyFiles, plan: Plan) -> None:
    """Raise DeviceError unless the devices can present every stimulus of the plan within their limits.

    The door must play every stimulus and every possible wish, the vibrator every stimulus at every level of its grid;
    the renderer's devices must be fit for textures, and the noise must be bearable.
    """
    if plan.study.noise is not None:
        noise = cast("MaskingNoise", rig.of("masking_noise")["masking_noise"])
        noise.demand_bearable(plan.study.noise.at_most_db_a)
    if "texture_renderer" in plan.study.needs:
        from palpate.studies.live.renderer import demand_usable

        demand_usable(rig)
    if "door_generator" in plan.study.needs:
        from palpate.signals.doors.limits import hardest

        door = cast("DoorSimulator", rig.of("door_generator")["door"])
        door.check(hardest(), "the hardest door that may be wished for")
    if "vibration" in plan.study.needs:
        vibrator = cast("Vibrator", rig.of("vibration")["vibrator"])
        vibrator.folder = study_files.folder
        for stimulus in plan.possible:
            vibrator.check(stimulus, plan.interval_s)
        if plan.study.onset_ms is not None:
            from palpate.devices.rig.certification import demand_certified

            demand_certified(vibrator, plan.study.onset_ms.model_dump(exclude_none=True))
    elif plan.study.onset_ms is not None:
        raise DeviceError(
            f"{plan.study.study} bounds onset_ms, and none of its devices can be certified: only a vibrator can (needs:"
            " [vibration])"
        )
    if "door" not in plan.study.needs:
        return
    door, files = cast("DoorSimulator", rig.of("door")["door"]), Profiles(study_files.folder)
    for stimulus in {trial.stimulus.id: trial.stimulus for trial in plan.presented}.values():
        door.check(files.of(stimulus), stimulus.id)


def demand_follows(rig: OpenRig, plan: Plan, recorded: Mapping[str, Any]) -> None:
    """Raise DeviceError unless a door that is to follow the sliders can change its profile while it is felt.

    A door that could not when the session was started may stay so: `recorded` is how its devices described themselves.
    """
    if plan.study.live is None:
        return
    door = cast("DoorSimulator", rig.of("door_generator")["door"])
    if recorded.get(door.name, {}).get("firmware", FOLLOWS_FROM) >= FOLLOWS_FROM:
        door.demand_follows()


def profiles_of(study_files: StudyFiles) -> Callable[[Present], Sequence[float]]:
    """Return a function that reads the 621 forces, in N, of a request from the study's files."""
    files = Profiles(study_files.folder)

    def from_file(request: Present) -> Sequence[float]:
        return files.of(request.trial.stimulus)

    return from_file


def _capture(rig: OpenRig, need: str, study_files: StudyFiles, plan: Plan) -> Capture:
    """Return the sensors of a need as one recorder; twins among them are given a simulated hand's motion."""
    sensors, names, may_hide = _sensors(rig, [need])
    scenes: Callable[[Sense], Scene | None] | None = None
    if any(rig.file.is_twin(name) for name in rig.file.names_for(need)):
        scenes = scenes_for(need, plan, Profiles(study_files.folder))
    return Capture(sensors, names, scenes or (lambda _request: None), may_hide=may_hide)


def _sensors(rig: OpenRig, needs: Sequence[str]) -> tuple[dict[str, Sensor], dict[tuple[str, str], str], list[str]]:
    """Return the sensors of needs by name, the names of their streams, and the streams that may have hidden samples."""
    sensors: dict[str, Sensor] = {}
    names: dict[tuple[str, str], str] = {}
    for need in needs:
        devices = rig.of(need)
        sensors |= {device.name: cast(Sensor, device) for device in devices.values()}
        names |= dict(_stream_names(need, devices))
    may_hide = [stream for (name, _), stream in names.items() if KINDS[rig.file.kind(name)].may_hide]
    return sensors, names, may_hide


def _stream_names(need: str, devices: Mapping[str, Device]) -> list[tuple[tuple[str, str], str]]:
    """Return the names of a need's streams by (device, signal).

    The first signal of each device is named by the need and its quantity; further ones by the need and their own name.
    """
    return [
        (
            (device.name, signal.name),
            f"{need.removesuffix('_sensors')}_{signal.name}" if place else NEEDS[need].takes[kind].stream,
        )
        for kind, device in devices.items()
        for place, signal in enumerate(device.signals)
    ]


def _stage(rig: OpenRig, plan: Plan) -> Presents:
    """Return the presenter of mounted samples: a person who confirms by hand or with a scanner."""
    if "samples" not in rig.file.needs:
        return HandMounted(blind=plan.study.blind)
    from palpate.devices.stage.scanner import known_codes

    stage: Any = rig.of("samples")["stage"]
    stage.hand.blind = plan.study.blind
    stage.known = known_codes([trial.stimulus for trial in plan.presented])
    return cast(Presents, stage)
