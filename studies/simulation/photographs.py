"""Pictures that the camera's twin takes in no time and saves as at a rig, for sessions that need them later."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.protocols.events import Aside, Reply, Request, Sense
from palpate.protocols.simulated_world import Done
from palpate.protocols.trial import Trial
from palpate.studies.console.headless import Windowless
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.virtual_recording import Leaping
from palpate.studies.stimuli.scenes import SECONDS_A_PICTURE, demand_surface, photos_of, sensing

if TYPE_CHECKING:
    from palpate.devices.camera.device import Camera
    from palpate.devices.camera.sources import PicturesOf
    from palpate.devices.desk import Prompt

QUALITY = 92
"""Quality of the JPEG files, which take a fifth of the PNG files' size; a camera's are about as good."""


def jpegs_of(request: Sense, count: int) -> Iterator[bytes]:
    """Yield the trial's texture under the first `count` lights, each as the bytes of a JPEG file."""
    for _, photo in zip(range(count), photos_of(request), strict=False):
        taken = BytesIO()
        photo.save(taken, "JPEG", quality=QUALITY)
        yield taken.getvalue()


@dataclass
class KeptCameraTwin:
    """A simulated camera that saves its pictures in LAB/pictures, and returns what a camera at a rig does.

    `taken` makes the pictures of a request; None: `jpegs_of`.
    """

    lab: Path
    lights: int
    taken: PicturesOf | None = None
    made: list[Camera] = field(default_factory=list)

    def check(self, trial: Trial) -> None:
        """Raise RigError unless the stimulus can be simulated, and there are as many lights as pictures."""
        self._camera()
        demand_surface(trial)

    def __call__(self, request: Request, t_ns: int) -> Done:  # noqa: ARG002
        """Take the pictures of a stimulus and save them. Raises RigError where they cannot be saved."""
        sense = sensing(request, "camera")
        clock = Leaping()

        def rest(_seconds: float) -> None:
            clock.at_s += SECONDS_A_PICTURE

        event = self._camera().perform(sense, Windowless(clock, rest), _Nobody(), clock.ns)
        if not isinstance(event, Reply):
            raise RigError(f"{sense.trial.stimulus.id}: {event.value.get('message', 'no pictures came')}")
        return Done(event, float(event.value["seconds"]))

    def _camera(self) -> Camera:
        """Return the session's camera, which remembers its pictures. Raises RigError on lights that a twin lacks."""
        if not self.made:
            self.made.append(_camera(self.lab, self.lights, self.taken))
        return self.made[0]


def _camera(lab: Path, lights: int, taken: PicturesOf | None) -> Camera:
    from palpate.devices.camera.device import TWIN_LIGHTS, Settings, make

    if not 1 <= lights <= TWIN_LIGHTS:
        raise RigError(f"{lights} pictures of each texture: from 1 to {TWIN_LIGHTS} are expected, as many as a twin's")
    camera = make("camera", Settings(kind="camera", driver="twin", lights=lights), Path())
    camera.source.suffix = ".jpg"  # type: ignore[union-attr]
    camera.pictures_of = taken or partial(jpegs_of, count=lights)
    camera.keep_in(lab)
    return camera


@dataclass(frozen=True)
class _Nobody:
    """A desk without an experimenter."""

    def poll(self) -> Aside | None:
        """Return None: nothing happens."""
        return None

    def demand(self, prompt: Prompt | None) -> None:
        """Do nothing: nobody reads it."""

    def answer(self) -> float | bool | str | None:
        """Return None: nobody answers."""
        return None

    def tell(self, state: Mapping[str, Any]) -> None:
        """Do nothing: nobody reads it."""
