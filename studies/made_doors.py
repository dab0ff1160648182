"""Doors that are made from wishes while a session runs, and what its record keeps of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from devices.desk import Desk, Pages
from devices.door.making import HIGHEST, LOWEST, Doors, maker_for
from devices.signals import Presents
from protocols.forms import Sliders
from protocols.plan import Trial
from protocols.requests import Came, Present, Reply
from studies.rig import RigError


@dataclass(frozen=True)
class MadeDoors:
    """The doors of a lab's models, or else of the shipped ones."""

    doors: Doors

    def check(self, trial: Trial) -> None:
        """The trial's attributes and their scale are those that doors can be made from. Raises RigError."""
        names, form = list(self.doors.maker.attributes), trial.form
        if not isinstance(form, Sliders) or sorted(form.items()) != sorted(names):
            found = "no sliders" if form is None else ", ".join(form.items())
            raise RigError(f"the door generator makes doors from {', '.join(names)}; found {found}")
        if (form.scale.low, form.scale.high) != (LOWEST, HIGHEST):
            found = f"{form.scale.low:g} to {form.scale.high:g}"
            raise RigError(f"the door generator needs a scale from 0 to 100; found {found}")

    def force_N(self, request: Present) -> tuple[float, ...]:
        """The 621 forces that are wished for. Raises RigError where there is no wish, DoorDataError on another one."""
        if request.wish is None:
            raise RigError(f"the door generator needs a wish to present, and was asked {request.body()!r}")
        return self.doors.force_N(request.wish)

    def on_record(self, force_N: tuple[float, ...], reply: Reply) -> Reply:
        """The reply with what was made: by which models, and the very forces, which outlast them."""
        made = {"models": dict(self.doors.maker.identity), "force_N": list(force_N)}
        return replace(reply, value={**reply.value, "made": made})


@dataclass
class PresentsMade:
    """A door that plays what is wished for; its replies say what that was."""

    door: Presents
    made: MadeDoors

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> Came:
        """As the door does."""
        came = self.door.perform(request, window, desk, now_ns)
        return self.made.on_record(self.made.force_N(request), came) if isinstance(came, Reply) else came


def made_doors(lab: Path | None) -> MadeDoors:
    """The doors that wishes come to in a lab. Raises ModelFileError where its models cannot be read."""
    return MadeDoors(Doors(maker_for(lab)))
