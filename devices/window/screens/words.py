"""Words to tick, in a grid, and a field for further ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from palpate.devices.window.geometry import Box
from palpate.devices.window.inputs import Key, Pressed
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, back_and_next
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import HINT_STEPS, fitted
from palpate.devices.window.screens.grid import grid
from palpate.devices.window.screens.sliders import trial_frame
from palpate.devices.window.screens.writing import FieldOn, with_hangul
from palpate.protocols.forms import Words
from palpate.protocols.requests import Ask

FURTHER = "further"
SEPARATORS = ",;，、"


class WordScreen(Base):
    """Any number of words may be ticked; that none fits has to be said twice."""

    def __init__(self, ask: Ask, form: Words, page: Page) -> None:
        left, right = back_and_next(page)
        hint = with_hangul(page, page.texts("words_hint")) if form.further else page.texts("words_hint")
        frame = replace(trial_frame(page, ask, "words_prompt", hint, left, right), hint_above=True)
        self.form = form
        self._cells, self._columns = grid(page, [page.say(word) for word in form.words], frame.body)
        super().__init__(frame, len(self._cells), ask.may_go_back)
        self.field = self._field() if form.further else None
        self.ticked: set[str] = set()
        self.clicks: list[list[Any]] = []
        self._warned = False
        self.show(ask.previous or {})

    def body(self) -> Iterator[Element]:
        for tick in self._cells[self.sheet]:
            yield replace(tick, ticked=self._word(tick.name) in self.ticked)
        if self.field is not None:
            yield self.field.element(self.focus == FURTHER)

    def value(self) -> dict[str, Any]:
        ticked = [word for word in self.form.words if word in self.ticked]
        further = self.field.writing.words(SEPARATORS) if self.field is not None else []
        return {"answers": {"ticked": ticked, "further": further}, "clicks": self.clicks}

    def show(self, answers: Mapping[str, Any]) -> None:
        self.ticked = set(answers.get("ticked", ()))
        if self.field is not None:
            self.field.writing.text = ", ".join(answers.get("further", ()))
            self.field.writing.caret = len(self.field.writing.text)

    def pressed(self, name: str, event: Pressed) -> None:
        if name == FURTHER and self.field is not None:
            self.field.press(event.x, event.y)
        elif name.startswith("word "):
            self._toggle(name)

    def typed(self, name: str | None, text: str) -> None:
        if name == FURTHER and self.field is not None:
            self.field.type(text)
            self._warned = False

    def key(self, name: str | None, event: Key) -> bool:
        if name == FURTHER and self.field is not None:
            return event.name != "enter" and self.field.key(event)
        if name is None and event.name in ("up", "down", "left", "right", "home", "end"):
            self.focus = self._cells[self.sheet][0].name
            return True
        if name is None or not name.startswith("word "):
            return False
        if event.name == "space":
            self._toggle(name)
            return True
        return self._walk(name, event.name)

    def go_on(self) -> None:
        nothing = not self.ticked and not (self.field is not None and self.field.writing.words(SEPARATORS))
        if nothing and self.sheet == self.sheets - 1 and not self._warned:
            self._warned = True
            self.tell("none_ticked")
            self.wait_a_moment()
            return
        super().go_on()

    def stops(self) -> list[str]:
        """The whole grid is one stop: arrows move within it."""
        words = [tick.name for tick in self._cells[self.sheet]]
        here = self.focus if self.focus in words else words[0]
        return [name for name in super().stops() if name == here or not name.startswith("word ")]

    def _walk(self, name: str, key: str) -> bool:
        """To the neighbour in the grid; at its edges the focus stays."""
        names = [tick.name for tick in self._cells[self.sheet]]
        place = names.index(name)
        moves = {"left": place - 1, "right": place + 1, "up": place - self._columns, "down": place + self._columns,
                 "home": 0, "end": len(names) - 1}  # fmt: skip
        if key not in moves:
            return False
        if 0 <= moves[key] < len(names):
            self.focus = names[moves[key]]
        return True

    def _toggle(self, name: str) -> None:
        word = self._word(name)
        self.ticked ^= {word}
        self.clicks.append([word, round(self.now_s, 3), word in self.ticked])
        self.notice, self._warned = (), False

    def _word(self, name: str) -> str:
        return self.form.words[int(name.removeprefix("word "))]

    def _field(self) -> FieldOn:
        page, room = self.page, self.frame.between
        box = Box(room.left, self.frame.foot.top, room.width, self.frame.foot.height)
        told = fitted(page, page.texts("further_label"), box.width - 2 * page.metrics.unit(4), box.height, HINT_STEPS)
        return FieldOn(page, FURTHER, box, page.metrics.text(5.0), placeholder=told)
