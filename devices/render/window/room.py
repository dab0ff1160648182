"""The window as a whole: what is done on it goes to whoever plays, and what is played comes back to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.devices.render.trace import Trace
from palpate.devices.render.window.board import Board, Told
from palpate.devices.render.window.choice import Choice
from palpate.devices.render.window.heard import SHOWN, heard
from palpate.devices.render.window.screen import RenderScreen, Stroke
from palpate.devices.render.window.words import method_word, texture_word
from palpate.devices.tablet.force import Force
from palpate.devices.tablet.reports import Report
from palpate.devices.window.loop import Scene
from palpate.devices.window.screen import Page
from palpate.devices.window.shell import Shell
from palpate.signals.textures.sounds import RenderError, Sounds

if TYPE_CHECKING:
    from PIL import Image

LOOK_S, TELL_S = 0.04, 0.5
"""How often the trace is drawn, and how often the figures are asked for."""


class Plays(Protocol):
    """What renders: `palpate.devices.render.process.Rendering`, or something that stands for it."""

    trace: Trace

    @property
    def running(self) -> bool:
        """Whether it plays."""

    def switch(self, sounds: Sounds | None) -> None:
        """Go over to another texture, or to silence. Raises RenderError."""

    def push(self, reports: Sequence[Report]) -> None:
        """A stylus' or a mouse's newest reports. Raises RenderError."""

    def volume(self, gain: float) -> None:
        """How loud, from 0 to 1. Raises RenderError."""

    def record(self) -> Mapping[str, Any]:
        """How it goes. Raises RenderError."""


@dataclass
class Room:
    """The renderer's window.

    `sounds` makes of a card what is to be played, `begin` starts to play (it ended, and a texture is chosen anew).
    `stylus` gives the reports of a pen tablet that only the window hears; `epoch_s` is the shell's time that reports
    count from. `notice` is said first.
    """

    shell: Shell
    page: Page
    picture: Image.Image
    board: Board
    choice: Choice
    begin: Callable[[Sounds], Plays]
    sounds: Callable[[Path], Sounds]
    epoch_s: float = 0.0
    notice: str = ""
    stylus: Callable[[], Sequence[Report]] | None = None
    curve: Force = field(default_factory=Force)
    plays: Plays | None = None
    over: bool = False
    silent: bool = False
    main: RenderScreen = field(init=False)
    _scene: Scene = field(init=False)
    _told: Told = field(default_factory=Told)
    _looked_s: float = -1.0
    _asked_s: float = -1.0

    def __post_init__(self) -> None:
        self.main = RenderScreen(self.page, self.board, self.choice)
        self._scene = Scene(self.main, self.shell, self.picture, "render")
        self._told = Told(notice=self.notice)
        self.main.show(self.main.heard, self._told)

    def run(self) -> None:
        """Until the window is closed."""
        self._scene.appear()
        self._put_on()
        while not self.over:
            self.turn()

    def turn(self) -> None:
        """One look at the window: what was done goes out, what is played comes in."""
        self._scene.turn()
        self._do()
        now_s = self.shell.now_s()
        if now_s - self._asked_s >= TELL_S:
            self._asked_s = now_s
            self._ask()
        if now_s - self._looked_s >= LOOK_S:
            self._looked_s = now_s
            self._look()

    def _do(self) -> None:
        main, before = self.main, self.choice
        for asked in (main.asked.pop(0) for _ in range(len(main.asked))):
            if asked == "close":
                self.over = True
            elif self.silent:
                self._put_on()
            else:
                self._be_silent()
        self._push()
        if main.choice != before:
            self.choice = main.choice
            if (main.choice.texture, main.choice.method) != (before.texture, before.method):
                self._put_on()
            elif main.choice.volume != before.volume:
                self._safely(lambda plays: plays.volume(main.choice.volume))

    def _put_on(self) -> None:
        """Play the texture that is chosen. What cannot be played is said, and the last one goes on."""
        try:
            wanted = self.sounds(self.board.models[self.choice.texture][self.choice.method])
            if self.plays is None or not self.plays.running:
                self.plays = self.begin(wanted)
                if self.choice.volume < 1:
                    self._safely(lambda plays: plays.volume(self.choice.volume))
            else:
                self.plays.switch(wanted)
            texts, choice = self.page.texts, self.choice
            names = {"texture": texture_word(texts, choice.texture), "method": method_word(texts, choice.method)}
            self.silent, self._told = False, replace(self._told, silent=False)
            self._say(" ".join(filter(None, (texts("switched", **names) + ".", self.notice))))
        except ValueError as error:
            self._say(self.page.texts("cannot", why=str(error)), wrong=True)

    def _push(self) -> None:
        strokes, self.main.strokes = self.main.strokes, []
        reports = list(self.stylus()) if self.stylus is not None else [self._report(each) for each in strokes]
        if reports and self.plays is not None and self.plays.running:
            self._safely(lambda plays: plays.push(reports))

    def _report(self, stroke: Stroke) -> Report:
        """The mouse as a stylus would report it, pressed as firmly as the slider says."""
        watch = self._scene.watch
        shown_s = 0.0 if watch is None else watch.shown_s + watch.lost_s
        pressure = self.curve.pressure(self.choice.force_N) if stroke.touching else 0.0
        at_s = shown_s + stroke.t_s - self.epoch_s
        return Report(at_s, stroke.x_mm, stroke.y_mm, pressure, stroke.touching)

    def _be_silent(self) -> None:
        self.silent = True
        self._told = replace(self._told, silent=True)
        self._safely(lambda plays: plays.switch(None))

    def _ask(self) -> None:
        """The deadline statistics so far."""
        plays = self.plays
        if plays is None:
            return
        try:
            self._told = replace(self._told, record=plays.record())
            if not plays.running:
                raise RenderError("its process is over.")
        except RenderError as error:
            self._say_ended(error)

    def _look(self) -> None:
        if self.plays is None:
            self.main.show(self.main.heard, self._told)
            return
        trace = self.plays.trace
        self.main.show(heard(trace.since(trace.count - SHOWN)[1]), self._told)

    def _safely(self, act: Callable[[Plays], None]) -> None:
        """Do something with whoever plays; where that fails, the next look at it says so."""
        if self.plays is None:
            return
        try:
            act(self.plays)
        except RenderError as error:
            self._say_ended(error)

    def _say_ended(self, error: RenderError) -> None:
        self._say(self.page.texts("ended", why=str(error).rstrip(".") + "."), wrong=True)

    def _say(self, notice: str, wrong: bool = False) -> None:
        self._told = replace(self._told, notice=notice, wrong=wrong)
