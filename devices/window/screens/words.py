"""Words to tick, in as many columns as the rows allow, at the largest size that fits; a field for further words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import ceil
from typing import Any

from palpate.devices.window.geometry import NEAREST_TARGETS_MM, Box, WindowError
from palpate.devices.window.inputs import Key, Pressed
from palpate.devices.window.paint_text import Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, back_and_next
from palpate.devices.window.screens.cards import dealt
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import HINT_STEPS, STEPS, fitted, trial_frame
from palpate.devices.window.screens.targets import Tick
from palpate.devices.window.screens.writing import FieldOn, with_hangul
from palpate.protocols.events import Ask
from palpate.protocols.forms import Words

FURTHER = "further"
SEPARATORS = ",;，、"
MOST_COLUMNS = 8
TALLEST, WIDEST = 15.0, 72.0
"""Greatest size of a cell, in the design's millimetres."""


class WordScreen(Base):
    """A list of words, any number of which may be ticked; an empty answer has to be confirmed."""

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
        # To the neighbour in the grid; at its edges the focus stays.
        names = [tick.name for tick in self._cells[self.sheet]]
        place = names.index(name)
        moves = {"left": place - 1, "right": place + 1, "up": place - self._columns, "down": place + self._columns,
                 "home": 0, "end": len(names) - 1}  # fmt: skip
        if event.name not in moves:
            return False
        if 0 <= moves[event.name] < len(names):
            self.focus = names[moves[event.name]]
        return True

    def go_on(self) -> None:
        nothing = not self.ticked and not (self.field is not None and self.field.writing.words(SEPARATORS))
        if nothing and self.sheet == self.sheets - 1 and not self._warned:
            self._warned = True
            self.tell("none_ticked")
            self.wait_a_moment()
            return
        super().go_on()

    def stops(self) -> list[str]:
        """Return the focus order with the whole grid as one stop: arrow keys move within it."""
        words = [tick.name for tick in self._cells[self.sheet]]
        here = self.focus if self.focus in words else words[0]
        return [name for name in super().stops() if name == here or not name.startswith("word ")]

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
        placeholder = fitted(
            page, page.texts("further_label"), box.width - 2 * page.metrics.unit(4), box.height, HINT_STEPS
        )
        return FieldOn(page, FURTHER, box, page.metrics.text(5.0), placeholder=placeholder)


def grid(page: Page, words: Sequence[str], room: Box) -> tuple[list[list[Tick]], int]:
    """Return the words' cells on every sheet, row by row, and the number of columns.

    Uses one sheet if possible, with the largest text for which it is. Raises WindowError that names a word too long.
    """
    sizes = list(dict.fromkeys(page.metrics.text(step) for step in STEPS))
    for sheets in range(1, len(words) + 1):
        for size in sizes:
            for columns in range(2, MOST_COLUMNS + 1):
                if cells_of_sheets := _attempt(page, dealt(words, sheets), room, size, columns):
                    return cells_of_sheets, columns
    longest = max(words, key=lambda word: page.fonts.width(word, sizes[-1]))
    fitted(page, longest, _cell(page, room, 2, 1)[0], room.height, STEPS)
    raise WindowError(f"{len(words)} words do not fit on a screen of {page.metrics}; take a larger one")


def _attempt(page: Page, sheets: list[list[str]], room: Box, size: int, columns: int) -> list[list[Tick]] | None:
    """Return the sheets at a size in `columns` columns, or None if a cell is too small for a finger or its word."""
    lines = ceil(len(sheets[0]) / columns)
    width, height = _cell(page, room, columns, lines)
    if height < page.metrics.target(0):
        return None
    space = Tick("word", Box(0, 0, width, height)).text_box(page)
    laid = []
    for sheet in sheets:
        cells_of_sheets = [_word(page, word, size, space) for word in sheet]
        if None in cells_of_sheets:
            return None
        laid.append([cell for cell in cells_of_sheets if cell is not None])
    return _cells(page, laid, room, columns, width, height)


def _word(page: Page, word: str, size: int, space: Box) -> Laid | None:
    laid = lay(page.fonts, word, size, space.width, even=True)
    return laid if laid is not None and laid.height <= space.height else None


def _cell(page: Page, room: Box, columns: int, lines: int) -> tuple[int, int]:
    """Return width and height of a cell."""
    unit, gap = page.metrics.unit, _gap(page)
    width = min(unit(WIDEST), (room.width - (columns - 1) * gap) // columns)
    return width, min(unit(TALLEST), (room.height - (lines - 1) * gap) // lines)


def _cells(page: Page, sheets: list[list[Laid]], room: Box, columns: int, width: int, height: int) -> list[list[Tick]]:
    gap, number, cells_of_sheets = _gap(page), 0, []
    left = room.left + (room.width - columns * width - (columns - 1) * gap) // 2
    for sheet in sheets:
        lines = ceil(len(sheet) / columns)
        top = room.top + (room.height - lines * height - (lines - 1) * gap) // 2
        cells = []
        for place, laid in enumerate(sheet):
            x, y = left + (place % columns) * (width + gap), top + (place // columns) * (height + gap)
            cells.append(Tick(f"word {number + place}", Box(x, y, width, height), laid=laid))
        cells_of_sheets.append(cells)
        number += len(sheet)
    return cells_of_sheets


def _gap(page: Page) -> int:
    return max(page.metrics.unit(1.2), page.metrics.mm(NEAREST_TARGETS_MM))
