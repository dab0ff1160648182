"""The screen: how mouse and keyboard change the choice, strokes over the picture, and requests to the window."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar, NamedTuple

from palpate.devices.render.window.choice import FIRMEST_N, LIGHTEST_N, Choice, beside
from palpate.devices.render.window.elements import Heard
from palpate.devices.render.window.view import RendererStatus, RendererView
from palpate.devices.window.app import AppScreen
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.elements import Element

STEPS = {"right": 1, "left": -1, "pageup": 5, "pagedown": -5}
SLIDERS = ("volume", "press")


class Stroke(NamedTuple):
    """A position on the picture, in mm from its top left corner; `t_s` is in seconds since the screen was shown."""

    t_s: float
    x_mm: float
    y_mm: float
    touching: bool


class RendererScreen(AppScreen):
    """The screen with the picture and the choices. `strokes` over the picture are left to the window."""

    LETTERS: ClassVar = {"m": "mute", "q": "close", "ㅡ": "mute", "ㅂ": "close"}

    def __init__(self, page: Page, view: RendererView, choice: Choice) -> None:
        self.view, self.choice = view, choice
        self.heard, self.status = Heard(), RendererStatus()
        self.strokes: list[Stroke] = []
        super().__init__(page)

    def body(self) -> Iterable[Element]:
        return self.view.elements(self.choice, self.heard, self.status)

    def show(self, heard: Heard, status: RendererStatus) -> None:  # type: ignore[override]
        """Show the output and its status from now on."""
        if (heard, status) != (self.heard, self.status):
            self.heard, self.status, self._stale = heard, status, True

    def choose(self, choice: Choice) -> None:
        """Change to another choice."""
        if choice != self.choice:
            self.choice, self._stale = choice, True

    def pressed(self, name: str, event: Pressed) -> None:
        self._move(name, event, True)

    def dragged(self, name: str, event: Moved | Released) -> None:
        self._move(name, event, isinstance(event, Moved))

    def chosen(self, name: str, /) -> None:
        if name == "close":
            self.do(name)
        elif name.startswith("texture "):
            self.choose(self.choice.of_texture(name.removeprefix("texture "), self.view.models))
        else:
            self.choose(replace(self.choice, method=name.removeprefix("method ")))

    def key(self, name: str | None, event: Key, /) -> bool:
        if event.name == "escape":
            self.do("close")
        elif name in SLIDERS and event.name in STEPS and self.by_key:
            share = self.view.track(name, self.choice).share or 0.0
            self._put(name, min(max(share + (0.05 * STEPS[event.name]), 0.0), 1.0))
        elif event.name in ("left", "right"):
            textures = tuple(self.view.models)
            texture = beside(textures, self.choice.texture, STEPS[event.name])
            self.choose(self.choice.of_texture(texture, self.view.models))
        elif event.name in ("up", "down"):
            methods = tuple(self.view.models[self.choice.texture])
            method = beside(methods, self.choice.method, 1 if event.name == "down" else -1)
            self.choose(replace(self.choice, method=method))
        else:
            return False
        return True

    def _move(self, name: str, event: Pressed | Moved | Released, touching: bool) -> None:
        if name == "picture":
            inside = self.view.layout.picture.holds(event.x, event.y)
            self.strokes.append(Stroke(event.t_s, *self.view.mm_at(event.x, event.y), touching and inside))
        elif name in SLIDERS:
            self._put(name, self.view.track(name, self.choice).share_at(event.x))

    def _put(self, name: str, share: float) -> None:
        if name == "volume":
            self.choose(self.choice.louder(share))
        else:
            self.choose(self.choice.firmer(LIGHTEST_N + share * (FIRMEST_N - LIGHTEST_N)))
