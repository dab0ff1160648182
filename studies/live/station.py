"""The station of a rig's open devices: what presents, what records, and what each must know of the stimulus."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from palpate.devices.device import Device, DeviceError, Presents, PresentsStimuli, Records, Sensor
from palpate.devices.door.link.codes import FOLLOWS_FROM
from palpate.devices.kinds import KINDS
from palpate.devices.rig.opened import OpenRig
from palpate.devices.samples import HandMounted
from palpate.devices.streams.capture import Capture
from palpate.protocols.events import Present, Sense
from palpate.protocols.extensions import is_own
from palpate.protocols.needs import NEEDS, presented_by_device, recorded_beside
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


def rig_station(rig: OpenRig, study_files: StudyFiles, plan: Plan, lab: Path, tablet: Shows | None = None) -> Station:
    """Return the station of a study at open devices.

    Pictures that a camera takes are saved in the lab; textures' pictures are shown on the `tablet`.
    """
    # What sensors record together; a camera records alone.
    captured = [need for need in plan.study.needs if NEEDS[need].role == "records" and need != "camera"]
    records: dict[str, Records] = {need: _capture(rig, need, study_files, plan) for need in captured}
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
    presents = renderer or _door(rig, study_files, plan, lab) or next(_presenting(rig, study_files, plan), None)
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


def _door(rig: OpenRig, study_files: StudyFiles, plan: Plan, lab: Path) -> Presents | None:
    """Return the door, which plays profiles of the study's files, or those that the lab's models make from a wish."""
    for need in {"door", "door_generator"}.intersection(plan.study.needs):
        door: Any = rig.of(need)["door"]
        if need == "door_generator":
            from palpate.studies.stimuli.made_doors import MadeDoorPresenter, made_doors

            made = made_doors(lab)
            door.profile_for = made.force_N
            return MadeDoorPresenter(door, made, partial(setattr, door, "changes"))
        door.profile_for = profiles_of(study_files)
        return cast(Presents, door)
    return None


def _presenting(rig: OpenRig, study_files: StudyFiles, plan: Plan) -> Iterator[PresentsStimuli]:
    """Yield the devices that present the study's stimuli by themselves; one may read files in the study's folder."""
    for need in presented_by_device(plan.study.needs):
        for device in rig.of(need).values():
            if not callable(getattr(device, "perform", None)):
                raise DeviceError(f"{device.name}: the study's need {need} presents stimuli, and it cannot")
            if hasattr(device, "folder"):
                device.folder = study_files.folder
            yield cast(PresentsStimuli, device)


def demand_within_limits(rig: OpenRig, study_files: StudyFiles, plan: Plan) -> None:
    """Raise DeviceError unless the devices can present every stimulus of the plan within their limits.

    The door must play every stimulus and every possible wish, a device that presents by itself every stimulus at every
    level of its grid; the renderer's devices must be fit for textures, and the noise must be bearable.
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
    for device in _presenting(rig, study_files, plan):
        for stimulus in plan.possible:
            device.check(stimulus, plan.interval_s)
    if plan.study.onset_ms is not None and "vibration" in plan.study.needs:
        from palpate.devices.rig.certification import demand_certified

        vibrator = cast("Vibrator", rig.of("vibration")["vibrator"])
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
    """Return the sensors of a need as one recorder; twins of shipped kinds are given a simulated hand's motion."""
    sensors, names, may_hide = _sensors(rig, [need])
    scenes: Callable[[Sense], Scene | None] | None = None
    if not is_own(need) and any(rig.file.is_twin(name) for name in rig.file.names_for(need)):
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
