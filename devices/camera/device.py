"""The camera: pictures of each sample under ten lights, which arrive in a folder (thesis 3.4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from palpate.devices.acts import Act, UnconfirmedFault, going_on
from palpate.devices.desk import Desk, Pages, Prompt
from palpate.devices.device import DeviceFault, Health, NowNs, Signal
from palpate.devices.kinds import Date, DeviceKind
from palpate.protocols.events import NS, Aside, Reply, Sense, WorldEvent
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.camera.sources import Arrived, Folder, PicturesOf, Simulated

Suffix = Annotated[str, Field(pattern=r"^\.[a-z0-9]+$")]
LightName = Annotated[str, Field(min_length=1, max_length=60)]
TWIN_LIGHTS = 10
"""Number of lights under which the simulated surfaces are photographed."""


class Settings(Strict):
    """The settings in a rig file. `folder` is where the camera's program saves files, `pictures` where they are stored.

    Without `pictures` it is LAB/pictures. `lights` is how many pictures a sample gets, or the lights' names in the
    order of the prompts.
    """

    kind: Literal["camera"]
    driver: Literal["folder", "twin"]
    folder: str | None = None
    pictures: str | None = None
    lights: (
        Annotated[int, Field(ge=1, le=99)] | Annotated[tuple[LightName, ...], Field(min_length=1, max_length=99)]
    ) = 10
    suffixes: Annotated[tuple[Suffix, ...], Field(min_length=1)] = (".jpg", ".jpeg", ".png", ".tif", ".tiff")
    order: Literal["name", "time"] = "time"
    settle_s: Annotated[float, Field(ge=0.2, le=60)] = 1.0
    least_pixels: Annotated[int, Field(ge=1, le=100_000)] = 1568
    least_sharpness: Annotated[float, Field(ge=0, le=20)] = 0.05
    most_white: Annotated[float, Field(ge=0, le=1)] = 0.05
    calibrated: Date | None = None

    @model_validator(mode="after")
    def _has_folder(self) -> Self:
        if self.driver == "folder" and self.folder is None:
            raise ValueError("folder is missing: the one that the camera's program puts its pictures into")
        if self.driver == "twin" and self.count > TWIN_LIGHTS:
            raise ValueError(f"lights: a twin has {TWIN_LIGHTS}, and {self.count} are requested")
        return self

    @property
    def count(self) -> int:
        """Return the number of pictures of each sample."""
        return self.lights if isinstance(self.lights, int) else len(self.lights)

    def light(self, number: int) -> str:
        """Return the name of a light for people: light 3 of 10 (left, low)."""
        named = "" if isinstance(self.lights, int) else f" ({self.lights[number - 1]})"
        return f"light {number} of {self.count}{named}"


MEANINGS: Mapping[str, str] = {
    "folder": "where the camera's own program puts its files; needed by `folder`",
    "pictures": "folder for pictures, in the rig file's folder; none is LAB/pictures",
    "lights": "pictures of each sample, or the names of the lights in their order; a twin has 10",
    "suffixes": "endings of the files that are pictures",
    "order": "how files that come at once are put in order",
    "settle_s": "a file is whole once it has not changed for so long, s",
    "least_pixels": "a picture with a shorter side below this is too small, pixels",
    "least_sharpness": "a picture is blurred below this (variance of the Laplacian over that of the brightness)",
    "most_white": "a picture is over-exposed where more than this share of it is white",
}


@dataclass
class Camera:
    """A camera that waits until there is a picture for each light. `pictures_of` gives the twin's pictures.

    A picture with the bytes of an earlier one is left out; one that is blurred, over-exposed or too small is requested
    again, and kept if the experimenter confirms it as it is.
    """

    name: str
    settings: Settings
    source: Folder | Simulated
    pictures: Path
    act: Act | None = None
    taken: dict[int, dict[str, Any]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    accepted: set[int] = field(default_factory=set)
    stopped: bool = False
    seen: dict[str, str] = field(default_factory=dict)
    unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)

    @property
    def signals(self) -> Sequence[Signal]:
        """Return an empty sequence: pictures are not signals."""
        return ()

    @property
    def pictures_of(self) -> PicturesOf | None:
        """Return the function that gives the twin's pictures; None with a real camera."""
        return getattr(self.source, "pictures_of", None)

    @pictures_of.setter
    def pictures_of(self, given: PicturesOf) -> None:
        if self.settings.driver == "twin":
            self.source.pictures_of = given  # type: ignore[union-attr]

    def keep_in(self, lab: Path) -> None:
        """Store the pictures in the lab, unless the rig file says where."""
        if self.settings.pictures is None:
            self.pictures = lab / "pictures"

    def open(self) -> None:
        """Check that the folder exists. Raises DeviceError."""
        demand = getattr(self.source, "demand", None)
        if demand is not None:
            demand()

    def safe(self) -> None:
        """Do nothing: a camera cannot harm anybody."""

    def close(self) -> None:
        """Do nothing: the camera keeps nothing open."""

    def describe(self) -> Mapping[str, Any]:
        """Return the settings."""
        return self.settings.model_dump(mode="json", exclude_none=True)

    def health(self, seconds: float) -> Health:  # noqa: ARG002 - a folder is looked at once
        """Return whether the folder can be read."""
        from palpate.devices.device import DeviceError

        pictures = "LAB/pictures" if self.settings.pictures is None else str(self.pictures)
        facts = {"lights": str(self.settings.count), "kept in": pictures}
        try:
            self.open()
        except DeviceError as error:
            return Health(False, str(error), calibrated=self.settings.calibrated, facts=facts)
        summary = "simulated" if self.settings.driver == "twin" else f"waits for pictures in {self.settings.folder}"
        return Health(True, summary, calibrated=self.settings.calibrated, facts=facts)

    def perform(self, request: Sense, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Request one light after the other until there is a picture for each, for at most `request.seconds`."""
        if aside := self.unconfirmed.demand_confirmation("changing_sample", window, desk):
            return aside
        try:
            act = going_on(self.act, request, now_ns)
            if act is not self.act:
                self.taken, self.left_out, self.accepted, self.stopped = {}, [], set(), False
                self.source.begin(request)
                self.act = act
            aside = self._shot(act, request, window, desk, now_ns)
        except DeviceFault as fault:
            desk.demand(None)
            self.act = None
            return self.unconfirmed.record(fault)
        if aside is not None:
            return aside
        desk.demand(None)
        self.act = None
        seconds = act.seconds(now_ns())
        missing = [str(n) for n in range(1, self.settings.count + 1) if n not in self.taken]
        if missing:
            there = (
                f"{len(self.taken)} of {self.settings.count} pictures of {request.trial.stimulus.id} in {seconds:.0f} s"
            )
            lacking = f"light {missing[0]}" if len(missing) == 1 else f"lights {', '.join(missing)}"
            twice = [f"{name} was left out, its picture had come before" for name in self.left_out]
            also = "".join(f"; {reason}" for reason in (*self.source.broken(), *twice))
            return self.unconfirmed.record(
                DeviceFault(self.name, "silent", f"{self.name} gave {there}, without {lacking}{also}")
            )
        pictures = [self.taken[n] for n in sorted(self.taken)]
        by = {"by": "twin"} if self.settings.driver == "twin" else {}
        return Reply({"recorded": True, "seconds": seconds, "pictures": pictures, "left_out": self.left_out, **by})

    def _shot(self, act: Act, request: Sense, window: Pages, desk: Desk, now_ns: NowNs) -> Aside | None:
        def ready() -> bool:
            light = self._light_due()
            if light is not None and desk.answer() is not None:
                # A confirmation keeps the picture that is complained of, or says that no more are coming.
                if light in self.taken:
                    self.accepted.add(light)
                else:
                    self.stopped = True
            for arrived in self.source.new(now_ns() / NS):
                self._take(request, arrived)
            desk.demand(self._prompt(request))
            return self._light_due() is None or self.stopped or act.seconds(now_ns()) >= request.seconds

        desk.demand(self._prompt(request))
        return act.wait("recording", window, desk, now_ns, ready)

    def _light_due(self) -> int | None:
        """Return the light that needs a picture: the first without one, then the first with a bad one.

        A twin's pictures do not get better: they are flagged and kept.
        """
        missing = (n for n in range(1, self.settings.count + 1) if n not in self.taken)
        bad = (n for n, picture in sorted(self.taken.items()) if picture["flags"] and n not in self.accepted)
        return next(missing, None) or (None if self.settings.driver == "twin" else next(bad, None))

    def _prompt(self, request: Sense) -> Prompt | None:
        number = self._light_due()
        if number is None:
            return None
        light = f"{request.trial.stimulus.id}, {self.settings.light(number)}"
        if number in self.taken:
            flags = " and ".join(self.taken[number]["flags"]).replace("_", " ")
            return Prompt(f"{light}: the picture is {flags}. Take it again, or confirm to keep it.")
        return Prompt(f"{light}: take the picture. Confirm only where no more come.")

    def _take(self, request: Sense, arrived: Arrived) -> None:
        from palpate.devices.camera.look import Incomplete, Limits, keep, look

        chosen = self.settings
        light = self._light_due()
        try:
            seen = look(arrived.data, Limits(chosen.least_pixels, chosen.least_sharpness, chosen.most_white))
        except Incomplete as error:
            self.source.refuse(arrived.name, str(error))
            return
        # A picture whose bytes were given for this sample now, or for another one ever, is left out.
        stimulus = request.trial.stimulus.id
        now = any(picture["sha256"] == seen.sha256 for picture in self.taken.values())
        if light is None or now or self.seen.get(seen.sha256, stimulus) != stimulus:
            self.left_out.append(arrived.name)
            return
        file = keep(self.name, self.pictures, stimulus, light, seen.sha256, arrived.name, arrived.data)
        self.seen[seen.sha256] = stimulus
        self.taken[light] = {
            "file": file, "from": arrived.name, "sha256": seen.sha256, "width": seen.width, "height": seen.height,
            "light": light, "sharpness": seen.sharpness, "white": seen.white, "flags": list(seen.flags),
        }  # fmt: skip


def make(name: str, settings: Settings, folder: Path) -> Camera:
    """Return the camera of that name without opening it; relative folders are relative to the rig file.

    Pictures are stored beside the rig file until `keep_in` names their lab.
    """
    from palpate.devices.camera.sources import Folder, Simulated

    source: Folder | Simulated = Simulated(name)
    if settings.driver == "folder":
        source = Folder(name, folder / str(settings.folder), settings.suffixes, settings.settle_s, settings.order)
    return Camera(name, settings, source, folder / (settings.pictures or "pictures"))


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=(
        "is set at the camera itself: focus, exposure and white balance. `least_sharpness` and `most_white` "
        "then judge its pictures"
    ),
    unplug="its pictures come in a folder",
    exceed="it takes pictures, and touches nobody",
)
