"""The simulated twins of a study's devices, each performing the requests that its device would."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from palpate.devices.door.twin import open_door
from palpate.protocols.events import Present, Reply, Request, Samples, Sense
from palpate.protocols.extensions import is_own
from palpate.protocols.keyed import normal
from palpate.protocols.needs import NEEDS, needs_with, presented_by_device
from palpate.protocols.plan import Plan
from palpate.protocols.simulated_world import Done
from palpate.protocols.study import Stimulus, Study
from palpate.protocols.tasks import TASKS
from palpate.protocols.trial import Trial
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.presenting import PresentingTwin
from palpate.studies.stimuli.profiles import Profiles, profile_of
from palpate.studies.stimuli.scenes import (
    SECONDS_A_PICTURE,
    WHOLE,
    Openings,
    Strokes,
    demand_surface,
    seed_of,
    sensing,
    surface_of,
)

if TYPE_CHECKING:
    from palpate.devices.scene import Scene
    from palpate.studies.simulation.virtual_textures import VirtualTextures
    from palpate.studies.stimuli.made_doors import MadeDoors

DOOR_RATE_HZ = 100.0


class DeviceTwin(Protocol):
    """A simulated device."""

    def check(self, trial: Trial) -> None:
        """Raise RigError, or the device's own error, if the trial's stimulus cannot be presented or recorded."""

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Perform a request that begins at t_ns."""


@dataclass(frozen=True)
class Twins:
    """The simulated devices of one study: what presents its stimuli, and what records them."""

    presents: DeviceTwin
    records: Mapping[str, DeviceTwin]

    def feels(self, stimulus: Stimulus) -> Mapping[str, float]:
        """Return the columns of a stimulus that simulated people feel from its rendering instead of from its table."""
        return self.presents.feels(stimulus) if isinstance(self.presents, RendererTwin | PresentingTwin) else {}

    def check(self, plan: Plan) -> None:
        """Raise RigError, or a device's own error, if a stimulus of the plan cannot be presented or recorded."""
        for trial in plan.felt_in_trials:
            for device in (self.presents, *self.records.values()):
                device.check(trial)
        if not TASKS[plan.study.task].makes:  # a wish was checked with the study
            for anchor in plan.presented[len(plan.felt_in_trials) :]:
                self.presents.check(anchor)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Hand the request to its device. Raises RigError where the study has none."""
        if isinstance(request, Present):
            return self.presents(request, t_ns)
        if isinstance(request, Sense) and request.device in self.records:
            return self.records[request.device](request, t_ns)
        raise RigError(f"no device of this study can do {request.body()['do']!r}")


def twin_for(
    study: Study, plan: Plan, folder: Path, profiles: Profiles | None = None, lab: Path | None = None,
    renderings: VirtualTextures | None = None, pictures: int | None = None,
) -> Twins:  # fmt: skip
    """Return the twins of the devices that the study needs; `folder` has its files.

    `profiles` and `renderings` are those already read or rendered. A camera saves so many `pictures` of each stimulus
    in the lab, none if it is None. Doors and textures are made by the models of the `lab`, if it has any, else by the
    shipped ones. Samples need no twin: somebody hands them over, whatever else presents something with them.
    """
    profiles = profiles if profiles is not None else Profiles(folder)
    makers: dict[str, Callable[[], DeviceTwin]] = {
        "door": lambda: DoorTwin(plan, profiles),
        "door_generator": lambda: _generator(plan, lab),
        "door_sensors": lambda: DoorSensorsTwin(plan, Openings(plan, profiles)),
        "tool": lambda: ToolTwin(plan, Strokes(plan, WHOLE)),
        "camera": lambda: _camera(lab, pictures),
        "texture_renderer": lambda: RendererTwin(plan, renderings or renderings_of(folder, lab)),
    }
    makers |= {need: partial(PresentingTwin, plan, folder, need) for need in presented_by_device(study.needs)}
    makers |= {need: partial(SensorsTwin, plan, need) for need in filter(is_own, needs_with("records"))}
    twins = {need: makers[need]() for need in study.needs if need in makers}
    presents = next((twin for need, twin in twins.items() if NEEDS[need].role == "presents"), HandedOver(plan))
    return Twins(presents, {need: twin for need, twin in twins.items() if NEEDS[need].role == "records"})


def renderings_of(folder: Path, lab: Path | None) -> VirtualTextures:
    """Return the virtual textures of a study in `folder`, by a lab's models or the shipped ones."""
    from palpate.studies.simulation.virtual_textures import VirtualTextures

    return VirtualTextures(folder, lab)


def _camera(lab: Path | None, pictures: int | None) -> DeviceTwin:
    if lab is None or pictures is None:
        return CameraTwin()
    from palpate.studies.simulation.photographs import KeptCameraTwin

    return KeptCameraTwin(lab, pictures)


def _generator(plan: Plan, lab: Path | None) -> GeneratorTwin:
    from palpate.studies.stimuli.made_doors import made_doors

    return GeneratorTwin(plan, made_doors(lab))


@dataclass(frozen=True)
class DoorTwin:
    """The simulated door: a simulated hand opens it once along the stimulus' profile."""

    plan: Plan
    profiles: Profiles

    def check(self, trial: Trial) -> None:
        """Raise RigError unless the stimulus has a profile."""
        self.profiles.of(trial.stimulus)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Present a stimulus; the reply carries the angle and the force that the hand met."""
        if not isinstance(request, Present):
            raise RigError(f"the simulated door cannot do {request.body()['do']!r}")
        return opened(self.plan, request, self.profiles.of(request.trial.stimulus), t_ns)


@dataclass(frozen=True)
class GeneratorTwin:
    """The simulated door with the models that turn wishes into a profile (thesis 5.7.2)."""

    plan: Plan
    made: MadeDoors

    def check(self, trial: Trial) -> None:
        """Raise RigError unless doors can be made from the trial's attributes and their scale."""
        self.made.check(trial)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Make the door of the wish, and let the hand open it. Raises RigError where there is no wish."""
        if not isinstance(request, Present):
            raise RigError(f"the simulated door generator cannot do {request.body()['do']!r}")
        force_N = self.made.force_N(request)
        done = opened(self.plan, request, force_N, t_ns)
        done = replace(done, reply=self.made.on_record(force_N, done.reply))
        if request.live_form is None:
            return done
        from palpate.studies.simulation.live_doors import followed

        return followed(self.plan, request, self.made.doors, done, t_ns)


@dataclass(frozen=True)
class RendererTwin:
    """The simulated renderer: its models play for a simulated hand, by the same loop as at a rig (thesis 4.5)."""

    plan: Plan
    renderings: VirtualTextures

    def feels(self, stimulus: Stimulus) -> Mapping[str, float]:
        """Return the columns of a stimulus that simulated people feel from its rendering."""
        return self.renderings.feels(stimulus)

    def check(self, trial: Trial) -> None:
        """Raise RigError unless the stimulus has a model."""
        self.renderings.check(trial.stimulus)

    def __call__(self, request: Request, t_ns: int) -> Done:  # noqa: ARG002
        """Render the stimulus; the reply has model, runtime, deadlines, and the difference from the real texture."""
        if not isinstance(request, Present):
            raise RigError(f"the simulated texture renderer cannot do {request.body()['do']!r}")
        made = self.renderings.of(request.trial.stimulus).record()
        return Done(Reply({"presented": True, "rendered": made}), seconds_to_present(self.plan))


@dataclass(frozen=True)
class HandedOver:
    """The presenter of a study without a device: somebody hands over its stimuli."""

    plan: Plan

    def check(self, trial: Trial) -> None:
        """Accept every stimulus."""

    def __call__(self, request: Request, t_ns: int) -> Done:  # noqa: ARG002
        """Present the stimulus."""
        if not isinstance(request, Present):
            raise RigError(f"no device of this study can do {request.body()['do']!r}")
        return Done(Reply({"presented": True}), seconds_to_present(self.plan))


@dataclass(frozen=True)
class ToolTwin:
    """The simulated tool: a simulated hand strokes over the texture while its sensors are recorded."""

    plan: Plan
    scenes: Strokes

    def check(self, trial: Trial) -> None:
        """Raise RigError unless the stimulus can be simulated as a surface."""
        demand_surface(trial)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Record acceleration, force and position."""
        sense = sensing(request, "tool")
        return recorded(self.plan, "tool", self.scenes(sense), sense, t_ns)


@dataclass(frozen=True)
class DoorSensorsTwin:
    """The simulated sensors at a real door: a simulated hand opens it once while force and position are recorded.

    The simulated door has the profile in the stimulus' column `file`; a lab's own cars need none, and are then
    simulated as a mid-size door.
    """

    plan: Plan
    scenes: Openings

    def check(self, trial: Trial) -> None:
        """Raise RigError if the profile, where there is one, cannot be read or not be opened in the available time."""
        from palpate.devices.door.opening import demand_recordable

        profile_N = profile_of(trial.stimulus, self.scenes.profiles)
        if trial.recording is not None:
            demand_recordable(profile_N, trial.recording.seconds)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Record the force at the handle, and the position of the marker beside it."""
        sense = sensing(request, "door_sensors")
        return recorded(self.plan, "door_sensors", self.scenes(sense), sense, t_ns)


@dataclass(frozen=True)
class SensorsTwin:
    """The simulated sensors of a lab's own need, which know of no hand: they record at rest."""

    plan: Plan
    need: str

    def check(self, trial: Trial) -> None:
        """Accept every stimulus."""

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Record each sensor of the need."""
        return recorded(self.plan, self.need, None, sensing(request, self.need), t_ns)


@dataclass(frozen=True)
class CameraTwin:
    """The simulated camera. It saves no picture: they can be computed from surface and light at any time."""

    def check(self, trial: Trial) -> None:
        """Raise RigError unless the stimulus can be simulated as a surface."""
        demand_surface(trial)

    def __call__(self, request: Request, t_ns: int) -> Done:  # noqa: ARG002
        """Return the list of the pictures taken."""
        from palpate.devices.surfaces.photo import LIGHTS

        sense = sensing(request, "camera")
        surface = surface_of(sense.trial.stimulus).id
        pictures = [{"light": number, "surface": surface} for number in range(1, LIGHTS + 1)]
        seconds = min(sense.seconds, SECONDS_A_PICTURE * LIGHTS)
        return Done(Reply({"recorded": True, "seconds": seconds, "by": "twin", "pictures": pictures}), seconds)


def opened(plan: Plan, request: Present, profile_N: tuple[float, ...], t_ns: int) -> Done:
    """Return the presentation in which a simulated hand opens the door of this profile once."""
    moment = (request.trial.number, request.trial.attempt, *plan.occasion)
    chance = normal("opening", plan.seed, plan.who.participant, *moment)
    seconds = round(seconds_to_present(plan) * max(0.5, 1.0 + 0.15 * chance), 3)
    opening = open_door(profile_N, seconds, DOOR_RATE_HZ)
    block = Samples("door", ("angle", "force"), ("deg", "N"), DOOR_RATE_HZ, t_ns, opening.interleaved())
    return Done(Reply({"presented": True, "seconds": seconds}, (block,)), seconds)


def recorded(plan: Plan, need: str, scene: Scene | None, sense: Sense, t_ns: int) -> Done:
    """Return the streams that the sensors of a need record of a scene, or at rest, and the time it took."""
    from palpate.studies.simulation.virtual_recording import recorded_at_once

    blocks = recorded_at_once(need, scene, sense.seconds, t_ns, seed_of(plan, sense.trial))
    return Done(Reply({"recorded": True, "seconds": sense.seconds}, blocks), sense.seconds)


def seconds_to_present(plan: Plan) -> float:
    """Return how many seconds a simulated presentation takes on average."""
    return plan.study.simulation.present_s if plan.study.simulation is not None else 2.5
