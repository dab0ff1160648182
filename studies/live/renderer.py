"""Virtual textures at a rig: a study's models on the station's stylus and actuator, and how they are recorded.

The loop runs in a process of its own, which opens both devices itself: neither the window nor the ledger can hold it
up. A texture is there from its presentation until it is answered for, since people answer while they feel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from palpate.devices.acts import UnconfirmedFault
from palpate.devices.actuator.device import VoiceCoil
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.render.job import Job
from palpate.devices.render.process import Rendering
from palpate.devices.render.sinks import MOST_AHEAD, on_coil
from palpate.devices.render.window.photo import photo_file, read_photo
from palpate.devices.rig.opened import OpenRig
from palpate.devices.window.geometry import WindowError
from palpate.protocols.events import NS, Ask, Fault, Present, Reply, WorldEvent
from palpate.protocols.files import file_sha256
from palpate.protocols.keyed import keyed_bits
from palpate.protocols.plan import Plan
from palpate.protocols.trial import Trial
from palpate.signals.models.errors import ModelFileError
from palpate.signals.models.file import read_card
from palpate.signals.textures.sounds import RenderError, Sounds
from palpate.studies.simulation.virtual_textures import VirtualTextures
from palpate.studies.stimuli.renderings import MET, model_metadata
from palpate.studies.stimuli.scenes import drawn

NEED = "texture_renderer"
COUNTED = ("steps", "late", "skipped")
OUTPUT = ("underruns", "missing", "limited")
VIRTUAL = "virtual"
"""The side on which a texture's picture is shown; without such a side it is shown while the texture plays."""


class Plays(Protocol):
    """The interface of a renderer: `palpate.devices.render.process.Rendering` or a stand-in."""

    @property
    def running(self) -> bool:
        """Whether it plays."""

    def switch(self, sounds: Sounds | None) -> None:
        """Switch to another texture, or to silence. Raises RenderError."""

    def record(self) -> Mapping[str, Any]:
        """Return the present record of the loop. Raises RenderError."""

    def __exit__(self, *_raised: object) -> None:
        """Become silent and close everything."""


class Shows(Protocol):
    """The tablet's screen: `palpate.devices.render.window.tablet_screen.TabletScreen` or a stand-in."""

    def show(self, picture: Path | None) -> None:
        """Show the picture, or nothing. Raises RenderError."""


@dataclass
class RigRenderer:
    """The presenter of a study's virtual textures.

    Its replies name the model and count deadlines, at the beginning of a texture and again with the answer, for the
    time between. A tablet that is a screen shows the texture's picture while the virtual side is on.
    """

    plan: Plan
    renderings: VirtualTextures
    begin: Callable[[], Plays]
    plays: Plays | None = None
    tablet: Shows | None = None
    on: bool = False
    unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)
    counted: dict[str, Any] = field(default_factory=dict)
    metadata: dict[str, Any] = field(default_factory=dict)
    picture: Path | None = None
    side: str | None = None
    trouble: RenderError | None = None
    """An error of the tablet's screen while a form was answered."""

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> WorldEvent:
        """Switch to the stimulus' texture; it plays when this returns.

        After a fault somebody must first confirm the repair.
        """
        if aside := self.unconfirmed.demand_confirmation("changing_sample", window, desk):
            return aside
        started_ns = now_ns()
        try:
            self._put_on(request.trial)
        except (ValueError, OSError) as error:
            return self._fault(error)
        blind = self.plan.study.blind
        desk.tell({NEED: "renders" if blind else f"{self.metadata['model']}, {self.metadata['runtime']}"})
        seconds = round((now_ns() - started_ns) / NS, 3)
        made = {**self.metadata, "deadlines": self.counted}
        return Reply({"presented": True, "by": "renderer", "seconds": seconds, "rendered": made})

    def before(self, request: Ask) -> WorldEvent | None:
        """Make the texture to be rated sound before its form, also where the session was resumed within the trial.

        Returns None, or the fault that came instead. Nothing sounds where an answer is only revised.
        """
        if self.on or request.trial is None or request.trial.previous is not None:
            return None
        try:
            self._put_on(request.trial)
        except (ValueError, OSError) as error:
            return self._fault(error)
        return None

    def _put_on(self, trial: Trial) -> None:
        """Play the trial's texture. Raises RigError, RenderError, ModelFileError, DeviceError."""
        card = self.renderings.card(trial.stimulus)
        seed = keyed_bits("rendered", *drawn(self.plan, trial)) % 2**31
        if self.plays is None or not self.plays.running:
            self.close()
            self.plays = self.begin()
        plays = self.plays
        plays.switch(Sounds(card, seed))
        self.on, record = True, plays.record()
        self.counted = counts_of(record)
        self.metadata = {**model_metadata(card, read_card(card)), "runtime": runtime_of(record), "seed": seed}
        self.picture = None
        if self.tablet is not None:
            self.picture, self.metadata["picture"] = picture_of(card)
            self._show()

    def switch_side(self, side: str) -> None:
        """Note the participant's side, and show the picture on the virtual one only."""
        self.side = side
        try:
            self._show()
        except RenderError as error:  # the form goes on; with its answer the trial is marked
            self.trouble = error

    def _show(self) -> None:
        """Show the picture while the texture plays, on the virtual side only. Raises RenderError."""
        if self.tablet is not None:
            seen = self.on and (VIRTUAL not in self.plan.study.sides or self.side == VIRTUAL)
            self.tablet.show(self.picture if seen else None)

    def _fault(self, error: Exception) -> Fault:
        """Return the fault that has the trial repeated once somebody has confirmed the repair."""
        self.close()
        return self.unconfirmed.record(DeviceFault(NEED, "refused", str(error)))

    def after(self, event: WorldEvent) -> WorldEvent:
        """Return the answered form with what the renderer did meanwhile, and become silent."""
        if not self.on or self.plays is None:
            return event
        self.on, self.side = False, None
        try:
            trouble, self.trouble = self.trouble, None
            if trouble is not None:
                raise trouble
            self._show()
            record = self.plays.record()
            if not self.plays.running:
                raise RenderError("the renderer ended while the texture was felt")
            self.plays.switch(None)
        except RenderError as error:
            fault = self._fault(error)
            return fault if isinstance(event, Reply) else event
        if not isinstance(event, Reply):
            return event
        made = {**self.metadata, "deadlines": since(self.counted, counts_of(record)), "met": playing_counts(record)}
        return replace(event, value={**event.value, "rendered": made})

    def close(self) -> None:
        """Become silent and end the process."""
        plays, self.plays, self.on, self.side = self.plays, None, False, None
        if plays is not None:
            plays.__exit__()


def rig_renderer(rig: OpenRig, plan: Plan, folder: Path, lab: Path, tablet: Shows | None = None) -> RigRenderer:
    """Return the renderer at a rig's stylus and actuator, which this process closes for it; `tablet` shows pictures.

    Raises DeviceError where they cannot be opened again, or cannot be used for a study.
    """
    coil = demand_usable(rig)
    for device in rig.of(NEED).values():
        device.close()
    job = Job(None, None, rig.file.path, min(MOST_AHEAD, coil.settings.ahead_ms))
    made = RigRenderer(plan, VirtualTextures(folder, lab), lambda: open_rendering(job), tablet=tablet)
    made.plays = made.begin()
    return made


def open_rendering(job: Job) -> Rendering:
    """Start the loop in its process, silent. Raises DeviceError where the devices are not available."""
    try:
        return Rendering(job).__enter__()
    except RenderError as error:
        raise DeviceError(f"{NEED}: {error}") from None


def demand_usable(rig: OpenRig) -> VoiceCoil:
    """Return the rig's identified voice coil. Raises DeviceError unless another process can read the rig's tablet."""
    devices = rig.of(NEED)
    coil, tablet = devices["voice_coil"], devices["tablet"]
    if not isinstance(coil, VoiceCoil):
        raise DeviceError(f"{coil.name} is not a voice coil")
    try:
        on_coil(coil, 1)
    except RenderError as error:
        raise DeviceError(str(error)) from None
    if getattr(tablet, "settings", None) is not None and tablet.settings.driver == "pyglet":  # type: ignore[attr-defined]
        raise DeviceError(
            f"{tablet.name}: a study reads its tablet without the window, and the driver pyglet only through it. Use "
            "`evdev`; `palpate render` takes either."
        )
    return coil


def picture_of(card: Path) -> tuple[Path, dict[str, Any]]:
    """Return a model's picture, and its entry in the record: name, SHA-256, size in mm. Raises RenderError."""
    file = photo_file(read_card(card), card.parent)
    if file is None:
        raise RenderError(
            f"{card.name}: the tablet shows the texture's picture, and the card names none (texture.picture); add one,"
            " or leave `screen` out of the tablet's settings in the rig file"
        )
    try:
        size_mm = read_photo(file).size_mm
        digest = file_sha256(file)
    except (WindowError, OSError) as error:
        raise RenderError(str(error)) from None
    return file, {"file": file.name, "sha256": digest, "size_mm": [round(side, 2) for side in size_mm]}


def demand_pictures(plan: Plan, folder: Path, lab: Path) -> None:
    """Raise DeviceError naming the model unless every texture of the plan has a picture that can be shown."""
    renderings = VirtualTextures(folder, lab)
    for card in {renderings.card(trial.stimulus) for trial in plan.presented}:
        try:
            picture_of(card)
        except (RenderError, ModelFileError) as error:
            raise DeviceError(str(error)) from None


def runtime_of(record: Mapping[str, Any]) -> str:
    """Return the name of the runtime of the present model."""
    return str((record.get("voice") or {}).get("runtime", "none"))


def playing_counts(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the present model's counts of steps: sounded, with a held sensor value, dead, muted; and its restarts."""
    voice = record.get("voice") or {}
    return {name: voice.get(name, 0) for name in MET}


def counts_of(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the counts of a record, with the values needed to interpret them."""
    ready, output = record.get("ready", {}), record.get("output", {})
    counted = {**{name: ready.get(name, 0) for name in COUNTED}, **{name: output.get(name, 0) for name in OUTPUT}}
    return {**counted, "ahead_ms": output.get("ahead_ms"), "priority": record.get("priority")}


def since(before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """Return the counts between two records."""
    return {name: value - before[name] if name in (*COUNTED, *OUTPUT) else value for name, value in now.items()}
