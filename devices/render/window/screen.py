"""The screen: what mouse and keyboard do to the choice, strokes over the picture, and what somebody else is to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from palpate.devices.render.window.board import Board, Told
from palpate.devices.render.window.choice import FIRMEST_N, LIGHTEST_N, Choice, beside
from palpate.devices.render.window.elements import Touched
from palpate.devices.render.window.heard import Heard
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import Frame
from palpate.devices.window.screens.targets import Track

STEPS = {"right": 1, "left": -1, "pageup": 5, "pagedown": -5}
LETTERS = {"m": "mute", "q": "close", "ㅡ": "mute", "ㅂ": "close"}
"""What a letter does, also where Hangul is on."""
SLIDERS = ("volume", "press")


class Stroke(NamedTuple):
    """A place on the picture, in mm from its top left corner; `t_s` in seconds since the screen was shown."""

    t_s: float
    x_mm: float
    y_mm: float
    touching: bool


class RenderScreen(Base):
    """The window's one screen. `strokes` are taken by whoever plays; so are `asked`: close."""

    def __init__(self, page: Page, board: Board, choice: Choice) -> None:
        self.board, self.choice = board, choice
        self.heard, self.told = Heard(), Told()
        self.strokes: list[Stroke] = []
        self.asked: list[str] = []
        super().__init__(Frame(page, "", "", (), ()))

    def body(self) -> Iterable[Element]:
        elements = self.board.elements(self.choice, self.heard, self.told)
        return [
            replace(e, held=True) if isinstance(e, Track | Touched) and e.name == self.held else e for e in elements
        ]

    def show(self, heard: Heard, told: Told) -> None:  # type: ignore[override]
        """What is played, and what is said of it, from now on."""
        if (heard, told) != (self.heard, self.told):
            self.heard, self.told, self._stale = heard, told, True

    def choose(self, choice: Choice) -> None:
        """Another choice is on."""
        if choice != self.choice:
            self.choice, self._stale = choice, True

    def pressed(self, name: str, event: Pressed) -> None:
        self._move(name, event, True)

    def dragged(self, name: str, event: Moved | Released) -> None:
        self._move(name, event, isinstance(event, Moved))

    def chosen(self, name: str, /) -> None:
        if name == "close":
            self.asked.append(name)
        elif name.startswith("texture "):
            self.choose(self.choice.of_texture(name.removeprefix("texture "), self.board.models))
        else:
            self.choose(replace(self.choice, method=name.removeprefix("method ")))

    def typed(self, _name: str | None, text: str, /) -> None:
        self.asked += [LETTERS[letter] for letter in text.strip().lower() if letter in LETTERS]

    def key(self, name: str | None, event: Key, /) -> bool:
        if event.name == "escape":
            self.asked.append("close")
        elif name in SLIDERS and event.name in STEPS and self.by_key:
            self._slide(name, 0.05 * STEPS[event.name])
        elif event.name in ("left", "right"):
            textures = tuple(self.board.models)
            texture = beside(textures, self.choice.texture, STEPS[event.name])
            self.choose(self.choice.of_texture(texture, self.board.models))
        elif event.name in ("up", "down"):
            methods = tuple(self.board.models[self.choice.texture])
            method = beside(methods, self.choice.method, 1 if event.name == "down" else -1)
            self.choose(replace(self.choice, method=method))
        else:
            return False
        return True

    def go_back(self) -> None:
        """There is nothing to go back to."""

    def _move(self, name: str, event: Pressed | Moved | Released, touching: bool) -> None:
        if name == "picture":
            inside = self.board.layout.picture.holds(event.x, event.y)
            self.strokes.append(Stroke(event.t_s, *self.board.mm_at(event.x, event.y), touching and inside))
        elif name in SLIDERS:
            self._put(name, self.board.track(name, self.choice).share_at(event.x))

    def _slide(self, name: str, by: float) -> None:
        share = self.board.track(name, self.choice).share or 0.0
        self._put(name, min(max(share + by, 0.0), 1.0))

    def _put(self, name: str, share: float) -> None:
        if name == "volume":
            self.choose(self.choice.louder(share))
        else:
            self.choose(self.choice.firmer(LIGHTEST_N + share * (FIRMEST_N - LIGHTEST_N)))
