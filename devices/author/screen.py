"""The screen with the sliders: what mouse and keyboard do to the work, and what is asked of whoever shows it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal, cast

from palpate.devices.author.board import Board, Told
from palpate.devices.author.elements import Upright
from palpate.devices.author.making import HIGHEST, LOWEST, MOST_SMOOTHING_DEG
from palpate.devices.author.work import History, Letter, Setting, Work, neutral
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import Frame
from palpate.devices.window.screens.targets import Track

Act = Literal["play", "save", "open", "export", "help", "close"]
ACTS: tuple[Act, ...] = ("play", "save", "open", "export", "help", "close")
LETTERS = {
    "p": "play", "u": "undo", "r": "redo", "c": "compare", "a": "side A", "b": "side B", "s": "save", "o": "open",
    "e": "export", "h": "help", "q": "close",
    "ㅔ": "play", "ㅕ": "undo", "ㄱ": "redo", "ㅊ": "compare", "ㅁ": "side A", "ㅠ": "side B", "ㄴ": "save",
    "ㅐ": "open", "ㄷ": "export", "ㅗ": "help", "ㅂ": "close",
}  # fmt: skip
"""What a letter does, also where Hangul is on."""
STEPS = {"up": 1.0, "down": -1.0, "pageup": 10.0, "pagedown": -10.0, "home": -HIGHEST, "end": HIGHEST}
COARSE = 10.0
"""With shift, arrows move so many times as far."""


class AuthorScreen(Base):
    """The sliders and their door. `history` is the work, `asked` what somebody else is to do."""

    def __init__(self, page: Page, board: Board, history: History) -> None:
        self.board, self.history = board, history
        self.told = Told()
        self.asked: list[Act] = []
        self._grip = 0.0
        self._gestures = 0
        super().__init__(Frame(page, "", "", (), ()))

    @property
    def work(self) -> Work:
        """What is being made."""
        return self.history.now

    def body(self) -> Iterable[Element]:
        elements = self.board.elements(self.work, replace(self.told, moved=self._is_slider(self.held)))
        return [
            replace(e, held=True) if isinstance(e, Upright | Track) and e.name == self.held else e for e in elements
        ]

    def tell(self, key: str, /, **values: str) -> None:  # type: ignore[override]
        """Say something in place of what is said of the door, until the next move."""
        self.say(self.page.texts(key, **values))

    def say(self, notice: str, wrong: bool = False) -> None:
        """The same with words of its own; `wrong` in the colour of what needs heed."""
        self.show_told(replace(self.told, notice=notice, wrong=wrong))

    def show_told(self, told: Told) -> None:
        """What is said beside the work from now on."""
        if told != self.told:
            self.told, self._stale = told, True

    def take_up(self, work: Work) -> None:
        """Another work is on, which can be undone."""
        self.history.put(work)
        self._stale = True

    def stops(self) -> list[str]:
        """Sliders first, then the smoothing, the two that are compared, and the buttons."""
        names = super().stops()
        return sorted(names, key=lambda name: not name.startswith(("wish", "smoothing")))

    def pressed(self, name: str, event: Pressed) -> None:
        if not self._is_slider(name):
            return
        self._gestures += 1
        self._grip = self._offset(name, event)
        self._move_to(name, event)

    def dragged(self, name: str, event: Moved | Released) -> None:
        if self._is_slider(name):
            self._move_to(name, event)

    def chosen(self, name: str, /) -> None:
        self._do(name)

    def typed(self, _name: str | None, text: str, /) -> None:
        for letter in text.strip().lower():
            if letter in LETTERS:
                self._do(LETTERS[letter])

    def key(self, name: str | None, event: Key, /) -> bool:
        if event.name in ("left", "right") and not self._on_smoothing(name):
            self.move_focus(1 if event.name == "right" else -1, [f"wish {n}" for n in range(len(self.work.a.wish))])
            return True
        if event.name == "enter" and not self._is_button(name):
            self._do("play")
            return True
        if name is None or not self._is_slider(name):
            return False
        return self._step(name, event)

    def go_back(self) -> None:
        """Backspace undoes nothing: what is undone is asked for by name."""

    def _is_slider(self, name: str | None) -> bool:
        return name is not None and (name.startswith("wish ") or name == "smoothing")

    def _is_button(self, name: str | None) -> bool:
        return name is not None and not self._is_slider(name)

    def _on_smoothing(self, name: str | None) -> bool:
        return name == "smoothing"

    def _offset(self, name: str, event: Pressed) -> float:
        """A marker that is taken hold of beside its middle does not jump there."""
        if name == "smoothing":
            return 0.0
        slider = self._slider(name)
        return event.y - slider.thumb.middle[1] if slider.thumb.grown(2).holds(event.x, event.y) else 0.0

    def _move_to(self, name: str, event: Pressed | Moved | Released) -> None:
        if name == "smoothing":
            share = self.board.smoother(self.work).share_at(event.x)
            setting = self.work.setting.smoothed(share * MOST_SMOOTHING_DEG)
        else:
            value = self._slider(name).value_at(event.y - self._grip)
            setting = self.work.setting.wished(_number(name), value)
        self._put(setting, (name, self._gestures))

    def _step(self, name: str, event: Key) -> bool:
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

    def _put(self, setting: Setting, gesture: tuple[object, ...]) -> None:
        before = self.work
        self.history.put(self.work.put(setting), gesture)
        if self.work != before:
            self.say("")

    def _slider(self, name: str) -> Upright:
        return self.board.slider(self.work, _number(name))

    def _do(self, name: str) -> None:
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
                self.asked.append(name)


def _number(name: str) -> int:
    return int(name.removeprefix("wish "))
