"""The scenes of a stimulus for twins of sensors and camera: the hand at it, or its pictures."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING, Any

from palpate.protocols.events import Request, Sense
from palpate.protocols.keyed import Key, keyed_bits
from palpate.protocols.plan import Plan
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial
from palpate.studies.sessions.rig import RigError
from palpate.studies.stimuli.profiles import Profiles, profile_of

if TYPE_CHECKING:
    from PIL.Image import Image

    from palpate.devices.scene import Scene
    from palpate.devices.surfaces.table import Surface

GROUNDS = 2
"""Number of cached surface reliefs, 10 MB each: people repeat a trial, and go from one to the next."""
SECONDS_A_PICTURE = 12.0
"""Seconds that the simulated camera takes for one light."""
WHOLE = 16
"""Number of cached batches (6.4 s each) where sensors are recorded one after another: a minute is computed once."""


def drawn(plan: Plan, trial: Trial) -> tuple[Key, ...]:
    """Return the keys that seed a simulated recording; the study's name separates two studies of one seed."""
    return (plan.study.study, plan.seed, plan.who.participant, trial.number, trial.attempt, *plan.occasion)


def seed_of(plan: Plan, trial: Trial) -> int:
    """Return the seed of the sensors' noise in a simulated recording."""
    return keyed_bits("sensors", *drawn(plan, trial)) % 2**31


def surface_of(stimulus: Stimulus) -> Surface:
    """Return the simulated surface of a stimulus. Raises SurfaceDataError on invalid values in its table."""
    from palpate.devices.surfaces.choice import surface_for

    return surface_for(stimulus.id, stimulus.columns)


def demand_surface(trial: Trial) -> None:
    """Raise RigError unless the trial's stimulus can be simulated as a surface."""
    from palpate.devices.surfaces.table import SurfaceDataError

    try:
        surface_of(trial.stimulus)
    except SurfaceDataError as error:
        raise RigError(str(error)) from None


def sensing(request: Request, device: str) -> Sense:
    """Return the request if it asks this device to record, else raise RigError."""
    if not isinstance(request, Sense) or request.device != device:
        raise RigError(f"the simulated {device} cannot do {request.body()['do']!r}")
    return request


@dataclass
class Strokes:
    """A maker of scenes of a hand on the trial's texture; `kept` is how many batches are cached, None the default."""

    plan: Plan
    kept: int | None = None
    grounds: OrderedDict[str, Any] = field(default_factory=OrderedDict)

    def __call__(self, request: Sense) -> Scene:
        """Return the scene of a recording request."""
        from palpate.devices.surfaces.act import KEPT
        from palpate.devices.surfaces.scene import SurfaceScene, ground_of

        surface = surface_of(request.trial.stimulus)
        if surface.id not in self.grounds:
            self.grounds[surface.id] = ground_of(surface)
            while len(self.grounds) > GROUNDS:
                self.grounds.popitem(last=False)
        key, ground = drawn(self.plan, request.trial), self.grounds[surface.id]
        return SurfaceScene(surface, request.seconds, *key, under=ground, kept=self.kept or KEPT)


@dataclass
class Openings:
    """A maker of scenes of a hand that opens the trial's door."""

    plan: Plan
    profiles: Profiles

    def __call__(self, request: Sense) -> Scene:
        """Return the scene of a recording request."""
        from palpate.devices.door.opening_scene import OpeningScene

        profile_N: Sequence[float] = profile_of(request.trial.stimulus, self.profiles)
        return OpeningScene(profile_N, request.seconds, *drawn(self.plan, request.trial))


def scenes_for(need: str, plan: Plan, profiles: Profiles) -> Callable[[Sense], Scene]:
    """Return a function that makes the scene of each recording request for the sensors of a need."""
    return Strokes(plan) if need == "tool" else Openings(plan, profiles)


def pictures_of(request: Sense) -> Iterator[bytes]:
    """Yield the trial's texture under each light in turn, as the bytes of a PNG file."""
    for photo in photos_of(request):
        taken = BytesIO()
        photo.save(taken, "PNG", compress_level=3)
        yield taken.getvalue()


def photos_of(request: Sense) -> Iterator[Image]:
    """Yield the trial's texture under each light in turn, 1568 x 1568 pixels."""
    from PIL import Image

    from palpate.devices.surfaces.photo import LIGHTS, light, photographs
    from palpate.devices.surfaces.relief import relief

    surface = surface_of(request.trial.stimulus)
    for photo in photographs(surface, relief(surface), map(light, range(LIGHTS))):
        yield Image.fromarray(photo)
