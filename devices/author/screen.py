"""The screen with the sliders: how mouse and keyboard change the work, and requests to the window."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar, cast

from palpate.devices.author.elements import Upright
from palpate.devices.author.view import DesignerStatus, DesignerView
from palpate.devices.author.work import MOST_SMOOTHING_DEG, History, Letter, Setting, Work, neutral
from palpate.devices.door.making import HIGHEST, LOWEST
from palpate.devices.window.app import AppScreen
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.elements import Element

ACTS = ("play", "save", "open", "export", "help", "close")
STEPS = {"up": 1.0, "down": -1.0, "pageup": 10.0, "pagedown": -10.0, "home": -HIGHEST, "end": HIGHEST}
COARSE = 10.0
"""Factor for moves by arrow keys with shift."""


class DesignerScreen(AppScreen):
    """The screen with the sliders and their door. `history` is the work."""

    LETTERS: ClassVar = {
        "p": "play", "u": "undo", "r": "redo", "c": "compare", "a": "side A", "b": "side B", "s": "save", "o": "open",
        "e": "export", "h": "help", "q": "close",
        "ㅔ": "play", "ㅕ": "undo", "ㄱ": "redo", "ㅊ": "compare", "ㅁ": "side A", "ㅠ": "side B", "ㄴ": "save",
        "ㅐ": "open", "ㄷ": "export", "ㅗ": "help", "ㅂ": "close",
    }  # fmt: skip

    def __init__(self, page: Page, view: DesignerView, history: History) -> None:
        self.view, self.history = view, history
        self.status = DesignerStatus()
        self._grip = 0.0
        self._gestures = 0
        super().__init__(page)

    @property
    def work(self) -> Work:
        """Return the current work."""
        return self.history.now

    def body(self) -> Iterable[Element]:
        return self.view.elements(self.work, replace(self.status, moved=self._is_slider(self.held)))

    def tell(self, key: str, /, **values: str) -> None:  # type: ignore[override]
        """Show a notice in place of the door's state, until the next move."""
        self.say(self.page.texts(key, **values))

    def say(self, notice: str, wrong: bool = False) -> None:
        """Show a notice with this text, in the colour of alerts if `wrong`."""
        self.show_status(replace(self.status, notice=notice, wrong=wrong))

    def show_status(self, status: DesignerStatus) -> None:
        """Show this status beside the work from now on."""
        if status != self.status:
            self.status, self._stale = status, True

    def take_up(self, work: Work) -> None:
        """Replace the work by another, which can be undone."""
        self.history.put(work)
        self._stale = True

    def stops(self) -> list[str]:
        """Return the focus order: sliders, the smoothing, the two compared designs, and the buttons."""
        names = super().stops()
        return sorted(names, key=lambda name: not name.startswith(("wish", "smoothing")))

    def pressed(self, name: str, event: Pressed) -> None:
        if not self._is_slider(name):
            return
        self._gestures += 1
        self._grip = 0.0
        if name != "smoothing" and (thumb := self._slider(name).thumb).grown(2).holds(event.x, event.y):
            self._grip = event.y - thumb.middle[1]  # a marker that is taken beside its middle does not jump there
        self._move_to(name, event)

    def dragged(self, name: str, event: Moved | Released) -> None:
        if self._is_slider(name):
            self._move_to(name, event)

    def chosen(self, name: str, /) -> None:
        self.do(name)

    def key(self, name: str | None, event: Key, /) -> bool:
        if event.name in ("left", "right") and name != "smoothing":
            self.move_focus(1 if event.name == "right" else -1, [f"wish {n}" for n in range(len(self.work.a.wish))])
            return True
        if event.name == "enter" and (name is None or self._is_slider(name)):
            self.do("play")
            return True
        if name is None or not self._is_slider(name):
            return False
        keys = {**STEPS, "right": 1.0, "left": -1.0}
        if event.name not in keys:
            return False
        step = keys[event.name] * (COARSE if event.shift and abs(keys[event.name]) < COARSE else 1.0)
        setting = self.work.setting
        if name == "smoothing":
            moved = setting.smoothed(setting.smoothing_deg + step / 10.0)
        else:
            at = setting.wish[_number(name)]
            moved = setting.wished(_number(name), min(max(at + step, LOWEST), HIGHEST))
        self._put(moved, (name, "keys"))
        return True

    def _is_slider(self, name: str | None) -> bool:
        return name is not None and (name.startswith("wish ") or name == "smoothing")

    def _move_to(self, name: str, event: Pressed | Moved | Released) -> None:
        if name == "smoothing":
            share = self.view.smoother(self.work).share_at(event.x)
            setting = self.work.setting.smoothed(share * MOST_SMOOTHING_DEG)
        else:
            value = self._slider(name).value_at(event.y - self._grip)
            setting = self.work.setting.wished(_number(name), value)
        self._put(setting, (name, self._gestures))

    def _put(self, setting: Setting, gesture: tuple[object, ...]) -> None:
        before = self.work
        self.history.put(self.work.put(setting), gesture)
        if self.work != before:
            self.say("")

    def _slider(self, name: str) -> Upright:
        return self.view.slider(self.work, _number(name))

    def do(self, name: str) -> None:
        """Change the work by a button or key, or leave the request to the window."""
        self.say("")
        match name:
            case "undo" | "redo":
                if not (self.history.undo() if name == "undo" else self.history.redo()):
                    self.tell(f"nothing_to_{name}")
            case "reset":
                self.history.put(self.work.put(neutral(len(self.work.a.wish))))
            case "compare" if self.work.b is None:
                self.history.put(self.work.compared())
                self.tell("comparing")
            case "compare":
                self.history.put(self.work.kept())
            case "side A" | "side B":
                self.history.put(self.work.switched(cast(Letter, name[-1])), "switched")
            case _ if name in ACTS:
                self.requests.append(name)


def _number(name: str) -> int:
    return int(name.removeprefix("wish "))
