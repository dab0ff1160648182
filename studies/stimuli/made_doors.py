"""Doors that are made from wishes while a session runs, and what its record keeps of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.desk import Desk, Pages
from palpate.devices.device import Presents
from palpate.devices.door.live import LiveDoor
from palpate.devices.door.making import HIGHEST, LOWEST, Doors, maker_for
from palpate.protocols.forms import Sliders
from palpate.protocols.requests import Came, Chunk, Fault, Present, Reply
from palpate.protocols.trial import Trial
from palpate.studies.sessions.rig import RigError
from palpate.studies.stimuli.live_doors import LiveForm, LiveRecord, ShowsForms

if TYPE_CHECKING:
    from palpate.devices.door.link.showing import Changes


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
    """A door that plays what is wished for, and follows the sliders where the form is live; its replies say what
    that was. `changes_from` hands the door what it follows, or None."""

    door: Presents
    made: MadeDoors
    changes_from: Callable[[Changes | None], None] = lambda _changes: None
    _following: tuple[Present, LiveForm, LiveRecord] | None = None

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> Came:
        """As the door does. Raises RigError where a live form has no window to stay in."""
        if request.live_form is None:
            came = self.door.perform(request, window, desk, now_ns)
            return self.made.on_record(self.made.force_N(request), came) if isinstance(came, Reply) else came
        pages, record = self._followed(request, window, now_ns)
        came = self.door.perform(request, pages, desk, now_ns)
        if isinstance(came, Chunk):
            return replace(came, samples=(*came.samples, *record.take()))
        if isinstance(came, Reply):
            self._let_go()
            reply = self.made.on_record(tuple(record.force_N), came)
            return replace(reply, value={**reply.value, **record.summary()}, samples=(*reply.samples, *record.take()))
        if isinstance(came, Fault) or came.value.get("do") in {"repeat", "abort"}:
            self._let_go()
        return came

    def _followed(self, request: Present, window: Pages, now_ns: Callable[[], int]) -> tuple[LiveForm, LiveRecord]:
        """What the door follows while this very request is performed."""
        if self._following is None or self._following[0] is not request:
            if not isinstance(window, ShowsForms):
                raise RigError("a live form stays on while the door is felt, and there is no window to show it in")
            pages = LiveForm(window, request)
            force_N = self.made.force_N(request)
            live = LiveDoor(pages.setting, self.made.doors.force_N, pages.setting(), pages.is_done)
            record = LiveRecord(list(pages.setting()), pages.setting(), force_N, live, now_ns())
            self._following = request, pages, record
            self.changes_from(live)
        return self._following[1:]

    def _let_go(self) -> None:
        self._following = None
        self.changes_from(None)


def made_doors(lab: Path | None) -> MadeDoors:
    """The doors that wishes come to in a lab. Raises ModelFileError where its models cannot be read."""
    return MadeDoors(Doors(maker_for(lab)))
