"""Visible screens: a scene has its own time and inputs, without pauses; a stage shows one scene."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from palpate.devices.window.inputs import Input, Moved, Pressed, Released
from palpate.devices.window.screen import Page, Screen

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.window.shell import Shell

TURN_S = 0.005
"""Time between two polls of the window and the desk if nothing happens."""


@dataclass
class Stopwatch:
    """A stopwatch of the seconds that a screen was visible, on the shell's clock."""

    shown_s: float
    covered_s: float | None = None
    lost_s: float = 0.0

    def at(self, now_s: float) -> float:
        """Return the seconds that the screen was visible until then, never below 0."""
        until = now_s if self.covered_s is None else min(now_s, self.covered_s)
        return max(0.0, until - self.shown_s - self.lost_s)

    def stop(self, now_s: float) -> None:
        """Stop the time, because the screen is covered."""
        if self.covered_s is None:
            self.covered_s = now_s

    def go_on(self, now_s: float) -> None:
        """Resume the time, because the screen is visible again."""
        if self.covered_s is not None:
            self.lost_s += now_s - self.covered_s
            self.covered_s = None


@dataclass
class Scene:
    """A screen with its stopwatch on a shell; `picture` is the whole screen, shared by all scenes of a window.

    Inputs count from the moment that the screen is visible: earlier ones belong to the screen before. A press belongs
    to the screen that it began on, so that neither half of it reaches another. A deaf scene ignores the participant's
    inputs. `switched` collects every side that was switched to, until it is read.
    """

    screen: Screen
    shell: Shell
    picture: Image.Image
    name: str = ""
    deaf: bool = False
    watch: Stopwatch | None = None
    press: Pressed | Moved | None = None
    side: str | None = None
    switched: list[str] = field(default_factory=list)

    def seconds(self) -> float:
        """Return how long the participant has seen the screen, in seconds."""
        return 0.0 if self.watch is None else self.watch.at(self.shell.now_s())

    def since_s(self) -> float:
        """Return the seconds since the screen was first seen, including those when it was covered."""
        return 0.0 if self.watch is None else self.shell.now_s() - self.watch.shown_s

    def appear(self) -> None:
        """Paint and show the screen, for the first time or again; inputs made meanwhile are dropped."""
        self.screen.repaint()
        self.shell.show(self.picture, self.screen.paint(self.picture))
        self.shell.forget()
        self._note_side()
        if self.watch is None:
            self.watch = Stopwatch(self.shell.now_s())
        else:
            self.watch.go_on(self.shell.now_s())

    def vanish(self) -> None:
        """Release what is held and stop the time, because something else will be shown."""
        if self.watch is None or self.watch.covered_s is not None:
            return
        now_s = self.shell.now_s()
        if self.press is not None and self.screen.reply is None:
            self.screen.handle(Released(self.press.x, self.press.y, self.watch.at(now_s)))
        self.press = None
        self.watch.stop(now_s)

    def turn(self) -> None:
        """Pass inputs to the screen and paint the changes; return at once when there is a reply."""
        for event in self.shell.gather():
            if not self.deaf and self.watch is not None and self._belongs(event):
                self.screen.handle(replace(event, t_s=self.watch.at(event.t_s)))
                self._note_side()
            if self.screen.reply is not None:
                return
        if changed := self.screen.paint(self.picture):
            self.shell.show(self.picture, changed)
        else:
            self.shell.rest(TURN_S)

    def _note_side(self) -> None:
        side = self.screen.side
        if side is not None and side != self.side:
            self.side = side
            self.switched.append(side)

    def _belongs(self, event: Input) -> bool:
        """Return whether the input is for this screen, and keep track of the press."""
        match event:
            case Pressed():
                self.press = event
                return True
            case Moved() | Released() if self.press is None:
                return False
            case Moved():
                self.press = event
            case Released():
                self.press = None
        return True


@dataclass
class Stage:
    """A stage that shows one scene at a time on a shell; the time of the others stands still. `on` is the visible
    scene.
    """

    shell: Shell
    page: Page
    picture: Image.Image = field(init=False)
    on: Scene | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        from PIL import Image

        metrics = self.page.metrics
        self.picture = Image.new("RGB", (metrics.width_px, metrics.height_px), "white")

    def scene(self, screen: Screen, name: str) -> Scene:
        """Return a scene for the screen, not shown yet."""
        return Scene(screen, self.shell, self.picture, name)

    def put_on(self, scene: Scene) -> Scene:
        """Show the scene instead of the visible one."""
        if self.on is not None:
            self.on.vanish()
        self.on = scene
        scene.appear()
        return scene
