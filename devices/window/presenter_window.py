"""The presenter with a real window: one scene is visible at a time, and the time of the others stands still."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palpate.devices.desk import Desk, Prompt, confirmed
from palpate.devices.window.build import RESTING, page_for, screen_for
from palpate.devices.window.calibration import NOMINAL_MM, TOLERANCE_MM, Calibration, demand_reading
from palpate.devices.window.presenter import END, PAUSE, Presenter, Shown
from palpate.devices.window.presenter_page import describe, prepare
from palpate.devices.window.scenes import Scene, Stage
from palpate.devices.window.shell import open_shell
from palpate.protocols.events import NS, Aside, Ask, Confirm, Instruct, Present, Reply
from palpate.protocols.plan import Plan
from palpate.protocols.study import Study

PARTICIPANT = "participant"
END_S, END_AT_DESK_S = 6.0, 60.0
"""How long the last page stays: without a desk, and with the experimenter at the desk."""


@dataclass
class WindowPresenter(Stage):
    """A presenter on a shell; see palpate.devices.window.presenter.Presenter.

    The request's scene is kept while something else is shown, such as the pause page; it is dropped with its answer.
    """

    description: Mapping[str, Any]
    on_side: Callable[[str], None] | None = None
    force_of: Callable[[Mapping[str, float]], Sequence[float]] | None = None
    request: Shown | None = None
    request_scene: Scene | None = None
    paused: bool = False
    resting: bool = False
    """Whether the participant paused the session."""
    covers: dict[str, Scene] = field(default_factory=dict)
    misread_mm: float | None = None

    def perform(self, request: Shown, desk: Desk, now_ns: Callable[[], int]) -> Reply | Aside:
        """Show the request's screen until it is answered."""
        scene = self._scene_of(request)
        while (reply := self._reply(request, scene, desk)) is None:
            if (aside := self._turn(scene, desk)) is not None:
                return aside
        self._forget(desk)
        # The reply's samples count from when the screen was first seen.
        seen_ns = now_ns() - round(scene.since_s() * NS)
        return replace(reply, samples=tuple(replace(block, t0_ns=seen_ns) for block in reply.samples))

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show a page until `ready`."""
        scene = self._cover(PAUSE if key == "paused" else key)
        while self.paused or not ready():
            if (aside := self._turn(scene, desk)) is not None:
                return aside
        return None

    def show_answered(self, request: Shown, reply: Reply, seconds: float, desk: Desk) -> Aside | None:
        """Show a filled form for a moment."""
        fresh, scene = request is not self.request, self._scene_of(request)
        if fresh:
            scene.screen.fill(reply.value)
            scene.deaf = True
        while self.paused or scene.seconds() < seconds:
            if (aside := self._turn(scene, desk)) is not None:
                return aside
        self._forget(desk)
        return None

    def show_live(
        self,
        request: Present,
        desk: Desk,
        ready: Callable[[], bool],
        moved: Callable[[Mapping[str, float], bool], None],
    ) -> Aside | None:
        """Show the live form, its lines moved by the participant."""
        scene = self._scene_of(request)
        while True:
            moved(scene.screen.so_far(), scene.screen.reply is not None)
            if not self.paused and ready():
                return None
            if (aside := self._turn(scene, desk)) is not None:
                return aside

    def finish(self, desk: Desk | None = None, page: str = END) -> None:
        """Show the last page. The experimenter's actions are not recorded any more."""
        self.paused = self.resting = False
        scene = self.put_on(self._cover(page))
        if desk is not None:
            desk.demand(Prompt("The session is over. Enter closes the participant's window."))
        while scene.seconds() < (END_S if desk is None else END_AT_DESK_S):
            if desk is not None and desk.poll() is None and desk.answer() is not None:
                break
            scene.turn()
        if desk is not None:
            desk.demand(None)

    def close(self) -> None:
        """Close the window."""
        self.shell.close()

    def _turn(self, scene: Scene, desk: Desk) -> Aside | None:
        """Poll the desk and the window once; show the scene, or the page of a pause or rest."""
        if (aside := desk.poll()) is not None:
            return self._handle_aside(aside, desk)
        seen = self._cover(RESTING if self.resting else PAUSE) if self.paused else scene
        if self.on is not seen:
            self.put_on(seen)
            desk.tell({"window": seen.name})
        seen.turn()
        self._tell_sides(scene)
        if (does := self._rests(seen)) is not None:
            return self._handle_aside(Aside({"do": does, "by": PARTICIPANT}), desk)
        return None

    def _rests(self, seen: Scene) -> str | None:
        """Return "pause" or "go_on" if the participant has just started or ended a rest, else None."""
        if self.resting and seen.screen.reply is not None:
            return "go_on"
        begins, seen.screen.wants_rest = seen.screen.wants_rest, False
        return "pause" if begins and not self.paused else None

    def _handle_aside(self, aside: Aside, desk: Desk) -> Aside:
        match aside.value.get("do"):
            case "pause":
                self.paused, self.resting = True, aside.value.get("by") == PARTICIPANT
                self.covers.pop(RESTING, None)
            case "go_on":
                self.paused = self.resting = False
            case "repeat" | "abort":
                self._forget(desk)
        return aside

    def _reply(self, request: Shown, scene: Scene, desk: Desk) -> Reply | None:
        if isinstance(request, Confirm) and not self.paused:
            return self._measured(desk) if request.text is None else confirmed(request, desk)
        return scene.screen.reply

    def _measured(self, desk: Desk) -> Reply | None:
        """Return the ruler's reading from the desk, repeating the question once. Raises WindowError."""
        again = "" if self.misread_mm is None else f"{self.misread_mm:g} mm is not {NOMINAL_MM:g}: measure once more. "
        question = f"{again}How many mm does the line on the participant's screen measure?"
        desk.demand(Prompt(question, "number", NOMINAL_MM))
        if (read := desk.answer()) is None or isinstance(read, str):
            return None
        desk.demand(None)
        if self.misread_mm is None and not abs(read - NOMINAL_MM) <= TOLERANCE_MM:
            self.misread_mm = float(read)
            return None
        self.misread_mm = None
        demand_reading(read, NOMINAL_MM)
        return Reply({"measured_mm": float(read), "nominal_mm": NOMINAL_MM})

    def _scene_of(self, request: Shown) -> Scene:
        if self.request_scene is None or request is not self.request:
            screen = screen_for(request, replace(self.page, force_of=self.force_of), 0)
            self.request, self.request_scene = request, self.scene(screen, _name(request))
            self.misread_mm = None
        return self.request_scene

    def _cover(self, key: str) -> Scene:
        """Return the scene of a page by its text key, created once."""
        if key not in self.covers:
            self.covers[key] = self.scene(page_for(key, self.page), key)
        return self.covers[key]

    def _tell_sides(self, scene: Scene) -> None:
        switched, scene.switched = scene.switched, []
        if self.on_side is not None:
            for side in switched:
                self.on_side(side)

    def _forget(self, desk: Desk) -> None:
        if isinstance(self.request, Confirm):
            desk.demand(None)
        self.request = self.request_scene = None


def _name(request: Shown) -> str:
    if isinstance(request, Ask):
        return request.form.name
    return request.page if isinstance(request, Instruct) else str(request.body()["do"])


def open_presenter(
    study: Study, calibration: Calibration, language: str, folder: Path, screen: int | None = None,
    fullscreen: bool = True, pages: Mapping[str, str] | None = None, plan: Plan | None = None,
    texts_file: Path | None = None,
) -> Presenter:  # fmt: skip
    """Open the participant's window, on the calibrated screen unless another is named.

    `folder` holds the study and its translations, `pages` are texts that replace the study's by name. With the plan,
    all of its forms are laid out first. Raises WindowError before anything is shown: texts, fonts, sizes, display.
    """
    page = prepare(study, calibration, language, folder, pages, plan, texts_file)
    shell = open_shell(calibration, calibration.screen if screen is None else screen, fullscreen)
    return WindowPresenter(shell, page, describe(page) | {"renderer": shell.renderer})
